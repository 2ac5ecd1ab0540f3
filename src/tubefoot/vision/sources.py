"""Sources of frames: webcam, video file, image folder, frames of a recording, virtual camera."""

from __future__ import annotations

import glob
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, LinkError
from tubefoot.vision.camera import CameraBase, Clock, EndOfFrames, Frame, fresh

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


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


class VideoFile(CameraBase):
    """A video file, frame by frame; the time is the one stored in the file."""

    def __init__(self, path: Path | str):
        """Remember the file.

        path : any video that FFmpeg reads
        """
        self.path = Path(path)
        self.resolution = (0, 0)
        self._capture: cv2.VideoCapture | None = None
        self._index = -1

    def open(self) -> None:
        """Open the file; raises ConfigError when it is missing or no video."""
        if not self.path.is_file():
            raise ConfigError(f"{self.path}: no such video file")
        capture = cv2.VideoCapture(str(self.path), cv2.CAP_FFMPEG)
        if not capture.isOpened():
            raise ConfigError(
                f"{self.path}: cannot be read as a video; it may be cut off before its index was written. "
                "Convert or repair it with ffmpeg"
            )
        self.resolution = (
            round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
            round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
        )
        self._promised = round(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self._rate = capture.get(cv2.CAP_PROP_FPS) or 30.0
        self._capture = capture

    def read(self) -> Frame:
        """The next frame; raises LinkError when the file breaks off before its promised end."""
        if self._capture is None:
            raise LinkError(f"{self.path} is not open; open it first, or use it in a `with` block")
        good, picture = self._capture.read()
        if not good:
            delivered = self._index + 1
            if self._promised > 0 and delivered < self._promised - 2:
                raise LinkError(
                    f"{self.path} breaks off after {delivered} of {self._promised} frames: the file is cut "
                    "off or damaged; what was read before is good"
                )
            raise EndOfFrames
        self._index += 1
        stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
        time_s = stamp if stamp > 0 or self._index == 0 else self._index / self._rate
        return Frame(np.asarray(picture, dtype=np.uint8), self._index, time_s)

    def close(self) -> None:
        """Close the file."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None


class ImageFolder(CameraBase):
    """The pictures of a folder, in order of their names, at an even rate."""

    def __init__(self, path: Path | str, frames_per_s: float = 30.0):
        """Remember the folder.

        path : folder of PNG, JPEG, BMP, TIFF or WebP pictures
        frames_per_s : rate at which they were taken [1/s]
        """
        if frames_per_s <= 0:
            raise ConfigError(f"frames_per_s = {frames_per_s:g} must be above 0")
        self.path = Path(path)
        self.resolution = (0, 0)
        self._rate = frames_per_s
        self._files: list[Path] = []
        self._index = 0

    def open(self) -> None:
        """List the pictures; raises ConfigError when there are none."""
        self._files = image_files(self.path)
        self._index = 0
        self.resolution = read_image(self._files[0]).shape[1::-1]

    def read(self) -> Frame:
        """The next picture; raises LinkError for one that cannot be decoded or has another size."""
        if self._index >= len(self._files):
            raise EndOfFrames
        path = self._files[self._index]
        picture = read_image(path)
        if picture.shape[1::-1] != self.resolution:
            raise LinkError(
                f"{path} is {picture.shape[1]} x {picture.shape[0]} px, the first picture "
                f"{self.resolution[0]} x {self.resolution[1]} px; put one size into a folder"
            )
        frame = Frame(picture, self._index, self._index / self._rate)
        self._index += 1
        return frame


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


def image_files(path: Path) -> list[Path]:
    """The pictures of a folder in order of their names; raises ConfigError when there are none.

    path : the folder
    """
    if not path.is_dir():
        raise ConfigError(f"{path}: no such folder")
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES)
    if not files:
        raise ConfigError(f"{path} holds no pictures ({', '.join(IMAGE_SUFFIXES)})")
    return files


def read_image(path: Path) -> NDArray[np.uint8]:
    """A picture, grey or colour as stored; raises ConfigError or LinkError when missing or damaged.

    path : the file
    """
    if not path.is_file():
        raise ConfigError(f"{path}: no such picture")
    packed = path.read_bytes()
    picture = cv2.imdecode(np.frombuffer(packed, dtype=np.uint8), cv2.IMREAD_ANYCOLOR) if packed else None
    if picture is None:
        raise LinkError(f"{path}: cannot be decoded; the file is cut off or no picture")
    return np.asarray(picture, dtype=np.uint8)


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
