"""What may be reported: each reason for a refusal, and that uncertainty is what angles scatter by."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tubefoot.units import DEG
from tubefoot.vision.alignment import MarkerTarget, align_marker
from tubefoot.vision.compositor import Scene, marker_decal, render, still
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlaneMap, PlanePose
from tubefoot.vision.tracker import MarkerTracker
from tubefoot.vision.verdict import Acceptance, fault_of

LENS, PLANE = Lens.centred(320, 240, 500.0), PlanePose.facing(125.0)
MAP = PlaneMap(LENS, PLANE)
TARGET = MarkerTarget("4x4_50", 4, 10.0, 1.67)
POSE = PlanarPose(1.3, -2.1, 0.35)
LIMITS = Acceptance()


def light(side=10.0, marker_id=4):
    decal = marker_decal("4x4_50", marker_id, side, still(POSE), 1.67)
    return render(Scene(LENS, PLANE, [decal]))


def framed(side=10.0, marker_id=4, seed=0):
    return expose(light(side, marker_id), Exposure(), np.random.default_rng(seed))


@pytest.fixture(scope="module")
def good():
    return align_marker(framed(), MAP, TARGET, POSE)


def test_a_clear_marker_is_accepted(good):
    assert fault_of(good, TARGET, LIMITS) == ""


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"converged": False}, "did not settle"),
        ({"correlation": 0.9}, "does not match"),
        ({"residual": 0.2}, "does not match"),
        ({"log_scale": 0.08}, "wrong size"),
        ({"log_scale": -0.08}, "wrong size"),
        ({"inliers": 0.7}, "covered"),
        ({"covariance": np.diag([1e-6, 1e-6, (0.2 * DEG) ** 2])}, "too uncertain"),
        ({"covariance": np.diag([1e-6, 1e-6, np.nan])}, "too uncertain"),
    ],
)
def test_each_reason_is_told(good, change, fault):
    assert fault_of(replace(good, **change), TARGET, LIMITS) == fault


def with_wrong_cells(good, *places):
    errors = np.zeros((6, 6))
    for place in places:
        errors[place] = 0.9
    return replace(good, cell_errors=errors)


def test_wrong_cells_inside_are_another_code(good):
    """A 16h5 tag differs from this marker in three inner cells; what covers a marker comes from outside."""
    assert (
        fault_of(with_wrong_cells(good, (2, 2), (2, 3), (3, 3)), TARGET, LIMITS) == "cells of another marker"
    )


def test_wrong_cells_from_the_edge_are_a_cover(good):
    covered = with_wrong_cells(good, (0, 0), (0, 1), (1, 0), (1, 1))
    assert fault_of(covered, TARGET, LIMITS) == ""
    most = with_wrong_cells(good, *[(row, column) for row in range(2) for column in range(6)])
    assert fault_of(most, TARGET, LIMITS) == "covered"


def test_nothing_there_is_told():
    flat = np.full((240, 320), 90, np.uint8)
    assert fault_of(align_marker(flat, MAP, TARGET, POSE), TARGET, LIMITS) == "no contrast"


@pytest.mark.parametrize("side", [7.5, 9.0, 11.0, 13.0])
def test_a_marker_of_another_size_is_lost(side):
    tracker = MarkerTracker(MAP, MarkerLayout(length_mm=50, markers=({"id": 4, "z_mm": 10},)))
    reading = tracker.measure(framed(side), 0.0)[4]
    assert reading.lost
    assert reading.fault == "wrong size"


def test_the_tracked_marker_replaced_by_another_is_lost():
    tracker = MarkerTracker(MAP, MarkerLayout(length_mm=50, markers=({"id": 4, "z_mm": 10},)))
    assert not tracker.measure(framed(), 0.0)[4].lost
    assert tracker.measure(framed(marker_id=34), 1 / 30)[4].lost
    assert not tracker.measure(framed(), 2 / 30)[4].lost


def test_uncertainty_is_the_scatter_also_under_correlated_noise():
    """Noise that spreads over neighbours, as compression makes it, scatters angles more than it seems."""
    clean = cv2.GaussianBlur(light() * np.float32(255), (0, 0), 0.7)
    angles, sigmas = [], []
    for seed in range(60):
        noise = np.random.default_rng(seed).normal(0, 14, clean.shape)
        smooth = cv2.GaussianBlur(noise, (0, 0), 0.8)
        frame = np.clip(clean + smooth + 0.5, 0, 255).astype(np.uint8)
        fit = align_marker(frame, MAP, TARGET, POSE)
        angles.append(fit.pose.angle)
        sigmas.append(np.sqrt(fit.covariance[2, 2]))
    assert 0.75 < np.mean(sigmas) / np.std(angles) < 1.35


def test_a_blurred_frame_does_not_spoil_the_next():
    tracker = MarkerTracker(MAP, MarkerLayout(length_mm=50, markers=({"id": 4, "z_mm": 10},)))
    blurred = expose(light(), Exposure(psf_px=3.5), np.random.default_rng(1))
    assert not tracker.measure(framed(), 0.0)[4].lost
    assert not tracker.measure(blurred, 1 / 30)[4].lost
    for index in range(2, 5):
        reading = tracker.measure(framed(seed=index), index / 30)[4]
        assert not reading.lost
        assert abs(reading.pose.angle - POSE.angle) < 0.1 * DEG
