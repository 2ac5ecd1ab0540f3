"""Pictures of the virtual gripper from the front: both fingers with their folds, the object, the base.

An orthographic drawing of the scene as it stands, for the strip of pictures and the video; what the tracker
sees are the frames of `gripper_bench`.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.twin.bent_axis import BentAxis
from tubefoot.twin.finger_body import METRE
from tubefoot.twin.gripper_bench import SENSES, GripperBench
from tubefoot.twin.held_object import PLATE_SHARE

FloatArray = NDArray[np.float64]
Picture = NDArray[np.uint8]

SIZE = (640, 560)
"""Width and height of a picture [px]."""
SCALE = 4.4
"""[px/mm]"""
FLOOR_PX = 60
"""Height of the base's outer face above the lower edge [px]."""
FINE = 4
"""Bits of sub-pixel position in OpenCV's drawing calls."""
BACKGROUND, BODY, EDGE, TAG = (244, 242, 240), (176, 168, 160), (80, 74, 70), (255, 255, 255)
OBJECT_COLOURS = {"tofu": (200, 228, 240), "blueberry": (128, 72, 58)}
OTHER_COLOUR = (120, 180, 210)
TOUCH_COLOUR = (40, 60, 220)
CREST_X, VALLEY_X, HALF_TIP_X = 11.0, 6.0, 6.0
"""Outline of the finger from its middle line [mm]."""


class GripperView:
    """Draws a gripper bench."""

    def __init__(self, bench: GripperBench):
        """Look at a bench.

        bench : with fingers and object
        """
        self._bench = bench
        held = bench.gripper.held
        assert held is not None
        self._held = held
        reach = CREST_X + bench.make.finger_gap_mm / 2
        self._bases = (reach, -reach)

    def draw(self, words: str = "") -> Picture:
        """The gripper now, (height, width, 3), blue, green, red.

        words : along the upper edge
        """
        picture = np.full((SIZE[1], SIZE[0], 3), BACKGROUND, dtype=np.uint8)
        base = np.array([[-40.0, -6.0], [40.0, -6.0], [40.0, 3.0], [-40.0, 3.0]])
        _fill(picture, base, (120, 120, 124))
        self._object(picture)
        for axis, x in zip(self._bench.axes(), self._bases, strict=True):
            self._finger(picture, axis, x)
        if words:
            cv2.putText(picture, words, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.55, EDGE, 1, cv2.LINE_AA)
        return picture

    def _finger(self, picture: Picture, axis: BentAxis, x: float) -> None:
        layout = self._bench.layout
        heights, widths = _outline(
            layout.rigid_base_mm, layout.length_mm - layout.rigid_tip_mm, layout.length_mm
        )
        places, turned = axis.at(heights)
        across = np.column_stack([np.cos(turned), np.sin(turned)]) * widths[:, None]
        shift = np.array([x, 0.0])
        _fill(picture, shift + np.vstack([places - across, (places + across)[::-1]]), BODY, EDGE)
        for marker in layout.markers:
            (place,), (angle,) = axis.at([marker.z_mm])
            half = layout.marker_side_mm / 2
            square = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            _fill(picture, shift + place + square @ turn.T, TAG, EDGE)

    def _object(self, picture: Picture) -> None:
        gripper, what = self._bench.gripper, self._held.what
        colour = OBJECT_COLOURS.get(what.name, OTHER_COLOUR)
        x, _, z = gripper.object_at
        size = what.sizes(self._held.pose)
        if abs(x) > 100 or gripper.object_at[1] > 100:
            return
        if what.shape == "box" and self._held.in_parts:
            corners = self._block_corners()
        else:
            turn = np.array(gripper.data.body("object").xmat).reshape(3, 3)[np.ix_([0, 2], [0, 2])]
            local = _round(size) if what.shape != "box" else _box(size)
            corners = np.array([x, z]) + local @ turn.T
        _fill(picture, corners, colour, EDGE)
        for number, touch in enumerate(gripper.touches()):
            if touch.normal > 0:
                where = x + SENSES[number] * size[0] / 2, touch.height
                cv2.circle(picture, _pixel(*where), 4, TOUCH_COLOUR, -1, cv2.LINE_AA)

    def _block_corners(self) -> FloatArray:
        data, size = self._bench.gripper.data, self._held.what.sizes(self._held.pose)
        found = []
        for side, way in (("right", 1.0), ("left", -1.0)):
            body = data.body(f"object_{side}")
            turn = np.array(body.xmat).reshape(3, 3)
            for up in (-way, way):
                corner = 0.5 * np.array([way * PLATE_SHARE * size[0], 0.0, up * size[2]])
                found.append((np.array(body.xpos) * METRE + turn @ corner)[[0, 2]])
        return np.array(found)


def _outline(start: float, end: float, length: float) -> tuple[FloatArray, FloatArray]:
    """Heights along the finger and half widths there [mm]: caps, and a fold in each twelfth of what bends."""
    pitch = (end - start) / 12
    heights, widths = [0.0, start], [HALF_TIP_X, HALF_TIP_X]
    for unit in range(12):
        at = start + unit * pitch
        heights += [at + 0.5, at + 1.5, at + pitch - 1.5, at + pitch - 0.5]
        widths += [VALLEY_X, CREST_X, CREST_X, VALLEY_X]
    return np.array([*heights, end, length]), np.array([*widths, HALF_TIP_X, HALF_TIP_X])


def _box(size: tuple[float, float, float]) -> FloatArray:
    x, _, z = size
    return 0.5 * np.array([[-x, -z], [x, -z], [x, z], [-x, z]])


def _round(size: tuple[float, float, float]) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    return 0.5 * np.column_stack([size[0] * np.cos(angle), size[2] * np.sin(angle)])


def _pixel(x: float, z: float) -> tuple[int, int]:
    return round(SIZE[0] / 2 + SCALE * x), round(SIZE[1] - FLOOR_PX - SCALE * z)


def _fill(
    picture: Picture,
    corners: FloatArray,
    colour: tuple[int, int, int],
    edge: tuple[int, int, int] | None = None,
) -> None:
    """Fill a polygon of points (n, 2) [mm]."""
    places = np.column_stack(
        [SIZE[0] / 2 + SCALE * corners[:, 0], SIZE[1] - FLOOR_PX - SCALE * corners[:, 1]]
    )
    grid = [np.rint(places * 2**FINE).astype(np.int32)]
    cv2.fillPoly(picture, grid, colour, cv2.LINE_AA, FINE)
    if edge is not None:
        cv2.polylines(picture, grid, True, edge, 1, cv2.LINE_AA, FINE)
