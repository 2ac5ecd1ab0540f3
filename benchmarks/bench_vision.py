"""Vision: speed beside OpenCV's full-frame detection on one thread, accuracy beside its peers.

All peers see the same frames: an ArUco frame for the detector's corners, for pupil-apriltags the same pose,
lens and noise with a tag of its 16h5 family, which has as many cells.
"""

from __future__ import annotations

import math
import multiprocessing
import time
from collections.abc import Callable
from multiprocessing.pool import Pool

import cv2
import numpy as np

from benchmarks.row import Row
from tubefoot.units import DEG
from tubefoot.vision.calibration import CameraCalibration
from tubefoot.vision.finger import FingerTracker
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.lens import Lens
from tubefoot.vision.marker import find_dictionary
from tubefoot.vision.plane import PlanePose, wrap_angle
from tubefoot.vision.rehearsal import Rehearsal, even_bend
from tubefoot.vision.tracker import MarkerTracker
from tubefoot.vision.trials import CASES, SIDE, Accuracy, Trial, accuracy, trials

POSES = 80
PASSES = 10
SIDES_PX = (20, 30, 40, 80)
IDEAL = SIDE / 2 * np.array([[-1.0, 1], [1, 1], [1, -1], [-1, -1]])
LAYOUT = MarkerLayout(length_mm=50, markers=({"id": 4, "z_mm": 10},), quiet_zone_mm=SIDE / 6)  # type: ignore[arg-type]
FIVE = MarkerLayout(
    length_mm=92,
    markers=tuple({"id": i, "z_mm": z} for i, z in zip((1, 2, 4, 7, 11), (2, 25, 46, 67, 90), strict=True)),  # type: ignore[misc]
)


def run() -> list[Row]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return [*speed_rows(), *accuracy_rows()]
    finally:
        cv2.setNumThreads(threads)


def speed_rows() -> list[Row]:
    """Frames per CPU second, so that a busy machine does not count as slow code."""
    rows = []
    for name, layout, lens, distance in (
        (
            "tip, 640 x 480",
            MarkerLayout(length_mm=92, markers=({"id": 7, "z_mm": 77.5},)),
            (640, 480, 800.0),
            205.0,
        ),  # type: ignore[arg-type]
        ("five markers, 1280 x 720", FIVE, (1280, 720, 1200.0), 300.0),
    ):
        bench = Rehearsal(layout, Lens.centred(*lens), PlanePose.facing(distance, offset=(0.0, -46.0)))
        frames = [bench.frame(even_bend(layout, 30 * DEG * np.sin(0.1 * i))) for i in range(60)]
        tracker = FingerTracker(CameraCalibration.of(bench.lens, bench.plane), layout)
        tracker.measure(frames[0], 0.0)
        ours = _rate(lambda i, t=tracker, f=frames: t.measure(f[i], i / 30), len(frames) - 1)
        detector = cv2.aruco.ArucoDetector(find_dictionary("4x4_50"))
        parameters = detector.getDetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector.setDetectorParameters(parameters)
        theirs = _rate(lambda i, d=detector, f=frames: d.detectMarkers(f[i]), len(frames) - 1)
        side = tracker.plane_map.pixels_per_mm((0.0, 46.0)) * layout.marker_side_mm
        note = f"CPU time, {side:.0f} px markers; ours with uncertainty and centreline"
        rows.append(
            Row(f"vision: {name}", ours, theirs, "OpenCV full frame", ours / theirs, "frames/s", note)
        )
    return rows


def _rate(work: Callable[[int], object], count: int) -> float:
    """Frames per CPU second; of each frame the best of several passes, for neighbours slow a core down."""
    best = np.full(count, math.inf)
    for _ in range(PASSES):
        for index in range(count):
            start = time.process_time()
            work(index + 1)
            best[index] = min(best[index], time.process_time() - start)
    return count / float(best.sum())


def accuracy_rows() -> list[Row]:
    # a process of its own: pupil-apriltags was seen to corrupt the heap it shares
    with multiprocessing.get_context("spawn").Pool(1) as peer:
        return _accuracy_rows(peer)


def _accuracy_rows(peer: Pool) -> list[Row]:
    rows = []
    for side_px in SIDES_PX:
        for case in CASES:
            found = case_accuracy(ARUCO_METHODS, case, side_px, "4x4_50")
            found |= peer.apply(case_accuracy, (APRILTAGS, case, side_px, "apriltag_16h5"))
            ours = found.pop("ours")
            figures = (
                f"worst {ours.worst:.3f} bias {ours.bias:+.4f} "
                f"within two sigma {ours.honest:.0%} missed {ours.missed:.0%}"
            )
            for name, other in found.items():
                ratio = other.deviation / ours.deviation if ours.deviation > 0 else None
                note = f"{figures}; theirs worst {other.worst:.2f} missed {other.missed:.0%}"
                title = f"vision: angle error std, {side_px} px, {case}"
                rows.append(Row(title, ours.deviation, other.deviation, name, ratio, "deg", note))
    return rows


def case_accuracy(
    methods: dict[str, Callable[[Trial], tuple[float, float]]], case: str, side_px: float, dictionary: str
) -> dict[str, Accuracy]:
    """Figures of several methods on the same frames."""
    errors: dict[str, list[float]] = {name: [] for name in methods}
    sigmas: dict[str, list[float]] = {name: [] for name in methods}
    for trial in trials(case, side_px, POSES, dictionary=dictionary):
        for name, method in methods.items():
            angle, sigma = method(trial)
            error = wrap_angle(angle - trial.pose.angle) / DEG if math.isfinite(angle) else math.nan
            errors[name].append(error)
            sigmas[name].append(sigma / DEG)
    return {name: accuracy(errors[name], sigmas[name]) for name in methods}


def by_alignment(trial: Trial) -> tuple[float, float]:
    reading = MarkerTracker(trial.plane_map, LAYOUT).measure(trial.frame, 0.0)[4]
    if reading.pose is None or reading.covariance is None:
        return math.nan, math.nan
    return reading.pose.angle, math.sqrt(reading.covariance[2, 2])


def by_pnp(trial: Trial) -> tuple[float, float]:
    """Sub-pixel corners and a perspective pose, its rotation about the plane's normal."""
    corners = _corners(trial)
    if corners is None:
        return math.nan, math.nan
    lens, plane = trial.plane_map.lens, trial.plane_map.plane
    flat = np.column_stack([IDEAL[:, 0], IDEAL[:, 1], np.zeros(4)])
    found, turn, _ = cv2.solvePnP(
        flat, corners[:, None], lens.matrix, np.array(lens.distortion), flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    if not found:
        return math.nan, math.nan
    axis = cv2.Rodrigues(turn)[0][:, 0] @ plane.rotation
    return math.atan2(axis[2], axis[0]), math.nan


def by_plain_angle(trial: Trial) -> tuple[float, float]:
    """Sub-pixel corners and their angle in the picture, no camera model."""
    corners = _corners(trial)
    if corners is None:
        return math.nan, math.nan
    return _angle(corners * (1, -1)), math.nan


def by_corners_on_plane(trial: Trial) -> tuple[float, float]:
    """The same corners carried onto the calibrated plane: what refining them by alignment gains."""
    corners = _corners(trial)
    if corners is None:
        return math.nan, math.nan
    return _angle(trial.plane_map.plane.from_pixels(corners, trial.plane_map.lens)), math.nan


def by_apriltags(trial: Trial) -> tuple[float, float]:
    """pupil-apriltags' corners of a 16h5 tag carried onto the calibrated plane."""
    from pupil_apriltags import Detector

    global _apriltags
    _apriltags = _apriltags or Detector(families="tag16h5", nthreads=1, quad_decimate=1.0)
    found = [tag for tag in _apriltags.detect(trial.frame) if tag.tag_id == 4 and tag.hamming == 0]
    if not found:
        return math.nan, math.nan
    best = max(found, key=lambda tag: tag.decision_margin)
    corners = trial.plane_map.plane.from_pixels(np.asarray(best.corners), trial.plane_map.lens)
    # in which sense and from where this library counts corners is its own convention
    x, z = corners.T
    if np.sum(x * np.roll(z, -1) - z * np.roll(x, -1)) > 0:
        corners = corners[::-1]
    angle = _angle(corners)
    quarters = round((trial.pose.angle - angle) / (math.pi / 2))
    return angle + quarters * math.pi / 2, math.nan


_apriltags = None


def _angle(corners: np.ndarray) -> float:
    arms = corners - corners.mean(axis=0)
    turn = np.sum(IDEAL[:, 0] * arms[:, 1] - IDEAL[:, 1] * arms[:, 0])
    return math.atan2(turn, np.sum(IDEAL * arms))


def _corners(trial: Trial) -> np.ndarray | None:
    global _subpixel
    if _subpixel is None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        parameters.cornerRefinementMaxIterations = 50
        parameters.cornerRefinementMinAccuracy = 1e-3
        _subpixel = cv2.aruco.ArucoDetector(find_dictionary("4x4_50"), parameters)
    corners, ids, _ = _subpixel.detectMarkers(trial.frame)
    if ids is None or 4 not in ids:
        return None
    return np.asarray(corners[list(np.ravel(ids)).index(4)].reshape(4, 2), dtype=float)


_subpixel = None

ARUCO_METHODS = {
    "ours": by_alignment,
    "corners + PnP": by_pnp,
    "in-plane angle": by_plain_angle,
    "corners on plane": by_corners_on_plane,
}
APRILTAGS = {"pupil-apriltags": by_apriltags}
