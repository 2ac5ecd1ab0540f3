"""Faults on a schedule: what may go wrong on a bench, when, and for how long.

Each fault does to the virtual bench what it would do to a real one; nothing tells the host but its sensors,
its camera and its board.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, Protocol

from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.lab.settings import BRANCHES
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.transducers import NOMINAL_V
from tubefoot.units import KPA

Kind = Literal[
    "camera_lost",
    "marker_hidden",
    "sensor_open",
    "sensor_shorted",
    "sensor_stuck",
    "board_reset",
    "line_lost",
    "bubble_burst",
    "leak",
    "tube_blocked",
]
SIGHT = ("camera_lost", "marker_hidden")
OPEN_V = 0.0
"""An open input is pulled to ground by its 100 kOhm."""
BLOCKED = 1e6
"""Factor on the resistance of a blocked tube."""


class BenchFault(Settings):
    """One fault."""

    kind: Kind
    """what goes wrong"""
    at_s: float = Field(ge=0)
    """when, on the bench's clock"""
    lasts_s: float = Field(default=1e9, gt=0)
    """how long; for good if not given; a reset and a burst happen at once"""
    side: Literal["right", "left"] = "right"
    """branch or sensor concerned"""
    amount: float = Field(default=1.0, gt=0, le=1000)
    """leak: ul/s for each kPa; burst: share of the bubble; stuck sensor: volts; else unused"""

    @model_validator(mode="after")
    def _fits_its_kind(self) -> BenchFault:
        if self.kind == "bubble_burst" and self.amount > 1:
            raise ValueError(f"bubble_burst: amount = {self.amount:g} is a share of the bubble, 1 at most")
        if self.kind == "sensor_stuck" and self.amount > NOMINAL_V:
            raise ValueError(f"sensor_stuck: amount = {self.amount:g} V is above the supply, {NOMINAL_V:g} V")
        return self

    def active(self, time: float) -> bool:
        """Whether it is there.

        time : on the bench's clock [s]
        """
        return self.at_s <= time < self.at_s + self.lasts_s


class Wiring(Protocol):
    """What a fault may do to the board and its cable."""

    def press_reset(self) -> None:
        """Reset the board in the next step."""

    def unplug(self, out: bool) -> None:
        """Pull the cable, or put it back.

        out : whether it is pulled
        """


class FaultSchedule:
    """Applies faults when their time comes, and takes them away again."""

    def __init__(self, faults: Sequence[BenchFault], plant: BenchPlant, wiring: Wiring):
        """Plan them.

        faults : in any order
        plant : that suffers
        wiring : of its board
        """
        self._faults = tuple(faults)
        self._plant = plant
        self._wiring = wiring
        events: list[tuple[float, Callable[[], None]]] = []
        for fault in self._faults:
            if fault.kind not in SIGHT:
                start, end = self._effects(fault)
                events += [(fault.at_s, start), (fault.at_s + fault.lasts_s, end)]
        self._events = sorted(events, key=lambda event: event[0])

    def apply(self, time: float) -> None:
        """Do what is due.

        time : on the bench's clock [s]
        """
        while self._events and self._events[0][0] <= time:
            self._events.pop(0)[1]()

    def blind(self, time: float) -> bool:
        """Whether the camera is lost.

        time : on the bench's clock [s]
        """
        return any(fault.kind == "camera_lost" and fault.active(time) for fault in self._faults)

    def hidden(self, time: float) -> bool:
        """Whether the tip marker is covered.

        time : on the bench's clock [s]
        """
        return any(fault.kind == "marker_hidden" and fault.active(time) for fault in self._faults)

    def _effects(self, fault: BenchFault) -> tuple[Callable[[], None], Callable[[], None]]:
        """What the fault does at its start and at its end."""
        channel = BRANCHES.index(fault.side)
        side, overrides = self._plant.hydraulics.sides[channel], self._plant.overrides
        free = side.resistance
        volts = {"sensor_open": OPEN_V, "sensor_shorted": NOMINAL_V, "sensor_stuck": fault.amount}

        def nothing() -> None:
            """Some faults have no end."""

        match fault.kind:
            case "board_reset":
                return self._wiring.press_reset, nothing
            case "line_lost":
                return lambda: self._wiring.unplug(True), lambda: self._wiring.unplug(False)
            case "bubble_burst":
                return lambda: self._plant.hydraulics.burst(channel, fault.amount), nothing
            case "leak":
                return (
                    lambda: setattr(side, "leak", fault.amount / KPA),
                    lambda: setattr(side, "leak", 0.0),
                )
            case "tube_blocked":
                return (
                    lambda: setattr(side, "resistance", free * BLOCKED),
                    lambda: setattr(side, "resistance", free),
                )
        return (
            lambda: overrides.__setitem__(channel, volts[fault.kind]),
            lambda: overrides.__delitem__(channel),
        )
