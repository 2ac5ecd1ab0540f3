"""The state of a bench in the page's words: troubles with what to do, the log, what the bench is."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

from tubefoot.dashboard.benches import Bench
from tubefoot.dashboard.feed import Feed
from tubefoot.lab.messages import FAULT_ACTIONS, Fault
from tubefoot.lab.rig import Reading, fault_names
from tubefoot.units import KPA, ML

NOTES = 30


class Log:
    """The newest lines of a session's log; any thread may write."""

    def __init__(self, feed: Feed):
        """Begin empty.

        feed : where they are shown
        """
        self._feed = feed
        self._lines: deque[dict[str, Any]] = deque(maxlen=NOTES)
        self._lock = threading.Lock()

    def write(self, time_s: float, level: str, text: str) -> None:
        """Add a line.

        time_s : on the bench's clock [s]
        level : info, good, warning, alarm
        text : what happened
        """
        with self._lock:
            self._lines.append({"time_s": round(time_s, 2), "level": level, "text": text})
            self._feed.tell(notes=list(self._lines))


def sample_row(reading: Reading) -> tuple[float, ...]:
    """A row of the feed's samples.

    reading : of the rig
    """
    right, left = reading.pressures[:2]
    faults, volume = float(reading.faults), reading.pumped_volume / ML
    return (reading.time, right / KPA, left / KPA, volume, float(reading.direction), reading.supply, faults)


def troubles(faults: Fault, line: str = "", camera: str = "") -> list[dict[str, str]]:
    """Everything that is wrong, each with what to do.

    faults : latched on the board
    line : why the board does not answer, empty when it does
    camera : why there is no picture, empty when there is one
    """
    found = [trouble("no answer from the board", line)] if line else []
    if camera:
        found.append(trouble("no picture", camera))
    return found + [trouble(fault_names(fault), FAULT_ACTIONS[fault]) for fault in Fault if fault in faults]


def trouble(what: str, advice: str) -> dict[str, str]:
    """One thing that is wrong.

    what : it is
    advice : what to do
    """
    return {"what": what, "advice": advice}


def description(bench: Bench) -> dict[str, Any]:
    """What a bench is, for the page.

    bench : open
    """
    limits = bench.rig.settings.limits
    return {
        "name": bench.name,
        "virtual": bench.hands is not None,
        "camera": bench.angles is not None,
        "pressure_low_kpa": limits.pressure_low_kpa,
        "pressure_high_kpa": limits.pressure_high_kpa,
    }
