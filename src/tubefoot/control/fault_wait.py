"""Faults of pressure that a grasp waits out: the board has stopped its pump, the walls relax, it goes on.

Any other fault ends the grasp, and so does one of pressure that lasts or comes again and again.
"""

from __future__ import annotations

from collections.abc import Sequence

from tubefoot.control.guard import CLEARED_MAX, PRESSURE_FAULTS, PressureGuard
from tubefoot.errors import SafetyStop
from tubefoot.lab.rig import Reading, Rig, fault_advice, fault_names


class FaultWait:
    """Clears pressure faults of one grasp."""

    def __init__(self, rigs: Sequence[Rig], guards: Sequence[PressureGuard], patience: float):
        """Begin without a fault.

        rigs : one or two; guards : of their pressures; patience : longest wait for pressures to fall [s]
        """
        self._both = tuple(zip(rigs, guards, strict=True))
        self._patience = patience
        self._since: float | None = None
        self._cleared = 0

    def waits(self, samples: Sequence[Reading], now: float) -> bool:
        """Whether a board still holds its pump, so that no pulse may be sent.

        samples : newest of each rig; now : [s]

        Raises SafetyStop for other faults, and for one that lasts or comes too often.
        """
        held_by = ""
        for (rig, guard), sample in zip(self._both, samples, strict=True):
            if not sample.faults:
                continue
            if sample.faults & ~PRESSURE_FAULTS or self._cleared >= CLEARED_MAX:
                raise SafetyStop(f"{fault_names(sample.faults)}; {fault_advice(sample.faults)}")
            right, left = sample.gauge_pressures[:2]
            if guard.ends_pulse(1, (right, left)) or guard.ends_pulse(-1, (right, left)):
                held_by = guard.describe((right, left))
                continue
            rig.clear_faults()
            self._cleared += 1
        if not held_by:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        if now - self._since > self._patience:
            raise SafetyStop(
                f"the pressure has not fallen for {self._patience:g} s: {held_by}; open a branch to the air "
                "or look for a pinched tube"
            )
        return True
