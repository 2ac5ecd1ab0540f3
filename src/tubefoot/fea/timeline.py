"""A viscoelastic model through time: the drive ramps up, is held, and may run back.

    ramp     the goal's quantity rises evenly from 0 to its target
    hold     the pump stands still, or the goal's quantity is kept; steps grow with the time since the ramp
    return   the drive runs back evenly to where it started, in the time of the ramp
    recover  it stays there

Each step is an equilibrium at its end (see `memory` for what happens within it). A step that fails is cut in
two. A limit that is passed within a step is landed on, at the time that a straight line gives.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.landing import Limit, value_of
from tubefoot.fea.memory import Memory
from tubefoot.fea.path import Observer, Path
from tubefoot.fea.step import Step, StepFailed

MOST_CUTS = 8
"""How often a step may be halved before the solve is given up."""


@dataclass
class TimedStep(Step):
    """A converged step with its time [s]; its energy is the long-term stored one [mJ]."""

    time: float = 0.0

    @classmethod
    def at(cls, moment: float, step: Step, energy: float) -> TimedStep:
        """A step with its time.

        moment : [s]; step : the converged step; energy : long-term stored energy [mJ]
        """
        table = {entry.name: getattr(step, entry.name) for entry in fields(Step)}
        return cls(**{**table, "energy": energy}, time=moment)


@dataclass(frozen=True)
class Stage:
    """A stretch of time: its length [s], its steps, and the control at each share of it.

    growth : whether steps grow evenly in ratio, else they are equal
    control : share of the stage, 0 to 1, and the state in which it began to the control
    """

    duration: float
    steps: int
    control: Callable[[float, State], Control]
    growing: bool = False

    def ends(self, first: float) -> np.ndarray:
        """Shares of the stage at which its steps end, (steps,).

        first : wanted length of the first step where they grow [s]
        """
        even = np.arange(1, self.steps + 1) / self.steps
        ratio = _ratio(self.duration / first, self.steps) if self.growing else 1.0
        if ratio <= 1.0 + 1e-9:
            return even
        return np.asarray((ratio ** np.arange(1, self.steps + 1) - 1) / (ratio**self.steps - 1))


def _ratio(total: float, n: int) -> float:
    """Ratio of a geometric series of n terms from 1 on that sums to a total; 1 where that is too small."""
    if total <= n or n < 2:
        return 1.0
    low, high = 1.0 + 1e-12, total
    for _ in range(200):
        middle = 0.5 * (low + high)
        exceeds = n * np.log(middle) > np.log1p(total * (middle - 1))
        low, high = (low, middle) if exceeds else (middle, high)
    return float(0.5 * (low + high))


def stages(
    goal: Control, ramp: float, hold: float, recover: float, steps: int, keep_goal: bool
) -> list[Stage]:
    """The stages of a run.

    goal : where the ramp goes; ramp, hold, recover : their times [s], the last two may be 0
    steps : in each stage; keep_goal : whether the hold keeps the goal's quantity, else the pump stands
    """
    found = [Stage(ramp, steps, lambda share, _: replace(goal, target=share * goal.target))]
    if hold > 0:
        held = (lambda _, __: goal) if keep_goal else (lambda _, began: Control("parameter", began.parameter))
        found.append(Stage(hold, steps, held, growing=True))
    if recover > 0:
        found.append(
            Stage(ramp, steps, lambda share, began: Control("parameter", (1 - share) * began.parameter))
        )
        found.append(Stage(recover, steps, lambda _, __: Control("parameter", 0.0), growing=True))
    return found


class Timeline:
    """The march of one model through its stages."""

    def __init__(
        self, model: Model, memory: Memory, limits: Sequence[Limit] = (), observe: Observer | None = None
    ):
        """Start at rest.

        model : what is solved; memory : of its viscoelastic solid
        limits : where the run may end before; observe : called with every converged step
        """
        self.model, self.memory, self.limits, self.observe = model, memory, limits, observe
        memory.begin(0.0)
        rest = model.rest()
        model.evaluate(rest)
        self.path = Path([TimedStep(rest, 0, 0.0, 1.0, model.rest_volumes.copy())])

    @property
    def last(self) -> TimedStep:
        """The step that was converged last."""
        step = self.path.steps[-1]
        assert isinstance(step, TimedStep)
        return step

    def run(self, plan: Sequence[Stage], known: Sequence[TimedStep] = ()) -> Path:
        """The path through all stages.

        plan : of `stages`; known : steps of an earlier, interrupted run, from rest on

        Raises ConvergenceError, with the path so far, when a step fails however short it is.
        """
        for step in known[1:]:
            self.memory.begin(step.time - self.last.time)
            self.memory.keep(step.state)
            self.path.steps.append(step)
        if not known and self.observe is not None:
            self.observe(self.last, 0.0)
        start = 0.0
        first = plan[0].duration / plan[0].steps
        for stage in plan:
            began = self._state_at(start)
            share_done = max(0.0, (self.last.time - start) / stage.duration)
            for share in stage.ends(first):
                if share > share_done + 1e-9 and not self._advance(stage, began, start, float(share)):
                    return self.path
            start += stage.duration
        self.path.end_reason = "goal reached" if len(plan) == 1 else "all stages done"
        return self.path

    def _state_at(self, moment: float) -> State:
        """The state at the start of a stage, or the last one if that stage is yet to begin."""
        steps = [step for step in self.path.steps if isinstance(step, TimedStep)]
        return next((step.state for step in steps if step.time >= moment * (1 - 1e-9)), self.last.state)

    def _advance(self, stage: Stage, began: State, start: float, share: float) -> bool:
        """March to a share of a stage; False when the path ended on the way."""
        wanted, cuts = share, 0
        while (done := (self.last.time - start) / stage.duration) < share - 1e-9:
            started = time.perf_counter()
            moment = start + wanted * stage.duration
            try:
                step = self._step(moment, stage.control(wanted, began))
                landed = self._passed(step)
                if landed is not None:
                    limit, part = landed
                    moment = self.last.time + part * (moment - self.last.time)
                    step = self._step(moment, limit.control)
            except StepFailed as failure:
                cuts += 1
                self.path.failures.append(f"step to {moment:.4g} s failed: {failure}")
                if cuts > MOST_CUTS:
                    raise ConvergenceError(
                        f"the run could not be followed beyond {self.last.time:.4g} s: {failure}",
                        self.path.failures,
                        self.path,
                    ) from failure
                wanted = 0.5 * (done + wanted)
                continue
            energy = step.energy - self.memory.keep(step.state)
            timed = TimedStep.at(moment, step, energy)
            stop = self.observe(timed, time.perf_counter() - started) if self.observe is not None else None
            if stop:
                self.path.end_reason = stop
                return False
            self.path.steps.append(timed)
            if landed is not None:
                self.path.end_reason = landed[0].reason
                return False
            wanted = share
        return True

    def _step(self, moment: float, control: Control) -> Step:
        self.memory.begin(moment - self.last.time)
        return self.model.solve(self._guess(moment, control), control)

    def _guess(self, moment: float, control: Control) -> State:
        """Where Newton starts: the last state, carried on along the last step while the drive moves."""
        last = self.last
        if len(self.path.steps) < 2:
            return last.state
        before = self.path.steps[-2]
        assert isinstance(before, TimedStep)
        wanted = control.target - value_of(self.model, control, last)
        moved = value_of(self.model, control, last) - value_of(self.model, control, before)
        scale = max(abs(control.target), abs(moved), 1e-12)
        if abs(moved) < 1e-6 * scale or abs(wanted) < 1e-6 * scale:
            return last.state
        factor = float(np.clip(wanted / moved, -2.0, 2.0))
        a, b = last.state, before.state
        return State(
            a.unknowns + factor * (a.unknowns - b.unknowns),
            a.pressures + factor * (a.pressures - b.pressures),
            a.parameter + factor * (a.parameter - b.parameter),
        )

    def _passed(self, step: Step) -> tuple[Limit, float] | None:
        """The first limit that the step passes, and at which part of it."""
        found = []
        for number, limit in enumerate(self.limits):
            a, b = (value_of(self.model, limit.control, s) - limit.control.target for s in (self.last, step))
            if a != 0.0 and a * b < 0.0:
                found.append((a / (a - b), number))
        if not found:
            return None
        part, number = min(found)
        return self.limits[number], part
