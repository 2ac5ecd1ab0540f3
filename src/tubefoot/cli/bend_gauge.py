"""The angle in the terminal while a finger bends."""

from __future__ import annotations

import sys
from typing import Any

GAUGE_S = 0.2
GAUGE_WIDTH = 41


class Gauge:
    """The angle in the terminal: a bar that moves, or a line a second where the output is a file."""

    def __init__(self) -> None:
        self._live = sys.stdout.isatty()
        self._next = self._last = 0.0
        self._open = False

    def show(self, row: dict[str, Any]) -> None:
        """Draw a row of the trace when it is due.

        row : the newest
        """
        if row["time_s"] < self._last:
            self.close()
        self._last = row["time_s"]
        if row["time_s"] < self._next and row["command"] not in ("pulse", "finished"):
            return
        if not self._live and row["time_s"] < self._next:
            return
        self._next = row["time_s"] + (GAUGE_S if self._live else 1.0)
        text = gauge_line(row)
        print(f"\r\x1b[K{text}" if self._live else text, end="" if self._live else "\n", flush=True)
        self._open = self._live

    def close(self) -> None:
        """End the line of a motion; the next one begins at 0 s."""
        if self._open:
            print()
        self._next, self._open = 0.0, False


def gauge_line(row: dict[str, Any]) -> str:
    """One line: time, angle, a bar with angle and target, pressures, pulses.

    row : of the trace
    """
    right, left = row["pressure_right_kpa"], row["pressure_left_kpa"]
    tail = f"R {right:6.1f} L {left:6.1f} kPa  pulse {row['pulses']:3d}  {row['note'][:32]}"
    if "bend_deg" not in row:
        return f"{row['time_s']:7.2f} s   blind  {'?' * GAUGE_WIDTH}  {tail}"
    reach = max(45.0, 1.2 * abs(row["target_deg"]), abs(row["bend_deg"]))
    bar = ["."] * GAUGE_WIDTH
    for value, sign in ((0.0, "|"), (row["target_deg"], "x"), (row["bend_deg"], "o")):
        bar[round((value / reach + 1.0) / 2.0 * (GAUGE_WIDTH - 1))] = sign
    return f"{row['time_s']:7.2f} s {row['bend_deg']:7.2f} deg {''.join(bar)}  {tail}"
