"""Following a path through given values of its parameter, in steps that halve where Newton does not converge.

Where `path.follow` seeks one goal from rest, a grasp has stations: open, object in place, several grips. Each
step starts from the line through the last two states; where contact begins that line leads through a wall,
and a shorter step is tried, then one from the last state itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import ceil

from tubefoot.errors import ConvergenceError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.path import EASY, Path
from tubefoot.fea.step import Step, StepFailed

Observer = Callable[[Step, float], str | None]

SMALLEST = 1 / 64
"""Shortest step over the longest one before a path is given up."""
ROUNDOFF = 1e-9
GROWTH = 1.5
"""Factor on the step after an easy one."""


def walk(
    model: Model, path: Path, stations: Sequence[float], stride: float, observe: Observer | None = None
) -> str | None:
    """Append the converged steps through all stations to a path; why it ended before the last one, else None.

    model : what is solved; path : begins with a converged step; stations : parameters to land on, in order
    stride : longest step; observe : called with each converged step and its wall time [s], a text that it
        returns ends the path before that step

    Raises ConvergenceError, with the path so far, when no step is short enough.
    """
    before = None
    length = abs(stride)
    for station in stations:
        while (way := station - path.steps[-1].state.parameter) and abs(way) > ROUNDOFF * abs(stride):
            started = time.perf_counter()
            count = max(1, ceil(abs(way) / length - 1e-6))
            target = station if count == 1 else station - way * (count - 1) / count
            step = _step(model, before, path.steps[-1].state, target, path)
            if step is None:
                length /= 2.0
                if length < SMALLEST * abs(stride):
                    last = path.steps[-1].state.parameter
                    raise ConvergenceError(
                        f"the path could not be followed beyond parameter {last:.4g}: {path.failures[-1]}",
                        path.failures,
                        path,
                    )
                continue
            stop = observe(step, time.perf_counter() - started) if observe is not None else None
            if stop:
                return stop
            before = path.steps[-1].state
            path.steps.append(step)
            if step.iterations <= EASY:
                length = min(abs(stride), GROWTH * length)
    return None


def _step(model: Model, before: State | None, last: State, target: float, path: Path) -> Step | None:
    """The converged step to a parameter, None where neither start leads there; failures are noted."""
    guesses = [last] if before is None else [_line(before, last, target), last]
    for guess in guesses:
        try:
            return model.solve(guess, Control("parameter", target))
        except StepFailed as failure:
            path.failures.append(f"step to {target:.6g} failed: {failure}")
    return None


def _line(before: State, last: State, parameter: float) -> State:
    """The state that the line through two has at a parameter."""
    share = (parameter - last.parameter) / (last.parameter - before.parameter)
    return State(
        last.unknowns + share * (last.unknowns - before.unknowns),
        last.pressures + share * (last.pressures - before.pressures),
        parameter,
    )
