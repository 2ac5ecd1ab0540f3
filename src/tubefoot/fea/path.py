"""Following the path of a model from rest to a goal: predictor, step control, exact landing, named ends.

The path is stepped in its parameter (for the pump: the pumped volume), so that it passes maxima of pressure.
Each step starts from a polynomial through the last states, of the degree that would have foretold the last
one best: high where the path is smooth, a line behind a kink such as a beginning contact. A limit, the goal
among them, that the predictor sees coming is landed on exactly.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model, Step, StepFailed
from tubefoot.fea.items import State

OVERSHOOT = 0.02
"""Share of a step by which a limit may lie beyond its end and still be landed on with it."""


EASY = 8
"""Iterations up to which a step was easy enough for a longer one to follow."""


@dataclass(frozen=True)
class Limit:
    """A value at which the path ends, and what that means.

    control : the quantity and its value; reason : what to report when it is reached
    """

    control: Control
    reason: str


@dataclass(frozen=True)
class StepControl:
    """How the path is stepped.

    states : how many states the way to the goal is cut into, about
    growth : factor on the step after an easy one; shrink : after a failed one
    smallest : shortest step over the first one before the path is given up
    most : states after which the path is given up
    """

    states: int = 8
    growth: float = 1.5
    shrink: float = 0.5
    smallest: float = 1 / 256
    most: int = 400


@dataclass
class Path:
    """Converged states, from rest on, and why the path ended.

    turning_points : path parameters after which the goal's quantity turned back
    """

    steps: list[Step]
    end_reason: str = ""
    turning_points: list[float] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


Observer = Callable[[Step, float], str | None]
"""Called with each converged step and its wall time [s]; a text that it returns ends the path before it."""


def follow(
    model: Model,
    goal: Limit,
    limits: Sequence[Limit] = (),
    stepping: StepControl | None = None,
    observe: Observer | None = None,
    known: Sequence[Step] = (),
) -> Path:
    """The path from rest, or from the last known state, to the first limit that it meets.

    model : what is solved; goal : where to go; limits : where the path may end before
    stepping : step control; observe : called with every converged state
    known : converged steps of an earlier, interrupted run of the same model, from rest on

    Raises ConvergenceError, with the history and the last converged step, when no step is short enough.
    """
    stepping = stepping or StepControl()
    path = Path(list(known) or [_rest_step(model)])
    if not known and observe is not None:
        observe(path.steps[0], 0.0)
    stride = _first_stride(model, goal.control, stepping)
    shortest, longest = abs(stride) * stepping.smallest, abs(stride)
    while len(path.steps) < stepping.most:
        started = time.perf_counter()
        target, landing = _next_target(model, path, stride, [goal, *limits])
        try:
            step = model.solve(_predict(path.steps, target), _control(target, landing))
            if landing is None and (passed := _passed(model, [goal, *limits], path.steps[-1], step)):
                landing, at = passed
                step = model.solve(_predict([*path.steps, step], at), landing.control)
        except StepFailed as failure:
            path.failures.append(f"step to {target:.6g} failed: {failure}")
            stride *= stepping.shrink
            if abs(stride) < shortest:
                last = path.steps[-1]
                raise ConvergenceError(
                    f"the path could not be followed beyond parameter {last.state.parameter:.4g}: {failure}",
                    path.failures,
                    path,
                ) from failure
            continue
        stop = observe(step, time.perf_counter() - started) if observe is not None else None
        if stop:
            path.end_reason = stop
            return path
        _note_turning(model, goal.control, path, step)
        path.steps.append(step)
        if landing is not None:
            path.end_reason = landing.reason
            return path
        if step.iterations <= EASY:
            stride = np.copysign(min(longest, abs(stride) * stepping.growth), stride)
    raise ConvergenceError(f"the goal was not reached in {stepping.most} states", path.failures, path)


def value_of(model: Model, control: Control, step: Step) -> float:
    """Value of a control's quantity at a converged step.

    model : the model solved; control : names the quantity; step : where
    """
    if control.quantity == "parameter":
        return step.state.parameter
    if control.quantity == "pressure":
        return float(step.state.pressures[control.cavity])
    if control.quantity == "volume_change":
        return float(step.volumes[control.cavity] - model.rest_volumes[control.cavity])
    assert control.measure is not None
    return control.measure(step.state.unknowns)[0]


def _rest_step(model: Model) -> Step:
    rest = model.rest()
    model.evaluate(rest)
    return Step(rest, 0, 0.0, 1.0, model.rest_volumes.copy())


def _first_stride(model: Model, goal: Control, stepping: StepControl) -> float:
    """Path parameter of the first step: its share of the way to the goal, by the tangent at rest."""
    slope = model.slope_at_rest(goal)
    if slope == 0.0:
        raise ConvergenceError(f"the drive does not move the goal's quantity ({goal.quantity})")
    return goal.target / slope / stepping.states


def _control(target: float, landing: Limit | None) -> Control:
    return Control("parameter", target) if landing is None else landing.control


def _next_target(
    model: Model, path: Path, stride: float, limits: Sequence[Limit]
) -> tuple[float, Limit | None]:
    """Parameter of the next state, and the limit to land on if one lies within the step."""
    here = path.steps[-1].state.parameter
    crossings = [
        (abs(at - here), at, k)
        for k, limit in enumerate(limits)
        if (at := _crossing(model, limit.control, path.steps, stride)) is not None
    ]
    if not crossings:
        return here + stride, None
    _, target, nearest = min(crossings)
    return target, limits[nearest]


def _passed(model: Model, limits: Sequence[Limit], before: Step, after: Step) -> tuple[Limit, float] | None:
    """The first limit that lies between two states, and about where."""
    found = []
    for number, limit in enumerate(limits):
        a, b = (value_of(model, limit.control, step) - limit.control.target for step in (before, after))
        roundoff = 1e-10 * abs(limit.control.target)
        if abs(a) > roundoff and (a * b < 0.0 or abs(b) <= roundoff):
            found.append((a / (a - b), number))
    if not found:
        return None
    share, number = min(found)
    start, end = before.state.parameter, after.state.parameter
    return limits[number], start + share * (end - start)


def _crossing(model: Model, control: Control, steps: Sequence[Step], stride: float) -> float | None:
    """Parameter within the next step at which the extrapolated quantity meets its value."""
    here = steps[-1].state.parameter
    reach = here + (1 + OVERSHOOT) * stride
    if control.quantity == "parameter":
        inside = min(here, reach) <= control.target <= max(here, reach)
        return control.target if inside else None
    now = value_of(model, control, steps[-1])
    if len(steps) == 1:
        return None
    fractions = np.linspace(0.0, 1.0, 41)
    values = [
        _extrapolated(model, control, steps, here + f * (reach - here)) - control.target for f in fractions
    ]
    values[0] = now - control.target
    for k in range(40):
        if values[k] != 0.0 and values[k] * values[k + 1] <= 0.0:
            share = values[k] / (values[k] - values[k + 1])
            return float(here + (fractions[k] + share * (fractions[k + 1] - fractions[k])) * (reach - here))
    return None


def _extrapolated(model: Model, control: Control, steps: Sequence[Step], parameter: float) -> float:
    recent = steps[-3:]
    weights = _weights([step.state.parameter for step in recent], parameter)
    return float(sum(w * value_of(model, control, s) for w, s in zip(weights, recent, strict=True)))


def _weights(parameters: Sequence[float], at: float) -> list[float]:
    """Lagrange weights of the polynomial through the given parameters."""
    weights = []
    for i, p in enumerate(parameters):
        others = [q for j, q in enumerate(parameters) if j != i]
        weights.append(float(np.prod([(at - q) / (p - q) for q in others])))
    return weights


HIGHEST_DEGREE = 3


def _predict(steps: Sequence[Step], parameter: float) -> State:
    """The state that the polynomial through the last states has at a parameter."""
    recent = [step.state for step in steps[-_degree(steps) - 1 :]]
    weights = _weights([state.parameter for state in recent], parameter)
    return State(
        sum((w * s.unknowns for w, s in zip(weights, recent, strict=True)), np.zeros(1)),
        sum((w * s.pressures for w, s in zip(weights, recent, strict=True)), np.zeros(1)),
        parameter,
    )


def _degree(steps: Sequence[Step]) -> int:
    """Degree of the polynomial that would have foretold the last state best."""
    last, before = steps[-1].state, [step.state for step in steps[:-1]]
    errors = {}
    for degree in range(1, min(HIGHEST_DEGREE, len(before) - 1) + 1):
        recent = before[-degree - 1 :]
        weights = _weights([state.parameter for state in recent], last.parameter)
        foretold = sum((w * s.unknowns for w, s in zip(weights, recent, strict=True)), np.zeros(1))
        errors[degree] = float(np.linalg.norm(foretold - last.unknowns))
    return min(errors, key=lambda degree: errors[degree]) if errors else len(before)


def _note_turning(model: Model, goal: Control, path: Path, step: Step) -> None:
    """Record where the goal's quantity turned back."""
    if len(path.steps) < 2:
        return
    values = [value_of(model, goal, s) for s in (*path.steps[-2:], step)]
    if (values[2] - values[1]) * (values[1] - values[0]) < 0:
        path.turning_points.append(path.steps[-1].state.parameter)
