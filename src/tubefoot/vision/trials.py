"""Trials: seeded sets of synthetic frames with known truth, by which accuracy claims are judged.

Each case spoils the frame in one way, `all` in every way at once. A trial draws one marker at a random place
and angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tubefoot.units import DEG
from tubefoot.vision.alignment import MarkerTarget
from tubefoot.vision.compositor import Patch, Scene, marker_decal, render, still
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlaneMap, PlanePose

CASES = {
    "base": Exposure(),
    "noise": Exposure(read_noise=8.0),
    "blur": Exposure(psf_px=1.5),
    "motion": Exposure(motion_px=4.0),
    "jpeg": Exposure(jpeg_quality=70),
    "gradient": Exposure(gradient=0.5),
    "tilt": Exposure(),
    "all": Exposure(psf_px=1.0, read_noise=4.0, motion_px=2.0, gradient=0.4, jpeg_quality=85),
}
"""What each case does to a frame; `base` has a lens blur of 0.7 px and the noise of a plain webcam."""

TILTED = ("tilt", "all")
TILT_LIMIT = 20 * DEG
ANGLE_LIMIT = 70 * DEG
DISTORTION = (-0.12, 0.04, 0.001, -0.0005, 0.0)
SIDE = 10.0


@dataclass(frozen=True)
class Trial:
    """One frame and its truth.

    frame : (height, width) grey picture
    clear : the same before anything covered the marker; the same frame where nothing does
    pose : of the marker in the plane
    plane_map : plane point of each pixel
    target : which marker it is
    """

    frame: NDArray[np.uint8]
    clear: NDArray[np.uint8]
    pose: PlanarPose
    plane_map: PlaneMap
    target: MarkerTarget


def trials(
    case: str,
    side_px: float,
    count: int,
    seed: int = 1,
    marker_id: int = 4,
    dictionary: str = "4x4_50",
    covered: float = 0.0,
) -> Iterator[Trial]:
    """Frames of 640 x 480 px with one marker each.

    case : one of CASES
    side_px : size of the marker [px]
    count : how many
    seed : of poses and noise
    marker_id : which marker
    dictionary : name of its dictionary
    covered : share of the marker's card that something lies on
    """
    rng = np.random.default_rng([seed, round(side_px), list(CASES).index(case)])
    lens = Lens.centred(640, 480, 800.0, DISTORTION)
    for _ in range(count):
        tilt, turn = rng.uniform(-TILT_LIMIT, TILT_LIMIT, 2) / np.sqrt(2) if case in TILTED else (0.0, 0.0)
        plane = PlanePose.facing(800.0 * SIDE / side_px, float(tilt), float(turn))
        reach = 480.0 * SIDE / side_px / SIDE
        x, z = rng.uniform(-1, 1, 2) * (reach, 0.7 * reach)
        pose = PlanarPose(float(x), float(z), float(rng.uniform(-ANGLE_LIMIT, ANGLE_LIMIT)))
        marker = marker_decal(dictionary, marker_id, SIDE, still(pose))
        exposure = replace(
            CASES[case],
            motion_direction=float(rng.uniform(0, np.pi)),
            gradient_direction=float(rng.uniform(0, 2 * np.pi)),
        )
        clear = expose(render(Scene(lens, plane, [marker])), exposure, rng)
        frame = clear
        if covered > 0:
            scene = Scene(lens, plane, [marker, _cover(pose, covered, rng)])
            frame = expose(render(scene), exposure, rng)
        yield Trial(
            frame, clear, pose, PlaneMap(lens, plane), MarkerTarget(dictionary, marker_id, SIDE, SIDE / 6)
        )


def _cover(pose: PlanarPose, share: float, rng: np.random.Generator) -> Patch:
    """Something over one side or corner of the marker's card, from outside inwards."""
    card = SIDE * 4 / 3
    side = PlanarPose(0.0, 0.0, float(rng.integers(4) * np.pi / 2))
    if rng.random() < 0.5:
        edge = card / 2 - share * card
        outline = np.array([[edge, -card], [card, -card], [card, card], [edge, card]])
    else:
        edge = card / 2 - np.sqrt(share) * card
        outline = np.array([[edge, edge], [card, edge], [card, card], [edge, card]])
    return Patch(outline, float(rng.choice([0.05, 0.3, 0.5, 0.75, 0.95])), still(pose.then(side)))


@dataclass(frozen=True)
class Accuracy:
    """How far angles were from the truth.

    bias, deviation, worst : mean, standard deviation and largest of the errors [deg]
    honest : share of errors within two reported standard uncertainties; NaN where none is reported
    missed : share of frames without an angle
    """

    bias: float
    deviation: float
    worst: float
    honest: float
    missed: float


def accuracy(errors_deg: list[float], sigmas_deg: list[float]) -> Accuracy:
    """Figures of a set of errors, NaN for frames without an angle.

    errors_deg : measured minus true [deg]
    sigmas_deg : reported standard uncertainties [deg]
    """
    errors, sigmas = np.array(errors_deg), np.array(sigmas_deg)
    seen = np.isfinite(errors)
    missed = float(1 - np.mean(seen))
    if not np.any(seen):
        return Accuracy(float("nan"), float("nan"), float("nan"), float("nan"), missed)
    errors, sigmas = errors[seen], sigmas[seen]
    honest = float(np.mean(np.abs(errors) <= 2 * sigmas)) if np.all(np.isfinite(sigmas)) else float("nan")
    return Accuracy(float(errors.mean()), float(errors.std()), float(np.abs(errors).max()), honest, missed)
