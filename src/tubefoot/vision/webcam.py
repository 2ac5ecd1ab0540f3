"""Frames of a camera at this computer."""

from __future__ import annotations

import glob
import time
from collections.abc import Callable
from typing import Any

import cv2

from tubefoot.errors import LinkError
from tubefoot.vision.camera import CameraBase, Clock, Frame, fresh


class Webcam(CameraBase):
    """A V4L2 camera, read as fast as it delivers."""

    paced = True

    def __init__(
        self,
        device: int | str,
        resolution: tuple[int, int] = (640, 480),
        frames_per_s: float = 30.0,
        oldest_s: float = 0.25,
        clock: Clock = time.monotonic,
        connect: Callable[[int | str], Any] | None = None,
    ):
        """Remember how to open it.

        device : number or path, such as 0 or /dev/video0
        resolution : width and height to ask for [px]
        frames_per_s : rate to ask for [1/s]
        oldest_s : a frame older than this is an error [s]
        clock : gives the time of arrival, and of capture where the driver tells none
        connect : opens the device; OpenCV's V4L2 capture if not given
        """
        self.device = device
        self.resolution = resolution
        self._rate = frames_per_s
        self._oldest = oldest_s
        self._clock = clock
        self._connect = connect or (lambda device: cv2.VideoCapture(device, cv2.CAP_V4L2))
        self._capture: Any = None
        self._index = -1

    def open(self) -> None:
        """Open the device at the wanted size; raises LinkError naming the devices there are."""
        capture = self._connect(self.device)
        if not capture.isOpened():
            there = ", ".join(sorted(glob.glob("/dev/video*"))) or "none"
            raise LinkError(
                f"camera {self.device} cannot be opened; devices here: {there}. "
                "Check the cable, that no other program uses it, and that you are in the group `video`"
            )
        width, height = self.resolution
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, width)
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
        capture.set(cv2.CAP_PROP_FPS, self._rate)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        given = (round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
        if given != (width, height):
            capture.release()
            raise LinkError(
                f"camera {self.device} delivers {given[0]} x {given[1]} px instead of {width} x {height} px; "
                "ask for a size it has (v4l2-ctl --list-formats-ext) and calibrate at that size"
            )
        self._capture = capture

    def read(self) -> Frame:
        """The next frame; its time is the driver's time stamp where that agrees with the clock."""
        if self._capture is None:
            raise LinkError(f"camera {self.device} is not open; open it first, or use it in a `with` block")
        good, picture = self._capture.read()
        arrived = self._clock()
        if not good or picture is None:
            raise LinkError(
                f"camera {self.device} stopped delivering frames; check its cable and start again"
            )
        self._index += 1
        stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
        taken = stamp if 0 <= arrived - stamp < 10 else arrived
        return fresh(Frame(picture, self._index, taken), self._clock, self._oldest)

    def close(self) -> None:
        """Release the device."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None
