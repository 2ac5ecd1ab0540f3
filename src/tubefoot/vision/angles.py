"""Where a controller's angles come from: any camera with a tracker, or something that needs no pixels."""

from __future__ import annotations

from typing import Protocol

from tubefoot.vision.camera import Camera
from tubefoot.vision.finger import FingerReading, FingerTracker


class AngleSource(Protocol):
    """Finger readings in the order of their capture, each once; open it before the first."""

    @property
    def paced(self) -> bool:
        """Whether readings come in real time, so that an old one is an error."""

    def open(self) -> None:
        """Start delivering."""

    def read(self) -> FingerReading:
        """The next reading; one with a fault when the marker was not seen.

        Raises LinkError when the camera stopped, StaleFrameError for an old frame, EndOfFrames at the end.
        """

    def close(self) -> None:
        """Stop delivering; may be called twice."""


class TrackedAngles:
    """Angles measured in the frames of a camera."""

    def __init__(self, camera: Camera, tracker: FingerTracker):
        """Pair a camera with a tracker.

        camera : where frames come from
        tracker : what measures the finger in them
        """
        self.camera = camera
        self.tracker = tracker

    @property
    def paced(self) -> bool:
        """Whether readings come in real time."""
        return self.camera.paced

    def open(self) -> None:
        """Open the camera."""
        self.camera.open()

    def read(self) -> FingerReading:
        """The reading of the next frame."""
        frame = self.camera.read()
        return self.tracker.measure(frame.picture, frame.time_s)

    def close(self) -> None:
        """Close the camera."""
        self.camera.close()
