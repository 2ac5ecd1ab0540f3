"""Outlines: areas, offsets and distances against what a polygon of points says."""

import numpy as np
import pytest

from tubefoot.design.outline import Outline, chamber, nearest, silhouette
from tubefoot.design.profile import chamber_rest_volume

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def shoelace(points):
    x, z = points.T
    return 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))


def test_area_of_a_rounded_square_is_the_closed_form():
    assert Outline(SQUARE, np.full(4, 1.0)).area() == pytest.approx(16 - (4 - np.pi))


@pytest.mark.parametrize("design", ["reference", "rounded"])
def test_areas_agree_with_points_and_closed_form(design, request):
    p = request.getfixturevalue(design).profile
    for outline in (silhouette(p), chamber(p), chamber(p).mirrored()):
        # Chords cut at most a turn of pi/24 off each arc.
        assert shoelace(outline.points()) == pytest.approx(outline.area(), rel=3e-4)
    assert chamber(p).area() * (p.height - 2 * p.side_wall) == pytest.approx(
        chamber_rest_volume(p), rel=1e-12
    )


def test_points_of_an_arc_lie_on_its_circle():
    points = Outline(SQUARE, np.array([1.0, 0.0, 0.0, 0.0])).points()
    on_arc = points[(points[:, 0] < 1) & (points[:, 1] < 1)]
    assert len(on_arc) > 5
    assert np.linalg.norm(on_arc - [1.0, 1.0], axis=1) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("distance", [0.15, -0.15])
def test_an_offset_outline_is_everywhere_that_far_away(rounded, distance):
    outline = chamber(rounded.profile)
    moved = outline.offset(distance)
    near = nearest(outline.points(), moved.points())[0]
    assert near == pytest.approx(abs(distance), rel=0.02)
    assert (moved.area() - outline.area()) * distance > 0
    # Fillets stay concentric: convex corners grow by the distance, concave ones shrink by it.
    turns, round_ones = outline.turns(), outline.radii > 0
    assert moved.radii[round_ones] == pytest.approx((outline.radii + distance * np.sign(turns))[round_ones])


def test_there_and_back_is_the_same_outline(rounded):
    outline = silhouette(rounded.profile)
    back = outline.offset(0.2).offset(-0.2)
    assert back.corners == pytest.approx(outline.corners)
    assert back.radii == pytest.approx(outline.radii)


def test_nearest_of_two_squares():
    distance, middle = nearest(SQUARE, SQUARE + np.array([7.0, 0.0]))
    assert distance == pytest.approx(3.0)
    assert middle[0] == pytest.approx(5.5)


def test_thinnest_wall_of_the_section_is_t1(reference):
    p = reference.profile
    distance, place = nearest(silhouette(p).points(), chamber(p).points())
    assert distance == pytest.approx(p.fold_wall)
    assert p.valley_inside < place[0] < p.crest_outside
