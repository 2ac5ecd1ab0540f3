"""Frames of the bench's finger, fast enough to be drawn thirty times a simulated second.

The compositor of `vision` samples every pixel nine times; here each marker card is filtered once with the
square of a pixel, turned as the card is seen, and looked up once a pixel through the same distorted lens.
`tests/twin/test_frame_drawer.py` holds both against each other. Motion during the exposure is averaged over
instants; the shutter is global. Noise is cut from a pool of drawn noise at random places; the empty picture
is ready with every noise of the pool, and only a box around the finger is drawn.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import cv2
import numpy as np
from numba import njit
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
TEXELS_PER_CELL = 12
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
        grey = np.arange(256, dtype=np.float32)
        photon = grey * (255 / exposure.full_well) if exposure.full_well > 0 else 0 * grey
        self._deviation = np.sqrt(photon + exposure.read_noise**2).astype(np.float32)
        shape = (lens.height + POOL_MARGIN, lens.width + POOL_MARGIN)
        self._pool = noise.standard_normal(shape, dtype=np.float32)
        empty = np.full(shape, round(255 * BACKGROUND), dtype=np.float32)
        self._empty = np.empty(shape, dtype=np.uint8)
        digitise(empty, self._pool, self._deviation, self._empty)

    def draw(self, axes: Sequence[BentAxis], hidden: Collection[int] = ()) -> NDArray[np.uint8]:
        """A frame (height, width), eight bits.

        axes : the finger's middle line at instants of the exposure
        hidden : ids of markers that something covers
        """
        bent = [axis.at(self._heights) for axis in axes]
        poses = {
            card: [_pose(card.place, places[number], turned[number]) for places, turned in bent]
            for number, card in enumerate(self._cards, OUTLINE_POINTS)
            if card.place.id not in hidden
        }
        outline, *corners = self._seen(
            [
                _outline(*bent[len(bent) // 2]),
                *(np.vstack([pose.to_outer(card.corners) for pose in each]) for card, each in poses.items()),
            ]
        )
        down, right = self._noise.integers(0, POOL_MARGIN, 2)
        frame = self._empty[down : down + self.lens.height, right : right + self.lens.width].copy()
        x0, y0, x1, y1 = box = self._box(np.vstack([outline, *corners]))
        if x1 <= x0 or y1 <= y0:
            return frame
        grey = _silhouette(outline, box)
        for (card, each), around in zip(poses.items(), corners, strict=True):
            self._lay(grey, (x0, y0), card, each, self._box(around))
        if self._psf > 0:
            grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), self._psf), dtype=np.float32)
        noise = self._pool[down + y0 : down + y1, right + x0 : right + x1]
        digitise(grey, noise, self._deviation, frame[y0:y1, x0:x1])
        return frame

    def _seen(self, groups: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """Groups of points of the plane [mm] as pixels."""
        pixels = self._plane.to_pixels(np.vstack(groups), self.lens)
        return np.split(pixels, np.cumsum([len(group) for group in groups])[:-1])

    def _lay(
        self, grey: FloatPicture, origin: tuple[int, int], card: Card, poses: Sequence[PlanarPose], box: Box
    ) -> None:
        """Lay a card over the picture, whose first pixel is `origin`."""
        x0, y0, x1, y1 = box
        if x1 <= x0 or y1 <= y0:
            return
        across, up = self._across[y0:y1, x0:x1], self._up[y0:y1, x0:x1]
        seen = np.zeros((*across.shape, 2), dtype=np.float32)
        for pose in poses:
            cos, sin = np.cos(pose.angle) / card.texel, np.sin(pose.angle) / card.texel
            look_up(card.seen_at(pose.angle), across, up, (pose.x, pose.z), (cos, sin), card.middle, seen)
        seen /= np.float32(len(poses))
        part = grey[y0 - origin[1] : y1 - origin[1], x0 - origin[0] : x1 - origin[0]]
        part *= 1.0 - seen[..., 1]
        part += 255.0 * seen[..., 0]

    def _box(self, pixels: NDArray[np.float64]) -> Box:
        """First and one past last column and row around some points, within the picture."""
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        return (
            int(max(np.floor(low[0]) - MARGIN_PX, 0)),
            int(max(np.floor(low[1]) - MARGIN_PX, 0)),
            int(min(np.ceil(high[0]) + MARGIN_PX + 1, self.lens.width)),
            int(min(np.ceil(high[1]) + MARGIN_PX + 1, self.lens.height)),
        )


@njit(cache=True)
def look_up(card, across, up, place, turn, middle, seen):  # type: ignore[no-untyped-def]
    """Add light and cover of a card, interpolated between its texels; nothing outside of it.

    card : (rows, columns, 2) filtered; across, up : (h, w) points of the plane that pixels show [mm]
    place : (x, z) of the card's middle [mm]; turn : cosine and sine of its direction over a texel [1/mm]
    middle : texel of its middle, either way; seen : (h, w, 2) in and out
    """
    last_row, last_column = card.shape[0] - 1, card.shape[1] - 1
    for i in range(across.shape[0]):
        for j in range(across.shape[1]):
            right, above = across[i, j] - place[0], up[i, j] - place[1]
            column = turn[0] * right + turn[1] * above + middle
            row = turn[1] * right - turn[0] * above + middle
            if 0.0 <= column < last_column and 0.0 <= row < last_row:
                c, r = int(column), int(row)
                u, v = column - c, row - r
                for k in range(2):
                    upper = card[r, c, k] + u * (card[r, c + 1, k] - card[r, c, k])
                    lower = card[r + 1, c, k] + u * (card[r + 1, c + 1, k] - card[r + 1, c, k])
                    seen[i, j, k] += upper + v * (lower - upper)


@njit(cache=True)
def digitise(grey, noise, deviation, frame):  # type: ignore[no-untyped-def]
    """Eight bits with photon and read noise.

    grey : (h, w) levels; noise : (h, w) normal; deviation : (256,) of the noise by level
    frame : (h, w) out
    """
    for i in range(grey.shape[0]):
        for j in range(grey.shape[1]):
            level = min(max(int(grey[i, j] + 0.5), 0), 255)
            noisy = grey[i, j] + deviation[level] * noise[i, j] + 0.5
            frame[i, j] = np.uint8(min(max(noisy, 0.0), 255.0))


def _outline(places: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The bare finger's edge, (points, 2) of the plane [mm]."""
    middle, turned = places[:OUTLINE_POINTS], directions[:OUTLINE_POINTS]
    across = np.column_stack([np.cos(turned), np.sin(turned)]) * HALF_WIDTH
    return np.vstack([middle - across, (middle + across)[::-1]])


def _silhouette(outline: NDArray[np.float64], box: Box) -> FloatPicture:
    """The bare finger before the background, in grey levels; outline : [px]."""
    x0, y0, x1, y1 = box
    picture = np.full((y1 - y0, x1 - x0), round(255 * BACKGROUND), dtype=np.uint8)
    on_grid = np.rint((outline - (x0, y0)) * 16).astype(np.int32)
    cv2.fillPoly(picture, [on_grid], round(255 * SILICONE), cv2.LINE_AA, shift=4)
    return picture.astype(np.float32)


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
