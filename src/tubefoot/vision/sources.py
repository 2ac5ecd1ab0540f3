"""Sources of frames: what a user's word stands for; frames of a recording, the virtual camera."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, LinkError
from tubefoot.vision.camera import CameraBase, Clock, EndOfFrames, Frame, fresh
from tubefoot.vision.picture_files import ImageFolder, VideoFile
from tubefoot.vision.webcam import Webcam


class EncodedFrames(CameraBase):
    """Frames of a recording: any iterable of capture time [s] and encoded picture (JPEG, PNG)."""

    def __init__(self, source: Callable[[], Iterable[tuple[float, bytes]]], name: str = "recording"):
        """Remember where they come from.

        source : called at opening; yields capture time [s] and encoded picture
        name : what to call it in an error
        """
        self._source = source
        self._name = name
        self._frames: Iterator[tuple[float, bytes]] = iter(())
        self._ahead: Frame | None = None
        self.resolution = (0, 0)

    def open(self) -> None:
        """Decode the first frame; raises ConfigError when there is none."""
        self._frames = iter(self._source())
        self._ahead = self._decode_next(0)
        if self._ahead is None:
            raise ConfigError(f"{self._name} holds no camera frames; record with a camera connected")
        self.resolution = self._ahead.picture.shape[1::-1]

    def read(self) -> Frame:
        """The next frame; raises LinkError for one that cannot be decoded."""
        frame = self._ahead
        if frame is None:
            raise EndOfFrames
        self._ahead = self._decode_next(frame.index + 1)
        return frame

    def _decode_next(self, index: int) -> Frame | None:
        entry = next(self._frames, None)
        if entry is None:
            return None
        time_s, packed = entry
        picture = (
            cv2.imdecode(np.frombuffer(packed, dtype=np.uint8), cv2.IMREAD_UNCHANGED) if packed else None
        )
        if picture is None:
            raise LinkError(
                f"frame {index} of {self._name}, at {time_s:.3f} s, cannot be decoded: it is damaged"
            )
        return Frame(np.asarray(picture, dtype=np.uint8), index, time_s)


class VirtualCamera(CameraBase):
    """A camera whose frames are drawn at the moment they are asked for."""

    paced = True

    def __init__(
        self,
        draw: Callable[[float], NDArray[np.uint8]],
        resolution: tuple[int, int],
        clock: Clock,
        latency_s: float = 0.0,
        oldest_s: float = 0.25,
        last_s: float = float("inf"),
    ):
        """Remember how to draw.

        draw : picture at a capture time [s]
        resolution : width and height [px]
        clock : the present time [s]
        latency_s : from capture to delivery [s]
        oldest_s : a frame older than this is an error [s]
        last_s : no frames after this time [s]
        """
        self._draw = draw
        self.resolution = resolution
        self._clock = clock
        self._latency = latency_s
        self._oldest = oldest_s
        self._last = last_s
        self._index = -1
        self._is_open = False

    def open(self) -> None:
        """Start."""
        self._is_open = True

    def read(self) -> Frame:
        """The frame that was taken one latency ago."""
        if not self._is_open:
            raise LinkError("the virtual camera is not open; open it first, or use it in a `with` block")
        taken = self._clock() - self._latency
        if taken > self._last:
            raise EndOfFrames
        picture = self._draw(taken)
        if picture.shape[1::-1] != self.resolution:
            raise LinkError(
                f"the virtual camera drew {picture.shape[1]} x {picture.shape[0]} px instead of "
                f"{self.resolution[0]} x {self.resolution[1]} px"
            )
        self._index += 1
        return fresh(Frame(picture, self._index, taken), self._clock, self._oldest)

    def close(self) -> None:
        """Stop."""
        self._is_open = False


def open_source(
    source: str, resolution: tuple[int, int], frames_per_s: float = 30.0
) -> Webcam | VideoFile | ImageFolder:
    """The camera that a user's word stands for, not yet opened.

    source : number or /dev path of a webcam, a video file, or a folder of pictures
    resolution : width and height that a webcam is asked for [px]
    frames_per_s : rate of a webcam or of a folder's pictures [1/s]
    """
    if source.isdigit():
        return Webcam(int(source), resolution, frames_per_s)
    if source.startswith("/dev/"):
        return Webcam(source, resolution, frames_per_s)
    path = Path(source)
    if path.is_dir():
        return ImageFolder(path, frames_per_s)
    if not path.exists():
        raise ConfigError(
            f"{source}: no such source; give a camera number (0), a device (/dev/video0), a video file, "
            "a folder of pictures, a recording (.mcap) or `virtual`"
        )
    return VideoFile(path)
