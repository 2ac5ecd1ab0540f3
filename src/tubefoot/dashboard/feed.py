"""What the bench shows: rings of samples and angles, the newest picture, the state in words.

One thread writes, any number read; a reader keeps a `Cursor` and gets what is newer, at most a ring's length.
Rows are in the units of the page: s, kPa, ml, deg.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLE_COLUMNS = ("time_s", "right_kpa", "left_kpa", "volume_ml", "direction", "supply_v", "faults")
ANGLE_COLUMNS = ("time_s", "bend_deg", "target_deg", "sigma_deg", "theta1_deg", "theta2_deg")
KEPT_S = 60.0
SAMPLES_PER_S, ANGLES_PER_S = 50, 30


@dataclass(frozen=True)
class Sight:
    """One camera frame with what was measured in it.

    time : when it was taken [s]
    jpeg : the encoded picture, empty where there are no pixels
    size : width and height [px]
    outlines : corners of each measured marker, (n, 4, 2) [px]; tip last
    line : centreline, (m, 2) [px]
    shape : the finger's middle line from base to tip, (k, 3): x, z [mm], direction [rad]
    fault : why the tip is lost, empty when it is not
    """

    time: float
    jpeg: bytes
    size: tuple[int, int]
    outlines: NDArray[np.float32]
    line: NDArray[np.float32]
    shape: NDArray[np.float32]
    fault: str


class Ring:
    """The newest rows of a table, numbered from the first one ever."""

    def __init__(self, length: int):
        """Begin empty.

        length : how many rows are kept
        """
        self.count = 0
        self._rows: deque[Sequence[float]] = deque(maxlen=length)

    def add(self, row: Sequence[float]) -> None:
        """Append a row.

        row : its values
        """
        self._rows.append(row)
        self.count += 1

    def after(self, count: int) -> list[Sequence[float]]:
        """The rows that came after the first `count` ones, as far as they are kept."""
        new = min(max(0, self.count - count), len(self._rows))
        return list(islice(self._rows, len(self._rows) - new, None)) if new else []


@dataclass
class Cursor:
    """How far a reader has read."""

    samples: int = 0
    angles: int = 0
    sight: int = 0
    status: int = 0


@dataclass(frozen=True)
class News:
    """What a reader has not seen yet; None and empty where there is nothing."""

    samples: list[Sequence[float]] = field(default_factory=list)
    angles: list[Sequence[float]] = field(default_factory=list)
    sight: Sight | None = None
    status: Mapping[str, Any] | None = None

    def __bool__(self) -> bool:
        return bool(self.samples or self.angles or self.sight or self.status)


class Feed:
    """The meeting place of the bench's thread and those who watch."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._samples = Ring(round(KEPT_S * SAMPLES_PER_S))
        self._angles = Ring(round(KEPT_S * ANGLES_PER_S))
        self._sight: Sight | None = None
        self._sights = 0
        self._status: dict[str, Any] = {}
        self._statuses = 0
        self._due = float("-inf")
        self._last_state: tuple[float, float] = (0.0, 0.0)

    def sample(self, row: Sequence[float]) -> None:
        """Show a sample, thinned to what a screen can show; changes of drive and faults always.

        row : by SAMPLE_COLUMNS
        """
        state = (row[4], row[6])
        if row[0] < self._due and state == self._last_state:
            return
        with self._lock:
            self._due, self._last_state = row[0] + 1 / SAMPLES_PER_S - 1e-3, state
            self._samples.add(row)

    def angle(self, row: Sequence[float]) -> None:
        """Show an angle.

        row : by ANGLE_COLUMNS
        """
        with self._lock:
            self._angles.add(row)

    def sight(self, sight: Sight) -> None:
        """Replace the picture.

        sight : the newest
        """
        with self._lock:
            self._sight = sight
            self._sights += 1

    def tell(self, **state: Any) -> None:
        """Change the state in words; what stays the same is not sent again.

        state : values that JSON can hold
        """
        with self._lock:
            if any(self._status.get(key, self) != value for key, value in state.items()):
                self._status = {**self._status, **state}
                self._statuses += 1

    @property
    def status(self) -> Mapping[str, Any]:
        """The whole state in words; replaced, never changed."""
        return self._status

    def restart(self) -> None:
        """Forget rows whose time may come again (a replay that jumped)."""
        with self._lock:
            self._due = float("-inf")

    def after(self, cursor: Cursor) -> News:
        """What came after a cursor, which moves on.

        cursor : of this reader
        """
        with self._lock:
            news = News(
                self._samples.after(cursor.samples),
                self._angles.after(cursor.angles),
                self._sight if self._sights > cursor.sight else None,
                self._status if self._statuses > cursor.status else None,
            )
            cursor.samples, cursor.angles = self._samples.count, self._angles.count
            cursor.sight, cursor.status = self._sights, self._statuses
        return news
