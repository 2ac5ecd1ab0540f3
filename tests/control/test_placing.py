"""At which height an object is held for the fingers."""

import pytest

from tubefoot.control.grasp_settings import GraspSettings
from tubefoot.control.placing import free_width, placing_height
from tubefoot.lab.grasp_object import known_object

LENGTH = 92.0


def test_the_top_of_a_block_is_level_with_the_fingertips() -> None:
    tofu = known_object("tofu")
    for pose in ("front", "side"):
        assert placing_height(tofu, pose, GraspSettings(), LENGTH) + 0.5 * tofu.sizes(pose)[2] == LENGTH  # type: ignore[arg-type]


def test_a_round_object_lies_lower() -> None:
    berry = known_object("blueberry")
    assert placing_height(berry, "front", GraspSettings(), LENGTH) == 70.0
    melon = berry.model_copy(update={"shape": "sphere", "size_mm": (60.0, 60.0, 60.0)})
    assert placing_height(melon, "front", GraspSettings(), LENGTH) == 62.0


def test_what_is_taller_than_the_fingers_stands_on_the_base() -> None:
    tower = known_object("tofu").model_copy(update={"size_mm": (20.0, 20.0, 120.0)})
    assert placing_height(tower, "front", GraspSettings(), LENGTH) == 60.0


def test_a_given_height_counts() -> None:
    assert placing_height(known_object("tofu"), "front", GraspSettings(height_mm=55.0), LENGTH) == 55.0


def test_fingers_open_by_half_the_width_and_the_clearance() -> None:
    settings = GraspSettings()
    wide = free_width(known_object("tofu"), "side", settings)
    assert wide == pytest.approx(7.5 + settings.pulses.clearance_mm)
