"""Compositor: camera frames of flat things, with exactly known poses, without a 3D renderer.

Each picture element is drawn by sampling: the element's sub-samples are carried through the distorted lens
onto the plane of the thing, and the cells there are averaged with the exact coverage of a sub-sample.
Moving things are drawn row by row at the time at which a rolling shutter reads the row, and averaged over
the exposure. What the sensor then adds (blur, noise, compression) is in `exposure`. Reflectance and
brightness are fractions of full white.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tubefoot.vision.lens import FloatArray, Lens
from tubefoot.vision.marker import marker_cells
from tubefoot.vision.plane import PlanarPose, PlanePose, sampled_plane

Motion = Callable[[float], PlanarPose]
"""Pose of a thing in its plane at a time [s]."""

Picture = NDArray[np.float32]


def still(pose: PlanarPose) -> Motion:
    """A motion that stays where it is.

    pose : the one pose
    """
    return lambda time_s: pose


@dataclass(frozen=True)
class Decal:
    """A flat card with a pattern of square cells and a paper border.

    cells : (rows, columns) or (rows, columns, 3) reflectance, top row first
    width, height : size of the pattern [mm]
    border : paper around the pattern [mm]
    motion : pose of the pattern's centre in the plane
    plane : the plane it lies in; None is the scene's own plane
    paper : reflectance of the border
    """

    cells: NDArray[np.float32]
    width: float
    height: float
    motion: Motion
    border: float = 0.0
    plane: PlanePose | None = None
    paper: float = 0.82


@dataclass(frozen=True)
class Patch:
    """A flat polygon of one colour.

    outline : (n, 2) corners (x, z) in the patch's own frame [mm]
    reflectance : grey level, or blue, green, red
    motion : pose of its frame in the scene's plane
    """

    outline: FloatArray
    reflectance: float | tuple[float, float, float]
    motion: Motion = field(default_factory=lambda: still(PlanarPose()))


@dataclass(frozen=True)
class Shutter:
    """How a frame gathers light.

    exposure_s : time that a row gathers light [s]
    line_time_s : delay from one row to the next [s]; 0 is a global shutter
    steps : instants averaged over the exposure
    """

    exposure_s: float = 0.0
    line_time_s: float = 0.0
    steps: int = 1


@dataclass(frozen=True)
class Scene:
    """Things in front of a camera, drawn in order.

    lens : the camera's lens
    plane : the plane that things lie in
    things : decals and patches, the hindmost first
    background : reflectance behind them: a number or a picture (height, width)
    colour : draw three channels (blue, green, red) instead of one
    samples : sub-samples a pixel along each axis
    """

    lens: Lens
    plane: PlanePose
    things: Sequence[Decal | Patch] = field(default_factory=tuple)
    background: float | Picture = 0.45
    colour: bool = False
    samples: int = 3


def marker_decal(
    dictionary: str,
    marker_id: int,
    side: float,
    motion: Motion,
    quiet: float | None = None,
    plane: PlanePose | None = None,
    mirrored: bool = False,
) -> Decal:
    """A printed marker.

    dictionary : name of the marker dictionary
    marker_id : which marker
    side : outer side of its black border [mm]
    motion : pose of its centre
    quiet : white margin [mm]; a sixth of the side if not given
    plane : the plane it lies in, None for the scene's
    mirrored : draw its mirror picture
    """
    cells = marker_cells(dictionary, marker_id)
    ink = (0.07 + 0.75 * (cells[:, ::-1] if mirrored else cells)).astype(np.float32)
    return Decal(ink, side, side, motion, side / 6 if quiet is None else quiet, plane)


def render(scene: Scene, time_s: float = 0.0, shutter: Shutter | None = None) -> Picture:
    """The light on the sensor, (height, width) or (height, width, 3), before blur and noise.

    scene : what to draw
    time_s : middle of the exposure of the middle row [s]
    shutter : exposure and row delay; an instant if not given
    """
    shutter = shutter or Shutter()
    lens = scene.lens
    channels = 3 if scene.colour else 1
    picture = np.empty((lens.height, lens.width, channels), dtype=np.float32)
    background = np.asarray(scene.background, dtype=np.float32)
    picture[:] = background[..., None] if background.ndim == 2 else background
    for thing in scene.things:
        draw = _draw_decal if isinstance(thing, Decal) else _draw_patch
        draw(picture, scene, thing, time_s, shutter)  # type: ignore[arg-type]
    return picture if scene.colour else picture[..., 0]


def _draw_decal(picture: Picture, scene: Scene, decal: Decal, time_s: float, shutter: Shutter) -> None:
    plane = decal.plane or scene.plane
    half = np.array([decal.width / 2 + decal.border, decal.height / 2 + decal.border])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    region = _region(scene, plane, decal.motion, corners, time_s, shutter)
    if region is None:
        return
    columns, rows = _samples(region, scene.samples)
    points = sampled_plane(scene.lens, plane, columns, rows).astype(np.float32)
    centre = decal.motion(time_s)
    footprint = _mm_per_pixel(scene.lens, plane, centre) / scene.samples
    colour = np.zeros((*points.shape[:2], picture.shape[2]), dtype=np.float32)
    cover = np.zeros(points.shape[:2], dtype=np.float32)
    for instant in _instants(time_s, shutter):
        own = _own_frame(points, decal.motion, _row_times(rows, instant, scene, shutter))
        _add_decal(colour, cover, decal, own, footprint)
    _blend(picture, region, colour / shutter.steps, cover / shutter.steps, scene.samples)


def _add_decal(
    colour: Picture, cover: NDArray[np.float32], decal: Decal, own: NDArray[np.float32], footprint: float
) -> None:
    """Add one instant of a decal to the running sums of light and coverage."""
    cells = decal.cells if decal.cells.ndim == 3 else decal.cells[..., None]
    count_rows, count_columns = cells.shape[:2]
    padded = np.pad(cells, ((1, 1), (1, 1), (0, 0)), constant_values=decal.paper)
    across = (own[..., 0] / decal.width + 0.5) * count_columns
    down = (0.5 - own[..., 1] / decal.height) * count_rows
    left, part_x = _edge_share(across, footprint * count_columns / decal.width, count_columns)
    top, part_y = _edge_share(down, footprint * count_rows / decal.height, count_rows)
    upper = padded[top, left] * (1 - part_x) + padded[top, left + 1] * part_x
    lower = padded[top + 1, left] * (1 - part_x) + padded[top + 1, left + 1] * part_x
    inside_x = np.clip((decal.width / 2 + decal.border - np.abs(own[..., 0])) / footprint + 0.5, 0, 1)
    inside_y = np.clip((decal.height / 2 + decal.border - np.abs(own[..., 1])) / footprint + 0.5, 0, 1)
    share = inside_x * inside_y
    colour += (upper * (1 - part_y) + lower * part_y) * share[..., None]
    cover += share


def _edge_share(
    place: NDArray[np.float32], footprint: float, count: int
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Index (into padded cells) of the cell before the nearest edge, and the share of the cell after it."""
    edge = np.clip(np.rint(place), 0, count)
    share = np.clip((place - edge) / footprint + 0.5, 0, 1)
    return edge.astype(np.int32), share[..., None].astype(np.float32)


def _draw_patch(picture: Picture, scene: Scene, patch: Patch, time_s: float, shutter: Shutter) -> None:
    region = _region(scene, scene.plane, patch.motion, patch.outline, time_s, shutter)
    if region is None:
        return
    x0, y0, x1, y1 = region
    count = scene.samples
    cover = np.zeros(((y1 - y0) * count, (x1 - x0) * count), dtype=np.float32)
    for instant in _instants(time_s, shutter):
        outline = scene.plane.to_pixels(
            patch.motion(instant).to_outer(_with_midpoints(patch.outline)), scene.lens
        )
        on_grid = ((outline - (x0, y0) + 0.5) * count - 0.5) * 16
        mask = np.zeros(cover.shape, dtype=np.uint8)
        corners = np.rint(on_grid).astype(np.int32)
        cv2.fillPoly(mask, [corners], 255, cv2.LINE_8, shift=4)
        # fillPoly also fills every sub-sample that the outline touches: half of each is outside
        cv2.polylines(mask, [corners], True, 127, 1, cv2.LINE_8, shift=4)
        cover += mask / np.float32(255)
    cover /= shutter.steps
    level = np.broadcast_to(np.asarray(patch.reflectance, dtype=np.float32), picture.shape[2:])
    _blend(picture, region, cover[..., None] * level, cover, count)


def _with_midpoints(outline: FloatArray, pieces: int = 8) -> FloatArray:
    """The outline with its sides cut into pieces, so that a distorting lens may bend them."""
    closed = np.vstack([outline, outline[:1]])
    at = np.arange(len(outline) * pieces) / pieces
    return np.column_stack([np.interp(at, np.arange(len(closed)), axis) for axis in closed.T])


def _region(
    scene: Scene, plane: PlanePose, motion: Motion, outline: ArrayLike, time_s: float, shutter: Shutter
) -> tuple[int, int, int, int] | None:
    """Pixel box x0, y0, x1, y1 that holds the outline over the whole frame time, None when out of sight."""
    reach = shutter.exposure_s / 2 + shutter.line_time_s * scene.lens.height / 2
    points = _with_midpoints(np.asarray(outline, dtype=float))
    places = [motion(time_s + share * reach).to_outer(points) for share in (-1.0, 0.0, 1.0)]
    space = plane.in_space(np.vstack(places))
    if np.any(space[:, 2] <= 1.0):
        return None
    pixels = scene.lens.project(space)
    low = np.floor(pixels.min(axis=0)).astype(int) - 2
    high = np.ceil(pixels.max(axis=0)).astype(int) + 3
    x0, y0 = np.maximum(low, 0)
    x1, y1 = np.minimum(high, (scene.lens.width, scene.lens.height))
    return (int(x0), int(y0), int(x1), int(y1)) if x1 > x0 and y1 > y0 else None


def _samples(region: tuple[int, int, int, int], count: int) -> tuple[FloatArray, FloatArray]:
    x0, y0, x1, y1 = region
    offsets = (np.arange(count) + 0.5) / count - 0.5
    columns = (np.arange(x0, x1)[:, None] + offsets).ravel()
    rows = (np.arange(y0, y1)[:, None] + offsets).ravel()
    return columns, rows


def _instants(time_s: float, shutter: Shutter) -> FloatArray:
    offsets = (np.arange(shutter.steps) + 0.5) / shutter.steps - 0.5
    return time_s + offsets * shutter.exposure_s


def _row_times(rows: FloatArray, instant: float, scene: Scene, shutter: Shutter) -> FloatArray:
    return instant + (rows - (scene.lens.height - 1) / 2) * shutter.line_time_s


def _own_frame(points: NDArray[np.float32], motion: Motion, times: FloatArray) -> NDArray[np.float32]:
    """Points (rows, columns, 2) carried into the thing's frame at each row's time."""
    if times[0] == times[-1]:
        return (
            motion(float(times[0])).to_inner(points.reshape(-1, 2)).reshape(points.shape).astype(np.float32)
        )
    poses = [motion(float(time)) for time in times]
    x, z, angle = (np.array([getattr(pose, name) for pose in poses])[:, None] for name in ("x", "z", "angle"))
    cos, sin = np.cos(angle), np.sin(angle)
    right, up = points[..., 0] - x, points[..., 1] - z
    return np.stack([cos * right + sin * up, cos * up - sin * right], axis=-1).astype(np.float32)


def _mm_per_pixel(lens: Lens, plane: PlanePose, centre: PlanarPose) -> float:
    around = plane.to_pixels(centre.to_outer([[-0.5, 0], [0.5, 0], [0, -0.5], [0, 0.5]]), lens)
    across, up = around[1] - around[0], around[3] - around[2]
    return float(1 / np.sqrt(abs(across[0] * up[1] - across[1] * up[0])))


def _blend(
    picture: Picture,
    region: tuple[int, int, int, int],
    colour: NDArray[Any],
    cover: NDArray[Any],
    samples: int,
) -> None:
    """Average sub-samples into pixels and lay them over the picture."""
    x0, y0, x1, y1 = region
    shape = (y1 - y0, samples, x1 - x0, samples)
    mean_colour = colour.reshape(*shape, -1).mean(axis=(1, 3))
    mean_cover = cover.reshape(shape).mean(axis=(1, 3))[..., None]
    picture[y0:y1, x0:x1] = picture[y0:y1, x0:x1] * (1 - mean_cover) + mean_colour
