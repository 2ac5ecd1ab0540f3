"""Near the pressure limit a running pulse may slow down, but none may begin or grow."""

from types import SimpleNamespace
from typing import Any

import pytest

from tubefoot.control.contract import Pulse, Stop, Wait
from tubefoot.control.guard import AnswerCheck
from tubefoot.control.loop import BendLoop
from tubefoot.control.motion import MotionState
from tubefoot.control.settings import BendSettings
from tubefoot.units import KPA

LIMITS: Any = SimpleNamespace(pressure_low=-90 * KPA, pressure_high=90 * KPA)


def allowed(command, pressure_kpa, running=1, duty=0.5):
    """What becomes of a command while the pump runs, or stands, at a pressure."""
    settings = BendSettings()
    loop = BendLoop(SimpleNamespace(limits=LIMITS), None, settings)
    state = MotionState(AnswerCheck(settings.guard), 0.0, 1e9, "", duty=duty, direction=1)
    sample = SimpleNamespace(gauge_pressures=(pressure_kpa * KPA, -20 * KPA), direction=running, time=1.0)
    return loop._within_limits(command, sample, state, 1.0)


@pytest.mark.parametrize("duty", [0.3, 0.5])
def test_a_running_pulse_goes_on_at_no_larger_duty(duty):
    command = Pulse(1, duty, 0.5, "fill on", in_place=True)
    assert allowed(command, 83.0) is command


@pytest.mark.parametrize(
    ("command", "running", "end"),
    [
        (Pulse(1, 0.6, 0.5, in_place=True), 1, Stop),  # faster
        (Pulse(1, 0.3, 0.5), 0, Wait),  # a new one
        (Pulse(1, 0.3, 0.5, in_place=True), 0, Wait),  # the one before has ended
    ],
)
def test_others_wait_until_the_wall_has_relaxed(command, running, end):
    assert isinstance(allowed(command, 83.0, running), end)
    assert allowed(command, 70.0, running) is command


def test_at_the_limit_a_slower_pulse_ends_too():
    assert isinstance(allowed(Pulse(1, 0.3, 0.5, in_place=True), 87.0), Stop)
