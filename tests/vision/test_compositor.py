"""Compositor and exposure: drawn places and amounts against projection and statistics."""

import numpy as np
import pytest

from tubefoot.units import DEG
from tubefoot.vision.alignment import MarkerTarget, align_marker
from tubefoot.vision.compositor import Decal, Patch, Scene, Shutter, marker_decal, render, still
from tubefoot.vision.exposure import Exposure, expose, streak_kernel
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlaneMap, PlanePose

LENS = Lens.centred(320, 240, 500.0, (-0.15, 0.05, 0.001, -0.001, 0.0))
PLANE = PlanePose.facing(150.0, 12 * DEG, -9 * DEG)


def centroid(picture, background):
    weight = np.abs(picture - background)
    rows, columns = np.indices(picture.shape)
    return np.array([np.sum(weight * columns), np.sum(weight * rows)]) / weight.sum()


@pytest.mark.parametrize("place", [(0, 0), (28, -20), (-30, 18)])
def test_a_small_card_lies_where_it_projects(place):
    card = Decal(np.ones((1, 1), np.float32), 2.0, 2.0, still(PlanarPose(*place, 0.3)))
    picture = render(Scene(LENS, PLANE, [card], background=0.0, samples=4))
    true = PLANE.to_pixels([place], LENS)[0]
    np.testing.assert_allclose(centroid(picture, 0.0), true, atol=0.03)


def test_area_of_a_card_is_kept():
    """Light of a white card on black: its area in pixels, by the shoelace formula of its outline."""
    card = Decal(np.ones((2, 2), np.float32), 20.0, 12.0, still(PlanarPose(3, 4, 0.7)))
    corners = PlanarPose(3, 4, 0.7).to_outer([[-10, -6], [10, -6], [10, 6], [-10, 6]])
    outline = np.vstack(
        [np.linspace(a, b, 50)[:-1] for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    )
    x, y = PLANE.to_pixels(outline, LENS).T
    area = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    picture = render(Scene(LENS, PLANE, [card], background=0.0))
    assert picture.sum() == pytest.approx(area, rel=2e-3)


def test_patch_and_card_agree():
    outline = np.array([[-8.0, -5], [8, -5], [8, 5], [-8, 5]])
    patch = render(Scene(LENS, PLANE, [Patch(outline, 1.0)], background=0.0))
    white = Decal(np.ones((1, 1), np.float32), 16, 10, still(PlanarPose()))
    card = render(Scene(LENS, PLANE, [white], background=0.0))
    assert np.abs(patch - card).mean() < 1e-3
    assert patch.sum() == pytest.approx(card.sum(), rel=5e-3)


def test_rolling_shutter_shears_a_moving_card():
    """Rows are read later further down, so a card moving to the right leans by speed times row delay."""

    def moving(time_s):
        return PlanarPose(100.0 * time_s, 0.0, 0.0)

    facing = PlanePose.facing(150.0)
    lens = Lens.centred(320, 240, 500.0)
    scene = Scene(lens, facing, [Decal(np.ones((1, 1), np.float32), 20, 40, moving)], background=0.0)
    picture = render(scene, 0.0, Shutter(line_time_s=1e-4))
    rows = np.arange(80, 161)
    columns = np.arange(320)
    middle = (picture[rows] * columns).sum(axis=1) / picture[rows].sum(axis=1)
    slope = np.polyfit(rows, middle, 1)[0]
    speed_px = 100.0 * 500 / 150
    assert slope == pytest.approx(speed_px * 1e-4, rel=0.02)


def test_rolling_shutter_is_corrected_by_alignment():
    lens, facing = Lens.centred(320, 240, 500.0), PlanePose.facing(125.0)
    line_time, speed = 6e-5, 40.0

    def moving(time_s):
        return PlanarPose(speed * time_s, 3.0, 0.2)

    scene = Scene(lens, facing, [marker_decal("4x4_50", 4, 10.0, moving)])
    frame = expose(render(scene, 0.0, Shutter(line_time_s=line_time)), Exposure(), np.random.default_rng(0))
    plane_map, target = PlaneMap(lens, facing), MarkerTarget("4x4_50", 4, 10.0, 1.67)
    start = moving(0.0)
    plain = align_marker(frame, plane_map, target, start)
    corrected = align_marker(frame, plane_map, target, start, row_drift=(speed * line_time, 0.0))
    assert abs(plain.pose.angle - 0.2) / DEG > 0.2
    assert abs(corrected.pose.angle - 0.2) / DEG < 0.05


def test_exposure_blurs_along_the_motion():
    def moving(time_s):
        return PlanarPose(60.0 * time_s, 0.0, 0.0)

    scene = Scene(LENS, PLANE, [Decal(np.ones((1, 1), np.float32), 2, 2, moving)], background=0.0)
    sharp, soft = (render(scene, 0.0, Shutter(exposure, steps=12)) for exposure in (0.0, 0.1))
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.02)
    wide = [np.ptp(np.flatnonzero(picture.max(axis=0) > 0.02)) for picture in (sharp, soft)]
    assert wide[1] - wide[0] == pytest.approx(60.0 * 0.1 * 500 / 150, abs=3)


def test_noise_is_that_of_the_sensor():
    light = np.full((200, 200), 0.5, np.float32)
    frame = expose(light, Exposure(psf_px=0, read_noise=3.0, full_well=5000), np.random.default_rng(1))
    expected = np.sqrt(3.0**2 + 127.5 * 255 / 5000 + 1 / 12)
    assert frame.std() == pytest.approx(expected, rel=0.03)
    assert frame.mean() == pytest.approx(127.5, abs=0.2)


def test_same_seed_same_frame():
    light = np.full((40, 40, 3), 0.4, np.float32)
    exposure = Exposure(jpeg_quality=70, gradient=0.2, glare=0.3, gamma=1.4, motion_px=3)
    one, two = (expose(light, exposure, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    assert one.shape == (40, 40, 3)


@pytest.mark.parametrize("direction", [0.0, 0.5, np.pi / 2, 2.0])
def test_streak_has_its_length_and_direction(direction):
    kernel = streak_kernel(9.0, direction)
    half = kernel.shape[0] // 2
    rows, columns = np.indices(kernel.shape) - half
    spread = np.array([[np.sum(kernel * a * b) for a in (columns, rows)] for b in (columns, rows)])
    assert kernel.sum() == pytest.approx(1.0)
    along = np.array([np.cos(direction), np.sin(direction)])
    assert along @ spread @ along == pytest.approx(81 / 12, abs=0.35)
    across = np.array([-along[1], along[0]])
    assert across @ spread @ across < 0.4


def test_thing_behind_the_camera_is_not_drawn():
    behind = marker_decal("4x4_50", 4, 10.0, still(PlanarPose()), plane=PlanePose.facing(-50.0))
    picture = render(Scene(LENS, PLANE, [behind], background=0.3))
    assert np.ptp(picture) == 0
