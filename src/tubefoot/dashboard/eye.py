"""The camera's frames on their way to a controller, shown to whoever watches."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.dashboard.feed import Sight
from tubefoot.units import DEG
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.camera import Camera
from tubefoot.vision.finger import FingerReading, FingerTracker
from tubefoot.vision.layout import MarkerLayout

FloatArray = NDArray[np.float64]

JPEG_QUALITY = 80
STATIONS = 49
"""Points of the middle line where the camera gives angles only."""
SQUARE = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
NOTHING = np.zeros((0, 2), dtype=np.float32)

Shown = Callable[[FingerReading, Sight], None]


class Eye:
    """An angle source that shows each frame, and what was measured in it, before it hands the reading on."""

    def __init__(self, camera: Camera, tracker: FingerTracker, show: Shown):
        """Pair camera and tracker.

        camera : where frames come from
        tracker : what measures the finger in them
        show : called with each reading and what it was read from
        """
        self._camera = camera
        self._tracker = tracker
        self._show = show

    @property
    def paced(self) -> bool:
        """Whether readings come in real time."""
        return self._camera.paced

    def open(self) -> None:
        """Open the camera."""
        self._camera.open()

    def read(self) -> FingerReading:
        """The reading of the next frame."""
        frame = self._camera.read()
        reading = self._tracker.measure(frame.picture, frame.time_s)
        self._show(reading, sight_of(frame.picture, reading, self._tracker))
        return reading

    def close(self) -> None:
        """Close the camera."""
        self._camera.close()


class BlindEye:
    """The same for a source without pixels."""

    def __init__(self, angles: AngleSource, layout: MarkerLayout, show: Shown):
        """Wrap a source.

        angles : gives readings
        layout : length of the finger and its rigid ends
        show : called with each reading and what it was read from
        """
        self._angles = angles
        self._layout = layout
        self._show = show

    @property
    def paced(self) -> bool:
        """Whether readings come in real time."""
        return self._angles.paced

    def open(self) -> None:
        """Open the source."""
        self._angles.open()

    def read(self) -> FingerReading:
        """The next reading."""
        reading = self._angles.read()
        shape = middle_line(reading, self._layout)
        none = np.zeros((0, 4, 2), dtype=np.float32)
        self._show(reading, Sight(reading.time_s, b"", (0, 0), none, NOTHING, shape, reading.fault))
        return reading

    def close(self) -> None:
        """Close the source."""
        self._angles.close()


def sight_of(picture: NDArray[np.uint8], reading: FingerReading, tracker: FingerTracker) -> Sight:
    """What there is to see of one frame.

    picture : grey or colour
    reading : measured in it
    tracker : that measured it
    """
    to_pixels = tracker.plane_map.to_pixels
    square = tracker.layout.marker_side_mm / 2 * SQUARE
    poses = [marker.pose for marker in reading.markers.values() if marker.pose is not None]
    outlines = [to_pixels(pose.to_outer(square)) for pose in poses]
    line = to_pixels(reading.centreline.points) if reading.centreline is not None else NOTHING
    _, packed = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return Sight(
        time=reading.time_s,
        jpeg=packed.tobytes(),
        size=(picture.shape[1], picture.shape[0]),
        outlines=np.array(outlines, dtype=np.float32).reshape(-1, 4, 2),
        line=np.asarray(line, dtype=np.float32),
        shape=middle_line(reading, tracker.layout),
        fault=reading.fault,
    )


def middle_line(reading: FingerReading, layout: MarkerLayout) -> NDArray[np.float32]:
    """The finger's middle line, (k, 3): x, z [mm], direction [rad]; empty where nothing is known of it.

    reading : its centreline, or, where there is none, two arcs that turn by theta1 and theta2, or one by bend
    layout : length and rigid ends
    """
    line = reading.centreline
    if line is not None:
        return np.column_stack([line.points, line.angle]).astype(np.float32)
    if not np.isfinite(reading.bend):
        return np.zeros((0, 3), dtype=np.float32)
    halves = (reading.theta1, reading.theta2)
    turns = halves if np.all(np.isfinite(halves)) else (reading.bend / 2, reading.bend / 2)
    begin, end = layout.rigid_base_mm, layout.length_mm - layout.rigid_tip_mm
    height = np.linspace(0.0, layout.length_mm, STATIONS)
    angle = np.interp(height, [begin, layout.length_mm / 2, end], np.cumsum([0.0, *turns]))
    middle = (angle[1:] + angle[:-1]) / 2
    steps = np.diff(height)[:, None] * np.column_stack([-np.sin(middle), np.cos(middle)])
    points = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    return np.column_stack([points, angle]).astype(np.float32)


def angle_row(reading: FingerReading, target: float) -> tuple[float, ...]:
    """A row of the feed's angles.

    reading : of a frame
    target : wanted bend at that time [rad], nan where there is none
    """
    angles = (reading.bend, target, reading.sigma, reading.theta1, reading.theta2)
    return (reading.time_s, *(angle / DEG for angle in angles))
