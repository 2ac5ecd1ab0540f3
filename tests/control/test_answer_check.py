"""Whether the bench answers: a stuck sensor is told from a few equal samples."""

import pytest

from tubefoot.control.contract import Measurement
from tubefoot.control.guard import AnswerCheck
from tubefoot.control.settings import GuardSettings
from tubefoot.units import KPA

FRAME_S = 1 / 30


def standing(time, right_kpa, left_kpa):
    return Measurement(time, time - 0.07, 0.4, 5e-4, (right_kpa * KPA, left_kpa * KPA), 900.0, time, 0, False)


def faults(times, left):
    """Of a right branch that relaxes by 8 kPa/s beside a left one as given."""
    check = AnswerCheck(GuardSettings())
    return [check.fault(standing(time, 85.0 - 8.0 * time, left(time))) for time in times]


def test_a_stuck_sensor_is_found_while_the_other_branch_relaxes():
    found = faults([k * FRAME_S for k in range(30)], lambda time: -49.0)
    assert "left pressure" in found[-1]
    assert "stuck" in found[-1]
    assert not any(found[:15])


def test_two_equal_samples_after_a_gap_are_no_stuck_sensor():
    """As where a pressure fault is waited out in between, and nothing is measured."""
    assert faults([0.0, 0.54], lambda time: -49.0) == ["", ""]


def test_a_sensor_that_moves_is_not_stuck():
    assert not any(faults([k * FRAME_S for k in range(30)], lambda time: -49.0 + time))


@pytest.mark.parametrize("rate", [30, 10])
def test_slow_cameras_find_it_too(rate):
    assert faults([k / rate for k in range(2 * rate)], lambda time: -49.0)[-1]
