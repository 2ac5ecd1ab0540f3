"""Fast frames against the compositor's, and the middle line against a finely integrated one."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.twin.bench import LENS, PLANE, bench_layout
from tubefoot.twin.bent_axis import BentAxis
from tubefoot.twin.frame_drawer import FrameDrawer
from tubefoot.units import DEG
from tubefoot.vision.calibration import CameraCalibration
from tubefoot.vision.compositor import Scene, render
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.finger import FingerTracker
from tubefoot.vision.rehearsal import even_bend, finger_things

QUIET = Exposure(read_noise=0.0, full_well=0.0)
LAYOUT = bench_layout()


def evenly(bend):
    return BentAxis(LAYOUT, np.full(12, bend / 12))


def drawer(exposure=QUIET, seed=0):
    return FrameDrawer(LAYOUT, LENS, PLANE, exposure, np.random.default_rng(seed))


@pytest.mark.parametrize("bend", [0.0, 0.9, -1.2])
def test_middle_line_is_that_of_an_even_bend(bend):
    heights = np.linspace(-3, 95, 40)
    places, directions = evenly(bend).at(heights)
    expected_places, expected_directions = even_bend(LAYOUT, bend)(heights)
    np.testing.assert_allclose(places, expected_places, atol=1e-5)
    np.testing.assert_allclose(directions, expected_directions, atol=1e-12)


def test_middle_line_of_unlike_units_is_the_integral_of_its_direction():
    turns = np.array([0.2, -0.1, 0.3, 0.0, 0.05, -0.25])
    axis = BentAxis(LAYOUT, turns)
    heights = np.linspace(0, LAYOUT.length_mm, 20_001)
    places, directions = axis.at(heights)
    middle = (directions[1:] + directions[:-1]) / 2
    steps = np.column_stack([-np.sin(middle), np.cos(middle)]) * np.diff(heights)[:, None]
    np.testing.assert_allclose(places[-1], steps.sum(axis=0), atol=1e-6)
    assert axis.tip_direction == pytest.approx(turns.sum())


@pytest.mark.parametrize("bend_deg", [0.0, 30.0, -55.0])
def test_frames_look_like_the_compositors(bend_deg):
    frame = drawer().draw([evenly(bend_deg * DEG)])
    scene = Scene(LENS, PLANE, finger_things(LAYOUT, even_bend(LAYOUT, bend_deg * DEG)))
    reference = expose(render(scene), QUIET, np.random.default_rng(0))
    difference = np.abs(frame.astype(int) - reference.astype(int))
    assert difference.mean() < 0.2
    assert difference.max() <= 30  # an edge's pixel, 0.1 of it covered otherwise
    assert np.ptp(reference) > 150


def test_the_tracker_reads_the_true_angle_from_them():
    """Noise-free frames: what the drawing itself costs is below the scatter of 0.02 deg."""
    tracker = FingerTracker(CameraCalibration.of(LENS, PLANE), LAYOUT)
    draw = drawer().draw
    errors = []
    for bend_deg in (-60.0, -33.3, 0.0, 11.7, 45.0, 62.0):
        reading = tracker.measure(draw([evenly(bend_deg * DEG)]), 0.0)
        assert not reading.lost
        errors.append(reading.bend / DEG - bend_deg)
    assert np.abs(errors).max() < 0.04
    assert np.std(errors) < 0.02


def test_noise_is_that_of_the_exposure():
    exposure = Exposure(read_noise=3.0, full_well=2000.0)
    draw, clean = drawer(exposure).draw, drawer().draw([evenly(0.3)])
    frames = np.array([draw([evenly(0.3)]) for _ in range(60)], dtype=float)
    scatter = frames.std(axis=0)
    for grey in (115, 158):  # background and finger
        expected = np.hypot(np.sqrt(grey * 255 / 2000.0), 3.0)
        assert scatter[clean == grey].mean() == pytest.approx(expected, rel=0.05)


def test_motion_blurs_and_a_covered_marker_is_gone():
    still = drawer().draw([evenly(0.5)]).astype(float)
    moved = drawer().draw([evenly(0.47), evenly(0.5), evenly(0.53)]).astype(float)
    hidden = drawer().draw([evenly(0.5)], {11}).astype(float)
    tip = np.abs(still - hidden) > 30
    assert 200 < tip.sum() < 4000
    assert (
        np.abs(np.diff(moved, axis=1))[tip[:, 1:]].mean()
        < 0.8 * np.abs(np.diff(still, axis=1))[tip[:, 1:]].mean()
    )
