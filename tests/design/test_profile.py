"""Derived lengths against hand calculation, areas against polygons, volumes against sampling."""

from math import atan, cos, degrees

import numpy as np
import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.design.profile import chamber_rest_volume


def test_reference_lengths(reference):
    p = reference.profile
    assert p.pitch == 7.0
    assert (p.partition_face, p.valley_inside, p.valley_outside) == (1.0, 4.0, 6.0)
    assert (p.slot_end, p.crest_outside) == (9.5, 11.0)
    assert p.envelope == (22.0, 9.0, 3 * 7 + 8)
    assert degrees(p.corner_turn) == pytest.approx(90 - degrees(atan(0.2)))


def test_flank_is_t1_thick_normal_to_its_faces(reference):
    p = reference.profile
    outer, inner = p.outer_corners(), p.chamber_corners()
    along = (outer[1] - outer[0]) / np.linalg.norm(outer[1] - outer[0])
    normal = np.array([-along[1], along[0]])
    assert (inner[0] - outer[0]) @ normal == pytest.approx(p.fold_wall)
    assert (inner[1] - outer[0]) @ normal == pytest.approx(p.fold_wall)
    assert p.flank_axial == pytest.approx(p.fold_wall / cos(atan(p.slope)))


@pytest.mark.parametrize("fillet", [0.0, 0.3, 0.6])
def test_chamber_volume_is_that_of_a_fine_grid(reference, fillet):
    p = reference.with_bellows(units=1, fillet_chamber_mm=fillet).profile
    x = np.linspace(p.valley_inside, p.slot_end, 4001)
    slot = sum(2 * _half_slot(p, middle) for middle in (x[1:] + x[:-1]) / 2) * (x[1] - x[0])
    area = slot + p.chamber_gap * p.pitch
    assert chamber_rest_volume(p) == pytest.approx(area * (p.height - 2 * p.side_wall), rel=2e-6)


def test_the_valley_stays_put_when_walls_change():
    design = FingerDesign().with_bellows(valley_outside_mm=6.0)
    thick = design.with_bellows(valley_wall_mm=2.5, partition_mm=3.0)
    assert thick.profile.valley_outside == design.profile.valley_outside == 6.0
    assert thick.profile.chamber_gap == pytest.approx(6.0 - 2.5 - 1.5)


def test_the_gap_stays_put_when_it_is_given():
    thick = FingerDesign().with_bellows(chamber_gap_mm=2.5, valley_wall_mm=2.5)
    assert thick.profile.chamber_gap == pytest.approx(2.5)
    assert thick.profile.valley_outside == pytest.approx(1.0 + 2.5 + 2.5)


def test_a_copy_keeps_the_other_sections():
    design = FingerDesign.model_validate({"ports": {"length_mm": 11.0}, "printing": {"tool_mm": 1.1}})
    copy = design.with_bellows(units=9)
    assert (copy.ports.length_mm, copy.printing.tool_mm, copy.bellows.units) == (11.0, 1.1, 9)


def _half_slot(p, x: float) -> float:
    """Half width of the slot at x with its fillets, by geometry of circles, independent of `outline`."""
    flat = p.slot_half_width(x)
    r = p.fillet_chamber
    if r == 0:
        return flat
    lean = atan(p.slope)
    for sign, corner_x, inside in ((1.0, p.slot_end, True), (-1.0, p.valley_inside, False)):
        # The circle touches the line x = corner_x and the flank; its centre lies r from both.
        centre_x = corner_x - sign * r
        centre_z = p.slot_half_width(centre_x) - sign * r / cos(lean)
        touch_x = centre_x + sign * r * np.sin(lean)
        if (x - touch_x) * sign > 0 and abs(x - centre_x) <= r:
            bulge = np.sqrt(r**2 - (x - centre_x) ** 2)
            return centre_z + bulge if inside else centre_z - bulge
    return flat
