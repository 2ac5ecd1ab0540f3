"""A recording as a Rig: the same contract, its time that of the recording."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace
from pathlib import Path
from typing import Any

from tubefoot.errors import LinkError
from tubefoot.lab.clock import ManualClock
from tubefoot.lab.messages import EndReason, Fault
from tubefoot.lab.pump import plan_pulse
from tubefoot.lab.recording import Recording
from tubefoot.lab.rig import EndedPulse, Neutral, Reading, RigLimits, SentPulse
from tubefoot.lab.settings import BRANCHES
from tubefoot.units import KPA, ML

LATE_S = 0.5


class ReplayRig:
    """Plays a recording back: waiting moves through it, a pulse must be the one that was recorded next.

    A controller that decides as it did goes through unchanged; one that decides otherwise raises LinkError,
    because what the bench would have done is not in the recording.
    """

    def __init__(self, recording: Recording | Path | str):
        """Open a recording.

        recording : or the path of one
        """
        self.recording = recording if isinstance(recording, Recording) else Recording(recording)
        self.limits: RigLimits = self.recording.settings.rig_limits()
        self._readings = [self._reading(row) for row in self.recording.rows("samples")]
        if not self._readings:
            raise LinkError(f"{self.recording.path}: no samples in this recording")
        self._times = [reading.time for reading in self._readings]
        self.clock = ManualClock(self._times[0])
        self._pulses = self.recording.rows("pulses")
        self._next_pulse = 0
        self._connected = False

    @property
    def faults(self) -> Fault:
        """Faults latched at this time of the recording."""
        row = self._last("faults")
        return Fault(row["faults"]) if row else Fault(0)

    @property
    def last_pulse(self) -> EndedPulse | None:
        """The pulse that has ended by now, None while one runs."""
        started, ended = self._last("pulses"), self._last("pulse_ends")
        if ended is None or (started is not None and ended["time_s"] < started["time_s"]):
            return None
        reason = EndReason[ended["reason"].upper()]
        return EndedPulse(ended["time_s"], ended["duration_s"], ended["volume_ml"] * ML, reason)

    def connect(self) -> None:
        """Begin at the first sample, or go on where the replay stands."""
        self._connected = True

    def close(self) -> None:
        """End the replay."""
        self._connected = False

    def read(self) -> Reading:
        """The newest reading; raises LinkError in a gap or past the end."""
        self._demand_connection()
        now = self.clock.now()
        reading = self._readings[max(0, bisect_right(self._times, now) - 1)]
        if now - reading.time > LATE_S:
            raise LinkError(
                f"{self.recording.path}: no sample at {now:.3f} s; the recording has a gap or ends here"
            )
        return replace(reading, age=max(0.0, now - reading.time))

    def wait(self, seconds: float) -> list[Reading]:
        """The readings of the next stretch.

        seconds : its length [s]
        """
        self._demand_connection()
        start = bisect_right(self._times, self.clock.now())
        self.clock.sleep(seconds)
        end = bisect_right(self._times, self.clock.now())
        now = self.clock.now()
        return [replace(reading, age=now - reading.time) for reading in self._readings[start:end]]

    def pulse(self, direction: int, duty: float, duration: float) -> SentPulse:
        """The recorded pulse, if it is the one asked for.

        direction : 1 forward, -1 reverse
        duty : 0 to 1
        duration : [s]
        """
        self._demand_connection()
        asked = plan_pulse(self.limits, self.recording.settings.pump, direction, duty, duration)
        if self._next_pulse >= len(self._pulses):
            raise LinkError(
                f"{self.recording.path}: a pulse is asked for that was not recorded: none is left"
            )
        row = self._pulses[self._next_pulse]
        there = (row["direction"], round(row["duty"] * 255), round(row["duration_s"] * 1e3))
        here = (asked.direction, round(asked.duty * 255), round(asked.duration * 1e3))
        if here != there:
            raise LinkError(
                f"{self.recording.path}: asked for direction {here[0]}, duty {here[1]}/255, {here[2]} ms "
                f"where {there[0]}, {there[1]}/255, {there[2]} ms was recorded at {row['time_s']:.3f} s"
            )
        self._next_pulse += 1
        self.clock.move_to(row["time_s"])
        return replace(asked, time=row["time_s"])

    def stop(self) -> None:
        """Nothing: what the recorded pump did is done."""
        self._demand_connection()

    def clear_faults(self) -> None:
        """Nothing: the recorded faults stay as they were."""
        self._demand_connection()

    def set_neutral(self, neutral: Neutral) -> None:
        """Nothing: the recorded pressures are already corrected by the recorded neutral reading.

        neutral : ignored
        """
        self._demand_connection()

    def _demand_connection(self) -> None:
        if not self._connected:
            raise LinkError(f"{self.recording.path}: the replay is closed; connect first")

    def _last(self, topic: str) -> dict[str, Any] | None:
        """The newest entry of a topic at this time."""
        rows = self.recording.rows(topic)
        at = bisect_right(rows, self.clock.now(), key=lambda row: row["time_s"])
        return rows[at - 1] if at else None

    def _reading(self, row: dict[str, Any]) -> Reading:
        branches = BRANCHES[: self.limits.channels]
        return Reading(
            time=row["time_s"],
            age=0.0,
            pressures=tuple(row[f"pressure_{branch}_kpa"] * KPA for branch in branches),
            gauge_pressures=tuple(row[f"gauge_{branch}_kpa"] * KPA for branch in branches),
            supply=float("nan") if row["supply_v"] is None else row["supply_v"],
            direction=row["direction"],
            pumped_volume=row["pumped_volume_ml"] * ML,
            faults=Fault(row["faults"]),
        )
