"""A motion as it is recorded, and what the loop remembers while it lasts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from tubefoot.control.contract import Command, Finished, Measurement
from tubefoot.control.guard import AnswerCheck
from tubefoot.lab.rig import Reading
from tubefoot.units import DEG, KPA, ML

STOP_S, OLD_SAMPLE_S = 0.08, 0.2
"""A pressure is extrapolated to the next decision and the motor's end, from samples no further apart [s]."""
IDLE_S = 10.0
"""A motion with all its pulses given that waited for so long waits in vain [s]."""


@dataclass
class Motion:
    """One motion, from its begin to its end.

    rows : of the trace, one a frame; settled : whether the goal was met; reason : why it ended
    pulses : how often the pump ran; began, ended : on the rig's clock [s]
    """

    controller: str
    began: float
    ended: float = math.nan
    settled: bool = False
    reason: str = ""
    pulses: int = 0
    rows: list[dict[str, Any]] = field(default_factory=list)


@dataclass
class MotionState:
    """What the loop remembers during one motion.

    answers : whether the bench answers; sighted : when an angle was last seen [s]
    volume_foreseen, volume_at_start : [mm^3]; part, timed : as given to the loop
    oldest_s : a frame that is older does not tell the angle [s]; why_blind : why none does
    held_back : whether limits stopped the last pulse; pressed_s, pressed_since : how long they do, since when
    cleared : pressure faults so far; duty, direction, last_pulse : of the newest pulse, when it was sent [s]
    before : the sample before the newest
    """

    answers: AnswerCheck
    sighted: float
    volume_foreseen: float
    part: str
    timed: bool = True
    oldest_s: float = 0.3
    why_blind: str = ""
    held_back: bool = False
    pressed_s: float = 0.0
    pressed_since: float = math.nan
    cleared: int = 0
    duty: float = 0.0
    direction: int = 0
    before: Reading | None = None
    last_pulse: float = -math.inf
    volume_at_start: float = 0.0

    def press(self, now: float) -> None:
        """The limits hold the motion back now [s]."""
        if math.isfinite(self.pressed_since):
            self.pressed_s += now - self.pressed_since
        self.pressed_since = now

    def rest(self) -> None:
        """They do not any more."""
        self.pressed_since = math.nan

    def extrapolated(self, sample: Reading) -> tuple[float, float]:
        """Right and left gauge pressure when a stop would take effect [MPa]; sample : the newest."""
        before, self.before = self.before, sample
        right, left = sample.gauge_pressures[:2]
        if before is None or not 1e-3 < sample.time - before.time < OLD_SAMPLE_S:
            return right, left
        share = STOP_S / (sample.time - before.time)
        return right + share * (right - before.gauge_pressures[0]), left + share * (
            left - before.gauge_pressures[1]
        )

    def hopeless(self, now: float) -> bool:
        """Whether the last pulse was long ago, with none to come.

        now : on the rig's clock [s]
        """
        return now - self.last_pulse > IDLE_S


def seen_row(
    seen: Measurement, target: float, sample: Reading, motion: Motion, state: MotionState, command: Command
) -> dict[str, Any]:
    """Row of the trace for a frame that told the angle.

    seen : the frame; target : at its time [rad]; sample : of the rig
    motion, state : so far; command : what was decided
    """
    note = command.reason if isinstance(command, Finished) else command.note
    return {
        "time_s": seen.time - motion.began,
        "seen_at_s": seen.seen_at - motion.began,
        "part": state.part,
        "target_deg": target / DEG,
        "bend_deg": seen.bend / DEG,
        "error_deg": (target - seen.bend) / DEG,
        "sigma_deg": seen.sigma / DEG,
        **_bench_columns(sample, motion, state),
        "command": type(command).__name__.lower(),
        "note": note.splitlines()[0] if note else "",
    }


def blind_row(now: float, sample: Reading, motion: Motion, state: MotionState) -> dict[str, Any]:
    """Row of the trace for a frame that did not.

    now : on the rig's clock [s]; sample : of the rig; motion, state : so far
    """
    return {
        "time_s": now - motion.began,
        "part": state.part,
        **_bench_columns(sample, motion, state),
        "command": "blind",
        "note": state.why_blind.splitlines()[0],
    }


def _bench_columns(sample: Reading, motion: Motion, state: MotionState) -> dict[str, Any]:
    return {
        "pressure_right_kpa": sample.pressures[0] / KPA,
        "pressure_left_kpa": sample.pressures[1] / KPA,
        "pumped_volume_ml": sample.pumped_volume / ML,
        "direction": sample.direction,
        "duty": state.duty if sample.direction else 0.0,
        "pulses": motion.pulses,
    }
