"""The board's clock in host time.

A frame arrives after its board time by a delay that is never below some minimum; so the smallest
`arrival - board time` seen in a while marks the offset, and a line under the minima of the last half minute
follows the drift of the board's resonator (up to 0.5 % on an Uno).
"""

from __future__ import annotations

from collections import deque

import numpy as np

WRAP_MS = 2**32
BIN_S = 1.0
BINS = 30
DRIFT_MAX = 0.006
JUMP_S = 0.2
"""More than the drift of half a minute."""


class BoardTime:
    """Maps board milliseconds, which wrap after 49.7 days, to host seconds."""

    def __init__(self) -> None:
        self._last_ms: int | None = None
        self._wraps = 0
        self._bins: deque[tuple[float, float]] = deque(
            maxlen=BINS
        )  # when and how much the smallest offset was
        self._bin_start = 0.0
        self._line = (0.0, 0.0)

    def observe(self, board_ms: int, arrival: float) -> float:
        """Board seconds, unwrapped, after learning from one arrival.

        board_ms : the board's time in the frame [ms]
        arrival : host time at which it came [s]
        """
        if self._last_ms is not None and self._last_ms - board_ms > WRAP_MS // 2:
            self._wraps += 1
        self._last_ms = board_ms
        board = (board_ms + self._wraps * WRAP_MS) * 1e-3
        offset = arrival - board
        if self._bins and board - self._bin_start < BIN_S:
            if offset < self._bins[-1][1]:
                self._bins[-1] = (board, offset)
                self._fit()
        else:
            self._forget_before_a_jump()
            self._bins.append((board, offset))
            self._bin_start = board
            self._fit()
        return board

    def host_time(self, board: float) -> float:
        """Host time [s] of a board time.

        board : unwrapped board time [s]
        """
        intercept, slope = self._line
        return board + intercept + slope * board

    def _forget_before_a_jump(self) -> None:
        """Start anew from the last second when all of it came late: board or host stood still."""
        if len(self._bins) > 1 and self._bins[-1][1] - min(offset for _, offset in self._bins) > JUMP_S:
            self._bins = deque([self._bins[-1]], maxlen=BINS)

    def _fit(self) -> None:
        """Lay a line under the smallest offsets."""
        times, offsets = np.array(self._bins).T
        slope = 0.0
        if len(times) >= 5:
            # without the last bin, whose smallest offset is not yet known
            slope = float(np.polyfit(times[:-1] - times[0], offsets[:-1], 1)[0])
            slope = min(max(slope, -DRIFT_MAX), DRIFT_MAX)
        self._line = (float(np.min(offsets - slope * times)), slope)
