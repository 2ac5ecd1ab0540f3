"""A recording in place of the bench: the same page, with play, pause, speed and a place to jump to."""

from __future__ import annotations

import base64
import threading
import time
from bisect import bisect_left
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tubefoot.config import parse_settings
from tubefoot.dashboard import wishes
from tubefoot.dashboard.eye import angle_row, sight_of
from tubefoot.dashboard.feed import Feed, Sight
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.recording import Recording
from tubefoot.vision.calibration import load_calibration
from tubefoot.vision.finger import FingerTracker
from tubefoot.vision.layout import MarkerLayout

STEP_S = 1 / 40
NAN = float("nan")
NO_LINE = np.zeros((0, 2), dtype=np.float32)
NO_OUTLINES = np.zeros((0, 4, 2), dtype=np.float32)
NO_SHAPE = np.zeros((0, 3), dtype=np.float32)


class Player:
    """Plays a recording into a feed; there is no pump, so every page may steer it."""

    def __init__(self, recording: Recording, calibration: Path | None, layout: MarkerLayout):
        """Prepare a replay.

        recording : to be played
        calibration : camera.toml to measure in its pictures with; without one they are shown as they are
        layout : markers on the finger
        """
        self.feed = Feed()
        self._recording = recording
        self._samples = recording.rows("samples")
        self._angles = recording.rows("angles")
        self._frames = recording.rows("frames")
        if not self._samples:
            raise ConfigError(f"{recording.path}: no samples in this recording, nothing to show")
        self._begin, self._end = self._samples[0]["time_s"], self._samples[-1]["time_s"]
        self._tracker = FingerTracker(load_calibration(calibration), layout) if calibration else None
        self._at, self._speed = self._begin, 1.0
        self._playing = threading.Event()
        self._playing.set()
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)

    def start(self) -> None:
        """Begin to play."""
        limits = self._recording.settings.limits
        bench = {
            "name": self._recording.path.name,
            "virtual": False,
            "camera": bool(self._frames or self._angles),
            "pressure_low_kpa": limits.pressure_low_kpa,
            "pressure_high_kpa": limits.pressure_high_kpa,
        }
        self.feed.tell(phase="replay", bench=bench, trouble=[], stop={"tripped": False}, heartbeat_s=2.0)
        self.feed.tell(notes=[self._note(row) for row in self._recording.rows("events")][-30:])
        self._tell()
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._ended.set()
        self._thread.join(timeout=5)

    def beat(self, page: str) -> None:
        """Hear that a page lives, which changes nothing here.

        page : its name
        """

    def trip(self, who: str) -> str:
        """Nothing: what the recorded pump did is done.

        who : asked for it
        """
        self._playing.clear()
        self._tell()
        return "not sent: this is a replay, no pump is connected"

    def do(self, page: str, message: Mapping[str, Any]) -> dict[str, Any]:
        """Steer the replay.

        page : any
        message : `do` is play, pause, seek (time_s) or speed (factor)
        """
        match message.get("do"):
            case "play":
                if self._at >= self._end:
                    self._jump(self._begin)
                self._playing.set()
            case "pause":
                self._playing.clear()
            case "seek":
                to = parse_settings(dict(message), wishes.Seek, source="replay").time_s
                self._jump(min(self._begin + to, self._end))
            case "speed":
                self._speed = parse_settings(dict(message), wishes.Speed, source="replay").factor
            case word:
                raise ConfigError(f"{word!r} is not for a replay; there are play, pause, seek, speed")
        self._tell()
        return {}

    def _jump(self, moment: float) -> None:
        with self._lock:
            self._at = moment
            self.feed.restart()

    def _play(self) -> None:
        shown: float | None = None
        while not self._ended.is_set():
            began = time.monotonic()
            with self._lock:
                start = self._at
                playing = self._playing.is_set()
                stop = min(start + STEP_S * self._speed, self._end) if playing else start
                self._at = stop
            if playing:
                self._show_rows(start, stop)
            if stop != shown:
                self._show_picture(stop)
                shown = stop
                self._tell()
            if stop >= self._end and playing:
                self._playing.clear()
                self._tell()
            self._ended.wait(max(0.0, STEP_S - (time.monotonic() - began)))

    def _show_rows(self, start: float, stop: float) -> None:
        for row in _between(self._samples, start, stop):
            pressures = (row["pressure_right_kpa"], row["pressure_left_kpa"], row["pumped_volume_ml"])
            supply = NAN if row["supply_v"] is None else row["supply_v"]
            drive = (float(row["direction"]), supply, float(row["faults"]))
            self.feed.sample((row["time_s"], *pressures, *drive))
        for row in _between(self._angles, start, stop):
            values = [_number(row[key]) for key in ("bend_deg", "sigma_deg", "theta1_deg", "theta2_deg")]
            self.feed.angle((row["time_s"], values[0], NAN, *values[1:]))

    def _show_picture(self, moment: float) -> None:
        """The last frame before a moment, measured in where the camera is known."""
        at = bisect_left(self._frames, moment, key=lambda row: row["time_s"])
        if not at:
            return
        row = self._frames[at - 1]
        data, time_s = base64.b64decode(row["data"]), row["time_s"]
        if self._tracker is None:
            size = (row["width"], row["height"])
            self.feed.sight(Sight(time_s, data, size, NO_OUTLINES, NO_LINE, NO_SHAPE, ""))
            return
        picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
        if picture is None:
            raise LinkError(f"{self._recording.path}: the frame at {time_s:.3f} s is damaged")
        reading = self._tracker.measure(np.asarray(picture, dtype=np.uint8), time_s)
        if not self._angles:
            self.feed.angle(angle_row(reading, NAN))
        self.feed.sight(sight_of(np.asarray(picture, dtype=np.uint8), reading, self._tracker))

    def _tell(self) -> None:
        self.feed.tell(
            replay={
                "at_s": round(self._at - self._begin, 2),
                "length_s": round(self._end - self._begin, 2),
                "playing": self._playing.is_set(),
                "speed": self._speed,
            }
        )

    def _note(self, row: Mapping[str, Any]) -> dict[str, Any]:
        detail = "; ".join(f"{key} {value}" for key, value in row["detail"].items())
        text = f"{row['name']} {detail}".strip()
        return {"time_s": round(row["time_s"] - self._begin, 2), "level": "info", "text": text}


def _between(rows: list[dict[str, Any]], start: float, stop: float) -> list[dict[str, Any]]:
    """The rows from `start` on and before `stop`."""
    first, last = (bisect_left(rows, moment, key=lambda row: row["time_s"]) for moment in (start, stop))
    return rows[first:last]


def _number(value: float | None) -> float:
    return NAN if value is None else value
