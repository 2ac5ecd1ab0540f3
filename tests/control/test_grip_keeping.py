"""How a grip is made firm and kept: whose pulse, which way, and when none."""

from math import inf

import pytest

from tubefoot.control.first_contact import Pause, grip_lever
from tubefoot.control.grasp_settings import GripSettings
from tubefoot.control.grip_goal import GripGoal
from tubefoot.control.grip_keeping import GripBuilder, GripKeeper
from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG

GOAL = GripGoal(0.12, 0.3, 0.08)
SETTINGS = GripSettings()
LEVER = grip_lever(reference_file().to_finger(), 70.0)
REST = Pause(0.0, 0.0, 0.0, 0.0)
FURTHER = Pause(2.0 * DEG, 0.0, 2.0 * DEG, 0.0)


def keeper(coupled: bool = False, force: float = 0.12) -> GripKeeper:
    """One that has seen both fingers at rest."""
    found = GripKeeper(GOAL, SETTINGS, LEVER, coupled)
    assert found.pulses((REST, REST), (force, force)) == (0, 0)
    return found


def test_reach_is_that_of_the_links() -> None:
    """Units of one angle each: sums of angle times arm, at a height of 70 mm."""
    middles = [4.0 + 7.0 * (unit + 0.5) for unit in range(12)]
    exact = sum(max(70.0 - z, 0.0) * 0.01 for z in middles)
    assert LEVER.reach(Pause(0.06, 0.06, 0.12, 0.0)) == pytest.approx(exact)


@pytest.mark.parametrize(
    ("pauses", "forces", "expected"),
    [
        ((REST, REST), (0.12, 0.12), (0, 0)),
        ((REST, REST), (0.09, 0.09), (1, 1)),
        ((FURTHER, REST), (0.11, 0.11), (0, 1)),
        ((REST, FURTHER), (0.11, 0.11), (1, 0)),
        ((FURTHER, REST), (0.14, 0.14), (-1, 0)),
        ((REST, FURTHER), (0.14, 0.14), (0, -1)),
        ((FURTHER, FURTHER), (0.12, 0.12), (0, 0)),
        ((REST, REST), (0.05, 0.19), (0, 0)),
    ],
)
def test_place_and_force_are_kept(pauses, forces, expected) -> None:  # type: ignore[no-untyped-def]
    assert keeper().pulses(pauses, forces) == expected


def test_nothing_is_pressed_beyond_what_the_object_bears() -> None:
    tight = GripKeeper(GripGoal(0.12, 0.05, 0.08), SETTINGS, LEVER, False)
    assert tight.pulses((REST, REST), (0.06, 0.06)) == (0, 0)
    assert tight.pulses((FURTHER, REST), (0.06, 0.06)) == (-1, 0)


def test_one_pump_cannot_put_it_back() -> None:
    one = keeper(coupled=True)
    assert one.pulses((FURTHER, REST), (0.12, 0.12)) == (0, 0)
    assert one.pulses((FURTHER, REST), (0.09, 0.09)) == (1, 1)


def test_a_grip_that_got_no_firmer_is_kept_as_it_was() -> None:
    weak = keeper(force=0.09)
    assert weak.pulses((REST, REST), (0.08, 0.08)) == (0, 0)
    assert weak.pulses((REST, REST), (0.07, 0.07)) == (1, 1)


def test_forces_rise_side_by_side() -> None:
    builder = GripBuilder(GOAL, SETTINGS, False)
    assert builder.pulses((0.02, 0.02)) == (1, 1)
    assert builder.pulses((0.02, 0.05)) == (1, 0)
    assert builder.pulses((0.11, 0.125)) == (1, 0)
    assert builder.pulses((0.12, 0.125)) == (0, 0)
    assert GripBuilder(GOAL, SETTINGS, True).pulses((0.02, 0.05)) == (1, 1)


@pytest.mark.parametrize(("level", "short"), [(0.07, True), (0.09, False)])
def test_pulses_that_add_nothing_end_it(level: float, short: bool) -> None:
    builder = GripBuilder(GOAL, SETTINGS, False)
    count = 0
    while builder.pulses((level, level)) != (0, 0):
        count += 1
    assert count == SETTINGS.stalled_pulses
    assert ("0.070 N instead of 0.120 N" in builder.shortcoming) == short


def test_the_bound_ends_it() -> None:
    builder = GripBuilder(GOAL, SETTINGS, False)
    assert builder.pulses((0.02, 0.3)) == (0, 0)
    assert GripBuilder(GripGoal(0.12, inf, 0.08), SETTINGS, False).pulses((0.02, 0.3)) == (1, 0)
