"""Frames made to deceive a tracker that looks for marker 4: what is in each is known."""

from dataclasses import replace

import numpy as np

from tubefoot.units import DEG
from tubefoot.vision.compositor import Patch, Scene, marker_decal, render, still
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlanePose

LENS = Lens.centred(320, 240, 500.0, (-0.1, 0.03, 0.0, 0.0, 0.0))
PLANE = PlanePose.facing(150.0, 6 * DEG, -4 * DEG)
SIDE, QUIET = 10.0, 1.67
OWN = 4
KINDS = (
    "plain", "other", "other dictionary", "mirrored", "motion", "glare", "black", "white", "noise",
    "covered", "covered much", "wrong size", "twice", "swapped", "blurred", "checkerboard", "half out",
)  # fmt: skip


def hostile_frames(count, seed=0):
    """Kind, frame and true poses (none where marker 4 is not to be reported) of each frame."""
    rng = np.random.default_rng(seed)
    pose = PlanarPose(0.0, 0.0, 0.0)
    for index in range(count):
        kind = "plain" if index % 3 == 0 else KINDS[rng.integers(len(KINDS))]
        if rng.random() < 0.15:
            x, z = rng.uniform(-22, 22), rng.uniform(-14, 14)
            pose = PlanarPose(float(x), float(z), float(rng.uniform(-70, 70) * DEG))
        else:
            step = rng.normal(0, 1, 3) * (0.4, 0.4, 1.5 * DEG)
            pose = PlanarPose(
                float(np.clip(pose.x + step[0], -24, 24)),
                float(np.clip(pose.z + step[1], -16, 16)),
                float(pose.angle + step[2]),
            )
        yield kind, *_draw(kind, pose, rng)


def _draw(kind, pose, rng):
    exposure = Exposure(
        psf_px=float(rng.uniform(0.5, 1.0)),
        gain=float(rng.uniform(0.6, 1.2)),
        motion_direction=float(rng.uniform(0, np.pi)),
        gradient=float(rng.uniform(0, 0.3)),
        jpeg_quality=int(rng.choice([0, 60, 90])),
    )
    own = marker_decal("4x4_50", OWN, SIDE, still(pose), QUIET)
    things, truth = [own], [pose]
    if kind in ("other", "swapped"):
        other = int(rng.choice([number for number in range(50) if number != OWN]))
        things, truth = [marker_decal("4x4_50", other, SIDE, still(pose), QUIET)], []
    elif kind == "other dictionary":
        name = str(rng.choice(["5x5_100", "6x6_250", "apriltag_16h5"]))
        things, truth = [marker_decal(name, int(rng.integers(25)), SIDE, still(pose), QUIET)], []
    elif kind == "mirrored":
        things, truth = [marker_decal("4x4_50", OWN, SIDE, still(pose), QUIET, mirrored=True)], []
    elif kind == "motion":
        exposure = replace(exposure, motion_px=float(rng.uniform(6, 40)))
    elif kind == "glare":
        exposure = replace(
            exposure,
            glare=float(rng.uniform(0.5, 4)),
            glare_px=float(rng.uniform(5, 40)),
            glare_at=tuple(rng.uniform(0.2, 0.8, 2)),
        )
    elif kind in ("covered", "covered much"):
        share = rng.uniform(0.02, 0.2) if kind == "covered" else rng.uniform(0.2, 0.9)
        things.append(_cover(pose, share, rng))
    elif kind == "wrong size":
        size = SIDE * float(rng.choice([0.6, 0.75, 1.25, 1.5]))
        things, truth = [marker_decal("4x4_50", OWN, size, still(pose), QUIET)], []
    elif kind == "twice":
        away = PlanarPose(pose.x + (16 if pose.x < 0 else -16), pose.z, float(rng.uniform(-1, 1)))
        things.append(marker_decal("4x4_50", OWN, SIDE, still(away), QUIET))
        truth.append(away)
    elif kind == "blurred":
        exposure = replace(exposure, psf_px=float(rng.uniform(2, 8)))
    elif kind == "half out":
        edge = PlanarPose(float(np.sign(pose.x) * rng.uniform(44, 53)), pose.z, pose.angle)
        things, truth = [marker_decal("4x4_50", OWN, SIDE, still(edge), QUIET)], [edge]
    background = 0.45
    if kind in ("black", "white", "noise", "checkerboard"):
        things, truth = [], []
        background = _background(kind, rng)
    frame = expose(render(Scene(LENS, PLANE, things, background=background)), exposure, rng)
    return frame, truth


def _background(kind, rng):
    if kind in ("black", "white"):
        return 0.0 if kind == "black" else 1.0
    if kind == "noise":
        return rng.random((LENS.height, LENS.width)).astype(np.float32)
    pitch = int(rng.integers(4, 24))
    rows, columns = np.indices((LENS.height, LENS.width)) // pitch
    return (0.1 + 0.7 * ((rows + columns) % 2)).astype(np.float32)


def _cover(pose, share, rng):
    card = SIDE + 2 * QUIET
    turned = pose.then(PlanarPose(0.0, 0.0, float(rng.integers(4) * np.pi / 2)))
    edge = card / 2 - share * card
    outline = np.array([[edge, -card], [card, -card], [card, card], [edge, card]])
    return Patch(outline, float(rng.choice([0.05, 0.3, 0.6, 0.95])), still(turned))
