"""Where tubes, seats, pins and screws go."""

from math import pi

import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.design.layout import (
    base_of,
    gripper_base_of,
    lip_of,
    marker_plate_of,
    pin_places,
    stretched_hose_outer,
    tube_axis,
)


def test_twelve_units_carry_the_tags_that_the_vision_layout_wants():
    assert marker_plate_of(FingerDesign().with_bellows(units=12)).units == (2, 5, 8, 11)


@pytest.mark.parametrize(("units", "seats"), [(1, ()), (2, (2,)), (3, (2,)), (6, (2, 5))])
def test_seats_of_shorter_fingers(units, seats):
    plate = marker_plate_of(FingerDesign().with_bellows(units=units))
    assert plate.units == seats
    assert plate.heights == tuple((unit - 0.5) * 7.0 for unit in seats)


def test_given_seats_are_kept_in_order():
    design = FingerDesign.model_validate({"marker_seats": {"units": [6, 1, 3]}})
    assert marker_plate_of(design).units == (1, 3, 6)
    assert marker_plate_of(FingerDesign.model_validate({"marker_seats": {"units": []}})).units == ()


def test_the_bore_is_flush_with_the_valley_unless_the_tube_needs_cover():
    design = FingerDesign()
    assert tube_axis(design.profile, design.ports) == pytest.approx(4.0 - 1.0)
    thin = design.with_bellows(valley_wall_mm=1.5, valley_outside_mm=6.0)
    # The bore could go to 3.5, but then 1.7 of tube leaves less than 1 mm of cap beside it.
    assert tube_axis(thin.profile, thin.ports) == pytest.approx(6.0 - 1.0 - 1.7)


def test_a_stretched_hose_keeps_its_section():
    ports = FingerDesign().ports
    outer = stretched_hose_outer(ports)
    before = pi / 4 * (ports.hose_outer_mm**2 - ports.hose_bore_mm**2)
    assert pi / 4 * (outer**2 - ports.outer_diameter_mm**2) == pytest.approx(before)


def test_the_lip_follows_the_partition_and_can_be_left_out():
    assert lip_of(FingerDesign()).width == pytest.approx(0.8)
    assert lip_of(FingerDesign().with_bellows(partition_mm=1.4)) is None
    assert lip_of(FingerDesign.model_validate({"registration": {"lip_width_mm": 0.0}})) is None
    assert pin_places(FingerDesign.model_validate({"registration": {"pin_diameter_mm": 0.0}})) == ()


def test_gripper_crests_face_each_other_at_the_gap():
    design = FingerDesign.model_validate({"gripper": {"finger_gap_mm": 12.0}})
    left, right = gripper_base_of(design).finger_x
    assert right - left - 2 * design.profile.crest_outside == pytest.approx(12.0)
    assert left == -right


def test_screw_heads_clear_socket_and_edge():
    design = FingerDesign()
    mount = base_of(design)
    for _, y in mount.screws:
        assert abs(y) - design.base.screw_head_mm / 2 > mount.socket_half_y
        assert abs(y) + design.base.screw_head_mm / 2 < mount.plate_half_y
