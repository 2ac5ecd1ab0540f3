"""How far a step of the path goes, by what the chambers hold."""

from types import SimpleNamespace

import numpy as np
import pytest

from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.items import State
from tubefoot.fea.step import Step
from tubefoot.fea.stride import StepControl, Stride

GOAL = Control("pressure", 1.0, cavity=0)
LONG = StepControl(states=1)


def two_chambers(air=0.0):
    """What a stride asks of a model: one chamber filled from the other, 100 mm^3 each; a goal far off."""
    chamber = SimpleNamespace(rest_volume=100.0, air_volume=air)
    drive = Drive(("volume", "volume"), (1.0, -1.0))
    return SimpleNamespace(drive=drive, cavities=[chamber] * 2, slope_at_rest=lambda goal: 1e-9)


def after(pumped):
    volumes = np.array([100.0 + pumped, 100.0 - pumped])
    return Step(State(np.zeros(3), np.zeros(2), pumped), 1, 0.0, 1.0, volumes)


@pytest.mark.parametrize(("air", "first"), [(0.0, 10.0), (50.0, 15.0)])
def test_the_first_step_pumps_a_tenth_of_a_chamber_and_its_air(air, first):
    assert Stride(two_chambers(air), GOAL, LONG, after(0.0)).value == pytest.approx(first)


@pytest.mark.parametrize(("pumped", "longest"), [(10.0, 20.0), (60.0, 20.0), (70.0, 15.0), (90.0, 5.0)])
def test_a_later_step_pumps_a_fifth_but_at_most_half_of_what_is_left(pumped, longest):
    stride = Stride(two_chambers(), GOAL, LONG, after(0.0))
    for _ in range(9):
        stride.lengthen(after(pumped))
    assert stride.value == pytest.approx(longest)


def test_a_step_is_shortened_until_it_is_too_short_to_be_tried():
    stride = Stride(two_chambers(), GOAL, LONG, after(0.0))
    halvings = 0
    while stride.shorten():
        halvings += 1
    assert halvings == 5  # to 1/32 of the first one
    stride.restart(0.5)
    assert stride.value == pytest.approx(5.0)
