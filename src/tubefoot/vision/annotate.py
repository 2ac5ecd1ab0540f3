"""Annotation: what was measured, drawn into the frame it was measured in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.units import DEG
from tubefoot.vision.finger import FingerReading
from tubefoot.vision.plane import PlaneMap

GREEN, RED, BLUE, WHITE = (80, 200, 60), (60, 60, 230), (230, 150, 40), (255, 255, 255)
FINE = 4
"""Bits of sub-pixel position in OpenCV's drawing calls."""


def annotated(
    frame: NDArray[np.uint8], reading: FingerReading, plane_map: PlaneMap, marker_side: float
) -> NDArray[np.uint8]:
    """A colour copy of the frame with markers, centreline and numbers.

    frame : grey or colour picture
    reading : what was measured in it
    plane_map : plane point of each pixel
    marker_side : side of a marker [mm]
    """
    picture = np.repeat(frame[..., None], 3, axis=2) if frame.ndim == 2 else frame.copy()
    square = marker_side / 2 * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    for marker in reading.markers.values():
        if marker.pose is not None:
            outline = plane_map.to_pixels(marker.pose.to_outer(square))
            _polyline(picture, outline, GREEN, closed=True)
            _polyline(picture, outline[:2], BLUE, closed=False)
    if reading.centreline is not None:
        _polyline(picture, plane_map.to_pixels(reading.centreline.points), RED, closed=False)
    words = _words(reading)
    # a plate behind the words: an outline of thicker letters is wider than the letters themselves
    picture[: 8 + 18 * len(words), : 10 + 9 * max(map(len, words))] //= 3
    for line, text in enumerate(words):
        place = (8, 18 + 18 * line)
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, WHITE, 1, cv2.LINE_AA)
    return picture


def _words(reading: FingerReading) -> list[str]:
    if reading.lost:
        first = f"t {reading.time_s:.2f} s   tip lost: {reading.fault}"
    else:
        first = f"t {reading.time_s:.2f} s   bend {reading.bend / DEG:+.2f} +- {reading.sigma / DEG:.2f} deg"
    if not np.isfinite(reading.theta1):
        return [first]
    return [first, f"theta1 {reading.theta1 / DEG:+.2f}   theta2 {reading.theta2 / DEG:+.2f} deg"]


def _polyline(
    picture: NDArray[np.uint8], points: NDArray[np.float64], colour: Sequence[int], closed: bool
) -> None:
    fixed = np.rint(points * 2**FINE).astype(np.int32)
    cv2.polylines(picture, [fixed], closed, tuple(colour), 1, cv2.LINE_AA, FINE)


class VideoWriter:
    """An annotated video; opened with the first frame's size."""

    def __init__(self, path: Path, frames_per_s: float = 30.0):
        """Remember where it goes.

        path : .mp4 file
        frames_per_s : rate at which it plays [1/s]
        """
        self.path = path
        self._rate = frames_per_s
        self._writer: cv2.VideoWriter | None = None

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append a picture.

        picture : (height, width, 3), always of the same size
        """
        if self._writer is None:
            size = (picture.shape[1], picture.shape[0])
            self._writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter.fourcc(*"mp4v"), self._rate, size)
            if not self._writer.isOpened():
                raise ConfigError(
                    f"{self.path}: the video cannot be written; check the folder and the free space"
                )
        self._writer.write(picture)

    def close(self) -> None:
        """Write the index, which makes the file playable."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None
