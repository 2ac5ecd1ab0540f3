"""Frames of the bench's finger, fast enough to be drawn thirty times a simulated second.

The compositor of `vision` samples every pixel nine times; here each marker card is filtered once with the
square of a pixel, turned as the card is seen, and looked up once a pixel through the same distorted lens.
`tests/twin/test_frame_drawer.py` holds both against each other. Motion during the exposure is averaged over
instants; the shutter is global. Noise is cut from a pool of drawn noise at random places.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.twin.bent_axis import BentAxis
from tubefoot.units import DEG
from tubefoot.vision.compositor import marker_decal, still
from tubefoot.vision.exposure import Exposure
from tubefoot.vision.layout import MarkerLayout, MarkerPlace
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlaneMap, PlanePose

BACKGROUND, SILICONE = 0.45, 0.62
HALF_WIDTH = 11.0
"""Half the width of the finger's silhouette [mm]."""
TEXELS_PER_CELL = 24
OUTLINE_POINTS = 25
KERNEL_SAMPLES = 16
TURNS = 12
"""Directions of a pixel's square within a right angle for which a card is filtered."""
POOL_MARGIN = 256
MARGIN_PX = 4
"""Around what is drawn, for the blur."""

FloatPicture = NDArray[np.float32]
Box = tuple[int, int, int, int]


class Card:
    """A marker with its paper, filtered with the square of a pixel and ready for look-up."""

    def __init__(self, layout: MarkerLayout, place: MarkerPlace, footprint: float):
        """Print it.

        layout : gives dictionary, side and quiet zone
        place : which marker
        footprint : side of a pixel on the card [mm]
        """
        decal = marker_decal(
            layout.dictionary,
            place.id,
            layout.marker_side_mm,
            still(PlanarPose()),
            layout.quiet_zone_mm,
        )
        count = len(decal.cells)
        self.texel = layout.marker_side_mm / (count * TEXELS_PER_CELL)
        paper = round(layout.quiet_zone_mm / self.texel)
        margin = int(np.ceil(1.5 * footprint / self.texel)) + 2
        cells = np.kron(decal.cells, np.ones((TEXELS_PER_CELL, TEXELS_PER_CELL)))
        light = np.pad(np.pad(cells, paper, constant_values=decal.paper), margin)
        cover = np.pad(np.ones_like(np.pad(cells, paper)), margin)
        self._plain = np.dstack([light, cover]).astype(np.float32)
        self._filtered: dict[int, FloatPicture] = {}
        self._width = footprint / self.texel
        self.middle = (len(light) - 1) / 2
        half = (len(light) / 2) * self.texel
        self.corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
        self.place = place

    def seen_at(self, angle: float) -> FloatPicture:
        """Light and cover (rows, columns, 2), filtered for a card turned by an angle.

        angle : of the card, counter-clockwise [rad]
        """
        turn = round(angle / (np.pi / 2) * TURNS) % TURNS
        if turn not in self._filtered:
            kernel = _square_kernel(self._width, turn / TURNS * np.pi / 2)
            self._filtered[turn] = np.asarray(cv2.filter2D(self._plain, -1, kernel), dtype=np.float32)
        return self._filtered[turn]


class FrameDrawer:
    """Draws a finger with its markers as one camera sees it."""

    def __init__(
        self,
        layout: MarkerLayout,
        lens: Lens,
        plane: PlanePose,
        exposure: Exposure,
        noise: np.random.Generator,
    ):
        """Set the camera up.

        layout : of the markers
        lens : of the camera
        plane : the bending plane, origin at the finger's base
        exposure : blur and noise of its frames; the other spoilings are the compositor's
        noise : where the noise comes from
        """
        self.layout = layout
        self.lens = lens
        self._plane = plane
        seen = PlaneMap(lens, plane)
        self._across, self._up = (np.ascontiguousarray(part) for part in np.moveaxis(seen.points, 2, 0))
        middle = (0.0, layout.length_mm / 2)
        footprint = 1.0 / seen.pixels_per_mm(middle)
        self._cards = [Card(layout, place, footprint) for place in layout.markers]
        outline = np.linspace(0.0, layout.length_mm, OUTLINE_POINTS)
        self._heights = np.concatenate([outline, [place.z_mm for place in layout.markers]])
        self._psf = exposure.psf_px
        self._noise = noise
        shape = (lens.height + POOL_MARGIN, lens.width + POOL_MARGIN)
        self._pool = noise.standard_normal(shape, dtype=np.float32)
        grey = np.arange(256, dtype=np.float32)
        photon = grey * (255 / exposure.full_well) if exposure.full_well > 0 else 0 * grey
        self._deviation = np.sqrt(photon + exposure.read_noise**2).astype(np.float32)

    def draw(self, axes: Sequence[BentAxis], hidden: Collection[int] = ()) -> NDArray[np.uint8]:
        """A frame (height, width), eight bits.

        axes : the finger's middle line at instants of the exposure
        hidden : ids of markers that something covers
        """
        bent = [axis.at(self._heights) for axis in axes]
        grey, box = self._silhouette(*bent[len(bent) // 2])
        for number, card in enumerate(self._cards, OUTLINE_POINTS):
            if card.place.id not in hidden:
                poses = [_pose(card.place, places[number], turned[number]) for places, turned in bent]
                self._lay(grey, card, poses, box)
        x0, y0, x1, y1 = box
        if self._psf > 0:
            grey[y0:y1, x0:x1] = cv2.GaussianBlur(grey[y0:y1, x0:x1], (0, 0), self._psf)
        return self._digitised(grey)

    def _silhouette(
        self, places: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> tuple[FloatPicture, list[int]]:
        """The bare finger before the background, in grey levels, and the box around it."""
        middle, turned = places[:OUTLINE_POINTS], directions[:OUTLINE_POINTS]
        across = np.column_stack([np.cos(turned), np.sin(turned)]) * HALF_WIDTH
        outline = self._plane.to_pixels(np.vstack([middle - across, (middle + across)[::-1]]), self.lens)
        picture = np.full((self.lens.height, self.lens.width), round(255 * BACKGROUND), dtype=np.uint8)
        on_grid = np.rint(outline * 16).astype(np.int32)
        cv2.fillPoly(picture, [on_grid], round(255 * SILICONE), cv2.LINE_AA, shift=4)
        return picture.astype(np.float32), list(self._box(outline.min(axis=0), outline.max(axis=0)))

    def _lay(self, grey: FloatPicture, card: Card, poses: Sequence[PlanarPose], box: list[int]) -> None:
        """Lay a card over the picture and widen the box to hold it."""
        around = np.vstack([pose.to_outer(card.corners) for pose in poses])
        corners = self._plane.to_pixels(around, self.lens)
        x0, y0, x1, y1 = self._box(corners.min(axis=0), corners.max(axis=0))
        if x1 <= x0 or y1 <= y0:
            return
        window = (slice(y0, y1), slice(x0, x1))
        across, up = self._across[window], self._up[window]
        seen = _looked_up(card, poses[0], across, up)
        for pose in poses[1:]:
            seen += _looked_up(card, pose, across, up)
        seen /= np.float32(len(poses))
        part = grey[window]
        part *= 1.0 - seen[..., 1]
        part += 255.0 * seen[..., 0]
        box[:] = min(box[0], x0), min(box[1], y0), max(box[2], x1), max(box[3], y1)

    def _box(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> Box:
        return (
            int(max(np.floor(low[0]) - MARGIN_PX, 0)),
            int(max(np.floor(low[1]) - MARGIN_PX, 0)),
            int(min(np.ceil(high[0]) + MARGIN_PX + 1, self.lens.width)),
            int(min(np.ceil(high[1]) + MARGIN_PX + 1, self.lens.height)),
        )

    def _digitised(self, grey: FloatPicture) -> NDArray[np.uint8]:
        """Eight bits with photon and read noise."""
        down, right = self._noise.integers(0, POOL_MARGIN, 2)
        height, width = grey.shape
        noise = self._pool[down : down + height, right : right + width]
        levels = cv2.convertScaleAbs(grey)
        deviation = np.asarray(cv2.LUT(levels, self._deviation), dtype=np.float32)
        noisy = cv2.add(grey, cv2.multiply(deviation, noise))
        return np.asarray(np.clip(noisy + np.float32(0.5), 0, 255), dtype=np.uint8)


def _looked_up(card: Card, pose: PlanarPose, across: FloatPicture, up: FloatPicture) -> FloatPicture:
    """Light and cover (rows, columns, 2) of a card at points of the plane."""
    cos, sin = np.float32(np.cos(pose.angle) / card.texel), np.float32(np.sin(pose.angle) / card.texel)
    right, above = across - np.float32(pose.x), up - np.float32(pose.z)
    middle = np.float32(card.middle)
    column, row = cos * right + sin * above + middle, sin * right - cos * above + middle
    return np.asarray(cv2.remap(card.seen_at(pose.angle), column, row, cv2.INTER_LINEAR), dtype=np.float32)


def _pose(place: MarkerPlace, at: NDArray[np.float64], direction: float) -> PlanarPose:
    """Pose of a marker whose height went to a place and a direction."""
    seat = PlanarPose(float(at[0]), float(at[1]), float(direction))
    return seat.then(PlanarPose(place.x_mm, 0.0, place.angle_deg * DEG))


def _square_kernel(width: float, turn: float) -> NDArray[np.float32]:
    """A filter that averages over a square.

    width : of the square [texel]; turn : of its axes [rad]
    """
    half = int(np.ceil(width / np.sqrt(2))) + 1
    fine = (np.arange((2 * half + 1) * KERNEL_SAMPLES) + 0.5) / KERNEL_SAMPLES - half - 0.5
    column, row = np.meshgrid(fine, fine)
    along = np.abs(np.cos(turn) * column + np.sin(turn) * row)
    across = np.abs(np.cos(turn) * row - np.sin(turn) * column)
    inside = (along <= width / 2) & (across <= width / 2)
    size = 2 * half + 1
    kernel = inside.reshape(size, KERNEL_SAMPLES, size, KERNEL_SAMPLES).mean(axis=(1, 3))
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)
