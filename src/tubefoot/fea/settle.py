"""Where a structure that lost its balance comes to rest, the path parameter (the pump) standing still.

An equilibrium that became unstable is left along its critical mode, and the structure falls through
pseudo-time (`pseudo_time`) until it is in an equilibrium that is stable.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.pseudo_time import PseudoTime
from tubefoot.fea.stability import CriticalMode
from tubefoot.fea.step import Step, StepFailed

FloatArray = NDArray[np.float64]

KICKS = (0.01, 0.1, 1.0, 10.0)
"""Displacements along the critical mode with which an unstable state is left, over that of the last step.

The smallest one that is enough counts: after too small a one Newton's method finds the same state again.
"""


class Settler:
    """Finds where a model comes to rest."""

    def __init__(self, model: Model):
        """Prepare the fall.

        model : what is solved
        """
        self.model = model
        self._time = PseudoTime(model)

    def leave(self, before: Step, step: Step, mode: CriticalMode) -> Step:
        """The stable state to which the structure goes from an unstable one.

        before : the state before; step : the unstable one; mode : its critical mode

        Raises StepFailed when none is found.
        """
        size = mode.shape.size
        moved = (step.state.unknowns - before.state.unknowns)[:size]
        # Towards where the path was going; the other way only where that leads nowhere.
        shape = np.copysign(float(np.abs(moved).max()), moved @ mode.shape.ravel()) * mode.shape.ravel()
        control = Control("parameter", step.state.parameter)
        failure = StepFailed("the structure does not leave the unstable state")
        for kick in (sign * kick for kick in KICKS for sign in (1.0, -1.0)):
            try:
                found = self._time.fall(_kicked(step.state, kick * shape), control, 2.0 * abs(mode.stiffness))
            except StepFailed as further:
                failure = further
                continue
            if not found.unstable:
                return found
        raise failure

    def advance(self, last: Step, control: Control) -> Step:
        """The state to which the structure goes when the control asks for another value.

        last : the last stable state; control : what is asked for

        Raises StepFailed when none is found, or one that is unstable.
        """
        found = self._time.fall(last.state, control, self._time.softness(last))
        if found.unstable:
            raise StepFailed(f"it comes to rest where {found.unstable} directions are unstable")
        return found


def _kicked(state: State, kick: FloatArray) -> State:
    moved = state.copy()
    moved.unknowns[: len(kick)] += kick
    return moved
