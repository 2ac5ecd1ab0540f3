"""Time, injected: the same code runs on the wall clock, on a stepped simulation and on a recording."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds since some start, never going back."""

    def now(self) -> float:
        """The time now [s]."""

    def sleep(self, seconds: float) -> None:
        """Let time pass.

        seconds : how long [s]; nothing happens when it is not positive
        """


class SystemClock:
    """The computer's monotonic clock."""

    def now(self) -> float:
        """The time now [s]."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait.

        seconds : how long [s]
        """
        if seconds > 0:
            time.sleep(seconds)


class ManualClock:
    """A clock that moves only when told to, for replay and tests."""

    def __init__(self, start: float = 0.0):
        """Start the clock.

        start : first time [s]
        """
        self._now = start

    def now(self) -> float:
        """The time now [s]."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Move on.

        seconds : how far [s]
        """
        self._now += max(0.0, seconds)

    def move_to(self, moment: float) -> None:
        """Move on to a moment; one that has passed changes nothing.

        moment : [s]
        """
        self._now = max(self._now, moment)
