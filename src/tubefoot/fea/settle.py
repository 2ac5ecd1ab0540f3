"""Where a structure that lost its balance comes to rest, the path parameter (the pump) standing still.

An equilibrium that became unstable is left along its critical mode, and the energy falls by small steps of
the gradient flow (`damping`), each one a damped equilibrium, until an undamped one is met that is stable.
The drag stands for no physical viscosity: the states on the way mean nothing, where they end is what counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.damping import Drag
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.stability import CriticalMode, nodal_volumes
from tubefoot.fea.step import Step, StepFailed, Tolerance

FloatArray = NDArray[np.float64]

COARSE = Tolerance(force=1e-5, volume=1e-6, iterations=12)
"""For the states on the way."""
KICKS = (0.1, 1.0, 10.0, 100.0)
"""Displacements along the critical mode with which an unstable state is left, over that of the last step.

The smallest one that is enough counts: too small a one gives forces that pass for equilibrium.
"""
EASY = 4
"""Iterations up to which a step was easy enough for less drag."""
CALM = 0.1
"""Force of the drag over its largest, below which rest is looked for; then again at a quarter of it."""
MOST_STEPS = 120
MOST_FAILURES = 10
"""In a row, each with four times the drag, after which there is no way down."""


class _StuckError(StepFailed):
    """The forces of an unstable state pass for equilibrium."""


@dataclass
class _Descent:
    """How the fall goes: the state, the drag on it, easy steps and failures in a row, the drag's force.

    peak : largest force so far; calm : force below which rest is looked for; as densities of the force
    """

    state: State
    density: float
    easy: int = 0
    failures: int = 0
    force: float = np.inf
    peak: float = 0.0
    calm: float = np.inf


class Settler:
    """Finds where a model comes to rest; its drag stays in the model, without force in between."""

    def __init__(self, model: Model):
        """Put a drag into the model.

        model : what is solved
        """
        self.model = model
        self._volumes = nodal_volumes(model)
        self._drag = Drag(self._volumes)
        model.add(self._drag)

    def leave(self, before: Step, step: Step, mode: CriticalMode) -> Step:
        """The stable state to which the structure goes from an unstable one.

        before : the state before; step : the unstable one; mode : its critical mode

        Raises StepFailed when none is found.
        """
        size = mode.shape.size
        moved = (step.state.unknowns - before.state.unknowns)[:size]
        # Towards where the path was going; the other way only where that leads nowhere.
        shape = np.copysign(float(np.abs(moved).max()), moved @ mode.shape.ravel()) * mode.shape.ravel()
        failure = StepFailed("the structure does not leave the unstable state")
        for kick in (sign * kick for kick in KICKS for sign in (1.0, -1.0)):
            try:
                return self._fall(_kicked(step.state, kick * shape), 2.0 * abs(mode.stiffness))
            except _StuckError:
                continue
            except StepFailed as further:
                failure = further
        raise failure

    def advance(self, last: Step, parameter: float) -> Step:
        """The stable state at another value of the path parameter, however far it is.

        last : the last stable state; parameter : where

        Raises StepFailed when none is found.
        """
        start = last.state.copy()
        start.parameter = parameter
        moved = last.state.unknowns[: 3 * len(self._volumes)]
        size = float(np.repeat(self._volumes, 3) @ moved**2)
        return self._fall(start, 2.0 * abs(last.energy) / max(size, 1e-12))

    def _fall(self, start: State, density: float) -> Step:
        """The first stable equilibrium on the way down."""
        model = self.model
        exact, model.tolerance = model.tolerance, COARSE
        descent = _Descent(start, density)
        try:
            for _ in range(MOST_STEPS):
                moving = self._damped_step(descent)
                if not moving or descent.force < min(descent.calm, CALM * descent.peak):
                    found = self._rest(descent.state, exact)
                    if found is not None:
                        return found
                    descent.calm = 0.25 * descent.force
                if not moving:
                    raise _StuckError("it does not move any more and is not at rest")
        finally:
            model.tolerance = exact
            self._drag.release()
        raise StepFailed(f"no rest after {MOST_STEPS} damped steps")

    def _damped_step(self, descent: _Descent) -> bool:
        """Whether the structure went on moving, or has to be held more."""
        self._drag.hold(descent.state, descent.density)
        try:
            step = self.model.solve(descent.state, Control("parameter", descent.state.parameter))
        except StepFailed as failure:
            descent.failures += 1
            if descent.failures > MOST_FAILURES:
                raise StepFailed(f"no way down: {failure}") from failure
            descent.density, descent.easy = 4.0 * descent.density, -1
            return True
        descent.failures = 0
        gone = np.abs(step.state.unknowns - descent.state.unknowns)[: 3 * len(self._volumes)]
        descent.force = descent.density * float(gone.max())
        descent.peak = max(descent.peak, descent.force)
        descent.state = step.state
        descent.easy = descent.easy + 1 if step.iterations <= EASY else 0
        if descent.easy > 0:
            descent.density *= 0.5
        return step.iterations > 0

    def _rest(self, near: State, exact: Tolerance) -> Step | None:
        """The undamped equilibrium next to a state, None where Newton does not find a stable one."""
        self._drag.release()
        coarse, self.model.tolerance = self.model.tolerance, exact
        try:
            found = self.model.solve(near, Control("parameter", near.parameter))
            return found if not self.model.linearise(found.state) else None
        except StepFailed:
            return None
        finally:
            self.model.tolerance = coarse


def _kicked(state: State, kick: FloatArray) -> State:
    moved = state.copy()
    moved.unknowns[: len(kick)] += kick
    return moved
