"""Rehearsal: a virtual bench view for trying calibration and tracking without a camera, with known truth.

A camera looks at a finger that carries the layout's markers; the board is shown to it as a user would.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.units import DEG
from tubefoot.vision.board import Board
from tubefoot.vision.compositor import Decal, Patch, Scene, marker_decal, render, still
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.lens import FloatArray, Lens
from tubefoot.vision.plane import PlanarPose, PlanePose

BendShape = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Places (n, 2) [mm] and directions (n,) [rad] of the centreline at heights (n,) [mm]."""


def even_bend(layout: MarkerLayout, bend: float, upper_bend: float | None = None) -> BendShape:
    """A finger whose lower and upper half are arcs, joined smoothly.

    layout : gives the length and the rigid ends
    bend : direction of the tip [rad]
    upper_bend : turn of the upper half [rad]; half the bend if not given
    """
    upper = bend / 2 if upper_bend is None else upper_bend
    start, end = layout.rigid_base_mm, layout.length_mm - layout.rigid_tip_mm
    fine = np.linspace(0, layout.length_mm, 2001)
    share = np.clip((fine - start) / (end - start), 0, 1)
    mean, change = bend, 4 * (upper - bend / 2)
    angle = mean * share + change * (share**2 - share) / 2
    pitch = fine[1] - fine[0]
    steps = np.column_stack([-np.sin(angle), np.cos(angle)])
    places = np.vstack([[0, 0], np.cumsum((steps[1:] + steps[:-1]) / 2 * pitch, axis=0)])

    def shape(heights: FloatArray) -> tuple[FloatArray, FloatArray]:
        at = np.column_stack([np.interp(heights, fine, axis) for axis in places.T])
        beyond = np.asarray(heights) - np.clip(heights, 0, layout.length_mm)
        direction = np.interp(heights, fine, angle)
        return at + beyond[:, None] * np.column_stack([-np.sin(direction), np.cos(direction)]), direction

    return shape


def finger_things(layout: MarkerLayout, shape: BendShape, half_width: float = 11.0) -> list[Decal | Patch]:
    """The finger's silhouette and its markers, for the compositor, in the finger's frame.

    layout : markers on the finger
    shape : its centreline
    half_width : half the silhouette's width [mm]
    """
    heights = np.linspace(0, layout.length_mm, 25)
    places, directions = shape(heights)
    across = np.column_stack([np.cos(directions), np.sin(directions)]) * half_width
    outline = np.vstack([places - across, (places + across)[::-1]])
    things: list[Decal | Patch] = [Patch(outline, 0.62)]
    at, turned = shape(np.array([place.z_mm for place in layout.markers]))
    for place, (x, z), angle in zip(layout.markers, at, turned, strict=True):
        pose = PlanarPose(float(x), float(z), float(angle)).then(
            PlanarPose(place.x_mm, 0.0, place.angle_deg * DEG)
        )
        things.append(
            marker_decal(
                layout.dictionary, place.id, layout.marker_side_mm, still(pose), layout.quiet_zone_mm
            )
        )
    return things


@dataclass
class Rehearsal:
    """A camera before a finger, everything known.

    layout : markers on the finger
    lens : the true lens
    plane : the true bending plane, origin at the finger's base
    exposure : what the camera does to its frames
    seed : of the noise and of the board's poses
    """

    layout: MarkerLayout
    lens: Lens = field(
        default_factory=lambda: Lens.centred(640, 480, 800.0, (-0.12, 0.05, 0.0005, -0.0004, 0.0))
    )
    plane: PlanePose = field(default_factory=lambda: PlanePose.facing(205.0, 4 * DEG, -6 * DEG, (2.0, -46.0)))
    exposure: Exposure = field(default_factory=Exposure)
    seed: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    def frame(self, shape: BendShape) -> NDArray[np.uint8]:
        """A frame of the finger in some shape.

        shape : its centreline
        """
        scene = Scene(self.lens, self.plane, finger_things(self.layout, shape))
        return expose(render(scene), self.exposure, self._rng)

    def board_views(self, board: Board, count: int) -> Iterator[NDArray[np.uint8]]:
        """Frames of the board, held all over the picture and tilted either way.

        board : what is shown
        count : how many
        """
        distance = (
            self.lens.focal_x * 1.15 * max(board.width / self.lens.width, board.height / self.lens.height)
        )
        for index in range(count):
            tilt, turn = self._rng.uniform(-30, 30, 2) * DEG
            depth = distance * self._rng.uniform(0.75, 1.25)
            reach = np.array([self.lens.width, self.lens.height]) * depth / self.lens.focal_x
            corner = np.array([(index % 3) - 1, (index // 3 % 3) - 1]) * 0.28
            offset = reach * (corner + self._rng.uniform(-0.08, 0.08, 2))
            plane = PlanePose.facing(depth, tilt, turn, (float(offset[0]), float(offset[1])))
            spin = still(PlanarPose(0.0, 0.0, float(self._rng.uniform(-0.4, 0.4))))
            yield self._board_frame(board.decal(plane, spin))

    def plane_view(self, board: Board) -> NDArray[np.uint8]:
        """A frame of the board held in the bending plane.

        board : what is shown
        """
        pose = PlanarPose(-2.0, self.layout.length_mm / 2 + 3.0, 0.03)
        return self._board_frame(board.decal(self.plane, still(pose)))

    def _board_frame(self, decal: Decal) -> NDArray[np.uint8]:
        scene = Scene(self.lens, self.plane, [decal], background=0.35)
        return expose(render(scene), self.exposure, self._rng)
