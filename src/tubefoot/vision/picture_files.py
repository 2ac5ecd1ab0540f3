"""Frames from files: a video, a folder of pictures, one picture."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, LinkError
from tubefoot.vision.camera import CameraBase, EndOfFrames, Frame

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


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
