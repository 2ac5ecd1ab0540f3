"""Faults of pressure that are waited out, and those that end a grasp."""

from types import SimpleNamespace
from typing import Any

import pytest

from tubefoot.control.fault_wait import FaultWait
from tubefoot.control.guard import CLEARED_MAX, PressureGuard
from tubefoot.control.settings import GuardSettings
from tubefoot.errors import SafetyStop
from tubefoot.lab.messages import Fault
from tubefoot.units import KPA

LIMITS: Any = SimpleNamespace(pressure_low=-70 * KPA, pressure_high=60 * KPA)
GUARD = PressureGuard(LIMITS, GuardSettings(margin_kpa=8, relax_kpa=4))


class CountingRig:
    """Counts how often its faults were cleared."""

    def __init__(self) -> None:
        self.cleared = 0

    def clear_faults(self) -> None:
        """Count."""
        self.cleared += 1


def sample(right_kpa: float, faults: Fault) -> Any:
    """A reading with one pressure."""
    return SimpleNamespace(gauge_pressures=(right_kpa * KPA, 0.0), faults=faults)


def waiting() -> tuple[FaultWait, CountingRig]:
    """A wait of at most 30 s on one rig."""
    rig: Any = CountingRig()
    return FaultWait([rig], [GUARD], 30.0), rig


def test_no_fault_no_wait() -> None:
    wait, rig = waiting()
    assert not wait.waits([sample(65, Fault(0))], 0.0)
    assert rig.cleared == 0


def test_it_is_cleared_when_the_pressure_has_fallen() -> None:
    wait, rig = waiting()
    assert wait.waits([sample(60, Fault.OVER_PRESSURE)], 0.0)
    assert wait.waits([sample(53, Fault.OVER_PRESSURE)], 20.0)
    assert rig.cleared == 0
    assert not wait.waits([sample(51, Fault.OVER_PRESSURE)], 29.0)
    assert rig.cleared == 1
    assert wait.waits([sample(60, Fault.OVER_PRESSURE)], 50.0), "a new wait, a new patience"


def test_pressure_that_does_not_fall_ends_it() -> None:
    wait, _ = waiting()
    assert wait.waits([sample(60, Fault.OVER_PRESSURE)], 10.0)
    with pytest.raises(SafetyStop, match=r"not fallen for 30 s: right branch at 60.0 kPa"):
        wait.waits([sample(60, Fault.OVER_PRESSURE)], 40.1)


def test_other_faults_end_it_at_once() -> None:
    wait, _ = waiting()
    other = next(fault for fault in Fault if not fault & (Fault.OVER_PRESSURE | Fault.UNDER_PRESSURE))
    with pytest.raises(SafetyStop):
        wait.waits([sample(0, other)], 0.0)


def test_faults_that_come_again_and_again_end_it() -> None:
    wait, rig = waiting()
    for time in range(CLEARED_MAX):
        assert not wait.waits([sample(0, Fault.UNDER_PRESSURE)], float(time))
    assert rig.cleared == CLEARED_MAX
    with pytest.raises(SafetyStop):
        wait.waits([sample(0, Fault.UNDER_PRESSURE)], 99.0)
