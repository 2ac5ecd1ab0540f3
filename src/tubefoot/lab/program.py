"""A list of pulses to run at given times, from a CSV file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tubefoot.errors import ConfigError
from tubefoot.lab.rig import Rig
from tubefoot.records import read_table

COLUMNS = ("time_s", "direction", "duty", "duration_s")
REST_S = 0.5


@dataclass(frozen=True, slots=True)
class PlannedPulse:
    """A pulse: when [s] after the start, direction (1 or -1), duty and duration [s]."""

    time: float
    direction: int
    duty: float
    duration: float


def load_program(path: Path) -> list[PlannedPulse]:
    """The pulses of a file, checked: in order, not overlapping.

    path : CSV with the columns time_s, direction, duty, duration_s

    Raises ConfigError naming the line that is wrong.
    """
    program: list[PlannedPulse] = []
    for number, row in enumerate(read_table(path), start=2):
        values = [row.get(name) for name in COLUMNS]
        if not all(isinstance(value, float) for value in values):
            raise ConfigError(f"{path}, line {number}: needs numbers in the columns {', '.join(COLUMNS)}")
        pulse = PlannedPulse(values[0], int(values[1]), values[2], values[3])  # type: ignore[arg-type]
        if pulse.direction not in (1, -1) or not 0 < pulse.duty <= 1 or not 0.001 <= pulse.duration <= 10:
            raise ConfigError(
                f"{path}, line {number}: direction is 1 or -1, duty above 0 to 1, duration_s 0.001 to 10"
            )
        if program and pulse.time < program[-1].time + program[-1].duration:
            raise ConfigError(f"{path}, line {number}: begins before the pulse above it has ended")
        program.append(pulse)
    return program


def play(rig: Rig, program: Sequence[PlannedPulse], say: Callable[[str], None]) -> None:
    """Run the pulses at their times, and half a second more.

    rig : connected
    program : what to run
    say : told of every pulse
    """
    start = rig.clock.now()
    for number, planned in enumerate(program, start=1):
        rig.wait(start + planned.time - rig.clock.now())
        sent = rig.pulse(planned.direction, planned.duty, planned.duration)
        way = "forward" if sent.direction > 0 else "reverse"
        say(f"pulse {number}/{len(program)}: {way}, duty {sent.duty:.2f}, {sent.duration:.3f} s")
    if program:
        rig.wait(program[-1].duration + REST_S)
