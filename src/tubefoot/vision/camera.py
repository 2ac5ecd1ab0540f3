"""Camera: the one contract behind every source of frames.

A frame carries the time it was taken, in the clock of its camera. Who steers by a frame must know how old
it is: a frame older than the camera's limit is an error, never a silent repeat.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import LinkError

Clock = Callable[[], float]
"""The present time [s]; any origin, never running backwards."""


class StaleFrameError(LinkError):
    """The newest frame is older than the camera's limit."""


class EndOfFrames(Exception):
    """The source has delivered its last frame."""


@dataclass(frozen=True)
class Frame:
    """One picture.

    picture : (height, width) grey or (height, width, 3) blue, green, red, eight bits
    index : running number in its source; a gap tells of lost frames
    time_s : capture time, middle of the exposure, in the camera's clock [s]
    """

    picture: NDArray[np.uint8]
    index: int
    time_s: float

    def age(self, now_s: float) -> float:
        """Time since it was taken [s].

        now_s : the present time in the camera's clock [s]
        """
        return now_s - self.time_s


class Camera(Protocol):
    """What every camera offers; the constructor opens nothing, `open` does."""

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height of its frames [px], known once it is open."""
        ...

    @property
    def paced(self) -> bool:
        """Whether frames come in real time, so that an old one is stale; a file waits for its reader."""
        ...

    def open(self) -> None:
        """Start delivering; raises LinkError or ConfigError with the cause when that is not possible."""
        ...

    def read(self) -> Frame:
        """The next frame, each one once; EndOfFrames after the last, StaleFrameError for an old one."""
        ...

    def close(self) -> None:
        """Stop delivering; may be called twice."""
        ...

    def __enter__(self) -> Self:
        """Open."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        ...


class CameraBase:
    """What cameras share: use as a context, refusing stale frames."""

    paced = False

    def open(self) -> None:
        """Start delivering."""
        raise NotImplementedError

    def close(self) -> None:
        """Stop delivering."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def fresh(frame: Frame, clock: Clock, limit_s: float) -> Frame:
    """The same frame, if it is not older than the limit; else StaleFrameError.

    frame : to be judged
    clock : the camera's clock
    limit_s : greatest age [s]
    """
    age = frame.age(clock())
    if age > limit_s:
        raise StaleFrameError(
            f"frame {frame.index} is {age * 1e3:.0f} ms old, the limit is {limit_s * 1e3:.0f} ms: the camera "
            "stalled or the reader is too slow; check the cable, lower the resolution, or raise the age limit"
        )
    return frame


def grey_picture(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture in grey, unchanged when it is so already.

    picture : (height, width) grey, or (height, width, 3) blue, green, red
    """
    if picture.ndim == 2:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
