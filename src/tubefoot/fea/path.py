"""Following the path of a model from rest to a goal: step control, exact landing, snaps, named ends.

The path is stepped in its parameter (for the pump: the pumped volume), so that it passes maxima of pressure.
Each step starts from a polynomial through the last states (`predictor`). A limit, the goal among them, that
it sees coming is landed on exactly (`landing`).

With the pump standing still, a finger may stop being stable: a thin fold buckles. An equilibrium with a
negative eigenvalue is no state of the path; where the finger snaps to from there is (`settle`). Where no step
is short enough, the path goes on by its length (`arc`): at a fold the parameter turns back, and the next
stable state beyond is looked for. An end by instability is named only where one of the two was found.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.arc import Arc
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.landing import Limit, next_target, passed, value_of
from tubefoot.fea.predictor import blend, predict
from tubefoot.fea.settle import Settler
from tubefoot.fea.stability import critical_mode, place_of
from tubefoot.fea.step import Step, StepFailed
from tubefoot.fea.stride import StepControl, Stride

EASY = 8
"""Iterations up to which a step was easy enough for a longer one to follow."""
ASTRAY = 4.0
"""Way from the last state to a new one, over the foretold way, beyond which it lies on another branch."""
ARC_STEPS = 16
"""Steps by the path's length in which a fold shows, or the parameter passes what stopped it."""
BEYOND = (1 / 16, 1 / 4)
"""How far beyond a fold, over the first step, the next stable state is looked for."""
LOCATED = 1 / 4
"""Longest step over the first one in which a jump, or a loss of stability, is taken for located."""
FALLS = 2
"""Times that the structure is let fall from one state without coming to rest."""


@dataclass
class Path:
    """Converged states, from rest on, and why the path ended.

    turning_points : path parameters after which the goal's quantity turned back
    failures : steps that did not converge
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

    Raises ConvergenceError, with the history and the last converged step, when there is no way on.
    """
    stepping = stepping or StepControl()
    path = Path(list(known) or [_rest_step(model)])
    if not known and observe is not None:
        observe(path.steps[0], 0.0)
    walk = _Walk(model, [goal, *limits], stepping, observe, path)
    while len(path.steps) < stepping.most:
        walk.advance()
        if path.end_reason:
            return path
    raise ConvergenceError(f"the goal was not reached in {stepping.most} states", path.failures, path)


def _rest_step(model: Model) -> Step:
    rest = model.rest()
    model.evaluate(rest)
    return Step(rest, 0, 0.0, 1.0, model.rest_volumes.copy())


class _Walk:
    """The path as it grows."""

    def __init__(
        self,
        model: Model,
        limits: list[Limit],
        stepping: StepControl,
        observe: Observer | None,
        path: Path,
    ):
        self.model, self.limits, self.observe = model, limits, observe
        self.path = path
        self.stride = Stride(model, limits[0].control, stepping, path.steps[-1])
        # States since the last snap: no polynomial goes across one.
        self.smooth = list(path.steps)
        self._settler: Settler | None = None
        self._started, self._fold_at, self._falls, self._falling = 0.0, 0.0, 0, False

    def advance(self) -> None:
        """Add the next state, or shorten the step."""
        self._started = time.perf_counter()
        target, landing = next_target(self.model, self.smooth, self.stride.value, self.limits)
        control = Control("parameter", target) if landing is None else landing.control
        if self._falling and self._fall_to_rest(control):
            return
        try:
            guess = predict(self.smooth, target)
            step = self.model.solve(guess, control, blend(self.smooth, target), self.smooth[-1].state)
            self._require_near(guess, step)
            if landing is None and (found := passed(self.model, self.limits, self.smooth[-1], step)):
                landing, at = found
                known = [*self.smooth, step]
                step = self.model.solve(predict(known, at), landing.control, blend(known, at), step.state)
        except StepFailed as failure:
            self.path.failures.append(f"step to {target:.6g} failed: {failure}")
            if not self._falling and self._fall_to_rest(control):
                return
            if not self.stride.shorten():
                self._find_way_on(failure)
            return
        if self._lost_balance(step):
            self._leave(step)
            return
        self._falling = False
        self._accept(step, landing)
        if step.iterations <= EASY:
            self.stride.lengthen(step)

    def _require_near(self, guess: State, step: Step) -> None:
        """Refuse a state that lies much farther away than was foretold: Newton went to another branch."""
        if gone := self._strays(guess, step):
            raise StepFailed(f"it went {gone:.1f} times as far as foretold")

    def _strays(self, guess: State, step: Step) -> float:
        """How many times as far as foretold a state lies from the last one; 0 where that is near enough."""
        if len(self.smooth) < 2:
            return 0.0
        size, last = self.model.mesh.points.size, self.smooth[-1].state.unknowns
        foretold, gone = (np.linalg.norm((s.unknowns - last)[:size]) for s in (guess, step.state))
        return float(gone / foretold) if gone > ASTRAY * foretold else 0.0

    def _accept(self, step: Step, landing: Limit | None = None) -> None:
        """Take a state into the path, unless the observer ends the path before it."""
        wall_s = time.perf_counter() - self._started
        stop = self.observe(step, wall_s) if self.observe is not None else None
        if stop:
            self.path.end_reason = stop
            return
        self._falls = 0
        self._note_turning(step)
        self.path.steps.append(step)
        self.smooth.append(step)
        if landing is not None:
            self.path.end_reason = landing.reason

    def _note_turning(self, step: Step) -> None:
        """Record where the goal's quantity turned back."""
        if len(self.smooth) < 2:
            return
        values = [value_of(self.model, self.limits[0].control, s) for s in (*self.smooth[-2:], step)]
        if (values[2] - values[1]) * (values[1] - values[0]) < 0:
            self.path.turning_points.append(self.smooth[-1].state.parameter)

    def _lost_balance(self, step: Step) -> bool:
        """Whether the energy falls in some direction; the step's own factors only raise the suspicion."""
        return bool(step.unstable) and bool(self.model.linearise(step.state))

    def _leave(self, step: Step) -> None:
        """Snap from an unstable state to where the structure comes to rest."""
        before, mode = self.path.steps[-1], critical_mode(self.model, step.state)
        cause = (
            f"unstable between parameters {before.state.parameter:.6g} and {step.state.parameter:.6g}: "
            f"{mode.unstable} negative eigenvalue{'s' if mode.unstable != 1 else ''}, "
            f"{mode.stiffness:.2g} N/mm^4, largest displacement {place_of(self.model, mode)}"
        )
        try:
            self._snap(self._settled().leave(before, step, mode), cause)
        except StepFailed as failure:
            self.path.failures.append(f"no stable state found: {failure}")
            if self.stride.over_first() > LOCATED and self.stride.shorten():
                return
            self.path.end_reason = f"instability: {cause}; no stable state found beyond"

    def _snap(self, step: Step, cause: str) -> None:
        """Take a state to which the structure snapped into the path."""
        before = self.path.steps[-1]
        found = passed(self.model, self.limits, before, step)
        self.smooth = []
        self._accept(replace(step, event=f"snap: {cause}"))
        if found is not None and not self.path.end_reason:
            self.path.end_reason = f"{found[0].reason}, passed in a snap"

    def _fall_to_rest(self, control: Control) -> bool:
        """Pump on to the control and let the structure come to rest; whether it does.

        Where it goes far away it jumped. That is recorded, once the step in which it does so is a short one.
        """
        if self._falls >= FALLS:
            return False
        last = self.path.steps[-1]
        try:
            step = self._settled().advance(last, control)
            found = passed(self.model, self.limits, last, step)
            if gone := self._strays(predict(self.smooth, step.state.parameter), step):
                if self.stride.over_first() > LOCATED:
                    self.path.failures.append(f"jump, {gone:.1f} times as far as foretold: a shorter step")
                    return False
                self._snap(
                    step, f"damped motion where no step converged, from parameter {last.state.parameter:.6g}"
                )
                return True
            if found is not None:
                step = self._settled().advance(step, found[0].control)
        except StepFailed as failure:
            self.path.failures.append(f"no rest at {control.quantity} {control.target:.6g}: {failure}")
            self._falls += 1
            return False
        # Where it fell long, Newton's method seldom leads on from: the next step falls at once.
        self._falling = step.iterations > EASY
        self._accept(step, found[0] if found else None)
        return True

    def _find_way_on(self, failure: StepFailed) -> None:
        """Go on where no step of the parameter is short enough: by length, then beyond the fold."""
        turned = self._go_by_length()
        if self.path.end_reason or turned is None:
            return
        last = self.path.steps[-1]
        cause = f"damped motion where no step converged, from parameter {last.state.parameter:.6g}"
        if turned:
            cause = f"fold of the path in its parameter at {self._fold_at:.6g}"
        for share in BEYOND:
            start = self._fold_at if turned else last.state.parameter
            beyond = start + self.stride.forward * share * self.stride.first
            try:
                self._snap(self._settled().advance(last, Control("parameter", beyond)), cause)
                return
            except StepFailed as further:
                self.path.failures.append(f"no rest at {beyond:.6g}: {further}")
        if turned:
            mode = critical_mode(self.model, last.state)
            self.path.end_reason = (
                f"instability: {cause}, softest {place_of(self.model, mode)}; no stable state found beyond"
            )
            return
        raise ConvergenceError(
            f"the path could not be followed beyond parameter {last.state.parameter:.4g}: {failure}",
            self.path.failures,
            self.path,
        ) from failure

    def _go_by_length(self) -> bool | None:
        """Take steps along the arc: True at a fold, False where it gives up, None where it led on."""
        last, forward = self.path.steps[-1], self.stride.forward
        farthest, unstable = last.state.parameter, None
        failed_at = farthest + forward * self.stride.first / 8
        arc = Arc(self.model, self._before(last), last.state)
        try:
            for step in arc.steps(ARC_STEPS):
                if forward * (step.state.parameter - farthest) <= 0.0:
                    self._fold_at = farthest
                    return True
                farthest = step.state.parameter
                if unstable is None and self._lost_balance(step):
                    unstable = step
                # From there on only a fold is of interest: one leaves the unstable branch at its beginning.
                if unstable is None:
                    if passed(self.model, self.limits, self.smooth[-1], step):
                        break
                    self._accept(step)
                    if self.path.end_reason:
                        return None
                if forward * (farthest - failed_at) > 0.0:
                    break
        except StepFailed as failure:
            self.path.failures.append(f"no step by length: {failure}")
            if unstable is None:
                return False
        if unstable is not None:
            self._leave(unstable)
        self.stride.restart(1 / 8)
        return None

    def _before(self, last: Step) -> State:
        """A state before the last one: that of the path, or after a snap one along its tangent."""
        if len(self.smooth) > 1:
            return self.smooth[-2].state
        return predict([last], last.state.parameter - self.stride.forward * self.stride.shortest)

    def _settled(self) -> Settler:
        self._settler = self._settler or Settler(self.model)
        return self._settler
