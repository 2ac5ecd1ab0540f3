"""Fluid columns: how far a coloured column reaches along a line in the calibrated plane.

The paper's visual check. The line is sampled across its width, each sample becomes a share of the fluid's
colour, and the level is where that share falls through one half, between samples by interpolation. Columns
should lie in or near the calibrated plane; one behind it by d reads short by the ratio d / distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.units import DEG
from tubefoot.vision.layout import ColumnPlace
from tubefoot.vision.plane import PlaneMap

LEAST_COLOUR = 0.12
"""A column must be more colourful than its surroundings by this share of full saturation."""


@dataclass(frozen=True)
class ColumnLevel:
    """Level of one fluid column in one frame.

    name : of the column
    level : from its start to the edge of the colour [mm]; NaN where there is no clear edge
    colour : mean share of the fluid's colour in the filled part, 0 to 1
    """

    name: str
    level: float
    colour: float


def column_level(frame: NDArray[np.uint8], plane_map: PlaneMap, column: ColumnPlace) -> ColumnLevel:
    """The level of a fluid column.

    frame : (height, width, 3) blue, green, red; a grey picture raises ConfigError
    plane_map : plane point of each pixel
    column : where the column is and its colour
    """
    if frame.ndim != 3:
        raise ConfigError("fluid columns need colour frames; switch the camera to colour or drop [[columns]]")
    start, end = np.array(column.start_mm), np.array(column.end_mm)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    across = np.array([-along[1], along[0]])
    pitch = 0.5 / plane_map.pixels_per_mm((float(start[0]), float(start[1])))
    places = np.linspace(0, length, max(int(length / pitch), 8))
    lanes = np.linspace(-0.5, 0.5, 5) * column.width_mm
    points = start + places[:, None, None] * along + lanes[None, :, None] * across
    pixels = plane_map.to_pixels(points.reshape(-1, 2)).reshape(len(places), len(lanes), 2)
    if pixels.min() < 0 or np.any(pixels.max(axis=(0, 1)) > (frame.shape[1] - 1, frame.shape[0] - 1)):
        return ColumnLevel(column.name, float("nan"), 0.0)
    colours = _sampled(frame, pixels) / 255
    share = np.median(_share_of_hue(colours, column.hue_deg), axis=1)
    return ColumnLevel(column.name, *_edge(places, share))


def _sampled(frame: NDArray[np.uint8], pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    unused: Any = None
    return np.asarray(cv2.remap(frame, pixels.astype(np.float32), unused, cv2.INTER_LINEAR), dtype=float)


def _share_of_hue(colours: NDArray[np.float64], hue_deg: float) -> NDArray[np.float64]:
    """How much of a colour points in the hue's direction, 0 for grey, 1 for the pure bright colour."""
    blue, green, red = colours[..., 0], colours[..., 1], colours[..., 2]
    first = red - (green + blue) / 2
    second = np.sqrt(0.75) * (green - blue)
    return first * np.cos(hue_deg * DEG) + second * np.sin(hue_deg * DEG)


def _edge(places: NDArray[np.float64], share: NDArray[np.float64]) -> tuple[float, float]:
    """Place of the best step from coloured to plain, and the colour before it."""
    count = len(share)
    sums = np.cumsum(share)
    before = np.arange(1, count)
    mean_before = sums[:-1] / before
    mean_after = (sums[-1] - sums[:-1]) / (count - before)
    gain = before * (count - before) * (mean_before - mean_after) * np.abs(mean_before - mean_after)
    split = int(np.argmax(gain))
    filled, empty = float(mean_before[split]), float(mean_after[split])
    if np.mean(share) > LEAST_COLOUR and filled - empty < LEAST_COLOUR:
        return float(places[-1]), float(np.mean(share))
    if filled - empty < LEAST_COLOUR:
        return (0.0, 0.0) if np.max(share) < LEAST_COLOUR else (float("nan"), 0.0)
    half = (filled + empty) / 2
    low = max(split - 3, 0)
    crossing = next(
        (index for index in range(low, count - 1) if share[index] >= half > share[index + 1]), split
    )
    drop = share[crossing] - share[crossing + 1]
    part = (share[crossing] - half) / drop if drop > 0 else 0.5
    return float(places[crossing] + np.clip(part, 0, 1) * (places[1] - places[0])), filled
