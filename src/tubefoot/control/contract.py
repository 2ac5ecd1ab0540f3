"""What a controller sees and what it may say; every controller is a pure function of what it has seen.

The pacing, the pump, the limits and the record are the loop's affair (`loop.py`). A pulse is one run of the
pump in one direction at one duty; a controller may end it early.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Measurement:
    """The bench at one camera frame.

    time : now, on the rig's clock [s]
    seen_at : when the frame was taken [s]
    bend : angle at that time [rad]; sigma : its standard uncertainty [rad]
    pressures : gauge, right and left branch [MPa]
    pumped_volume : net volume since neutral as the calibrated pump has it, at `volume_at` [mm^3]
    volume_at : time of that [s]
    direction : 1 or -1 while the pump runs, 0 when it stands
    held_back : whether the limits stopped, or would not let start, the last pulse asked for
    """

    time: float
    seen_at: float
    bend: float
    sigma: float
    pressures: tuple[float, float]
    pumped_volume: float
    volume_at: float
    direction: int
    held_back: bool = False


@dataclass(frozen=True, slots=True)
class Wait:
    """Leave the pump as it is; note : why, for the record; pressed : the pressure limit is in the way."""

    note: str = ""
    pressed: bool = False


@dataclass(frozen=True, slots=True)
class Pulse:
    """Run the pump; direction : 1 forward, -1 reverse; duty : 0 to 1; duration : [s].

    in_place : replace a pulse that still runs, as continuous drives do; else the pump must stand
    """

    direction: int
    duty: float
    duration: float
    note: str = ""
    in_place: bool = False


@dataclass(frozen=True, slots=True)
class Stop:
    """End the running pulse now."""

    note: str = ""


@dataclass(frozen=True, slots=True)
class Finished:
    """The motion is over; settled : whether the goal was met; reason : why it ended."""

    settled: bool
    reason: str


Command = Wait | Pulse | Stop | Finished


class Controller(Protocol):
    """Decides once a frame."""

    @property
    def name(self) -> str:
        """What it is called in records."""

    def target_at(self, time: float) -> float:
        """Wanted bend angle [rad].

        time : on the rig's clock [s]
        """

    def decide(self, seen: Measurement) -> Command:
        """What to do now.

        seen : the bench at the newest frame; times never go back
        """
