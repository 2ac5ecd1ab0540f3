"""What the loop watches, whoever decides: pressure limits, and whether the bench answers the pump.

The board keeps its own limits and latches a fault; the guard stops a little before, so that a motion can go
on when the wall has relaxed. Pressures here are gauge pressures of the branches, right and left [MPa].
"""

from __future__ import annotations

from tubefoot.control.contract import Measurement
from tubefoot.control.settings import GuardSettings
from tubefoot.lab.messages import Fault
from tubefoot.lab.rig import RigLimits
from tubefoot.units import DEG, KPA, ML

SIDES = ("right", "left")
PRESSURE_FAULTS = Fault.OVER_PRESSURE | Fault.UNDER_PRESSURE
CLEARED_MAX = 10
"""Pressure faults that one motion, or one grasp, may clear after waiting for the wall to relax."""
RELAXING_S, RELAXING_FRAMES = 0.5, 6
"""How long the pump must have stood, and in how many frames: a few samples may be the same by chance."""
TURN_SEEN = 0.5 * DEG
"""Change of the bend angle that counts as an answer [rad]."""


class PressureGuard:
    """Keeps a margin to the rig's pressure limits."""

    def __init__(self, limits: RigLimits, settings: GuardSettings):
        """Take the limits.

        limits : of the rig; settings : margins
        """
        self._low, self._high = limits.pressure_low, limits.pressure_high
        self._margin = settings.margin_kpa * KPA
        self._relax = settings.relax_kpa * KPA

    def ends_pulse(self, direction: int, pressures: tuple[float, float]) -> bool:
        """Whether a running pulse must end.

        direction : of the pulse; pressures : gauge, right and left [MPa]
        """
        return self._room(direction, pressures) < self._margin

    def forbids_pulse(self, direction: int, pressures: tuple[float, float]) -> bool:
        """Whether a pulse must wait until the wall has relaxed.

        direction : of the pulse; pressures : gauge, right and left [MPa]
        """
        return self._room(direction, pressures) < self._margin + self._relax

    def describe(self, pressures: tuple[float, float]) -> str:
        """The branch that is nearest to its limit, for a reason.

        pressures : gauge, right and left [MPa]
        """
        rooms = []
        for side, pressure in zip(SIDES, pressures, strict=True):
            rooms += [(self._high - pressure, side, pressure, self._high)]
            rooms += [(pressure - self._low, side, pressure, self._low)]
        _, side, pressure, limit = min(rooms)
        return f"{side} branch at {pressure / KPA:.1f} kPa, limit {limit / KPA:.0f} kPa"

    def _room(self, direction: int, pressures: tuple[float, float]) -> float:
        """Pressure left before the limit that this direction drives at [MPa]."""
        pressed, sucked = pressures if direction > 0 else pressures[::-1]
        return min(self._high - pressed, sucked - self._low)


class AnswerCheck:
    """Whether pressures and angle answer to what is pumped; else the pump would run blind."""

    def __init__(self, settings: GuardSettings):
        """Begin without a reference.

        settings : how much volume must show how much
        """
        self._settings = settings
        self._from: Measurement | None = None
        self._low = self._high = (0.0, 0.0)
        self._frames = 0

    def fault(self, seen: Measurement) -> str:
        """What is wrong, empty while nothing is.

        seen : the newest frame
        """
        start = self._from
        if start is None or seen.direction != start.direction:
            self._begin(seen)
            return ""
        self._low = (min(self._low[0], seen.pressures[0]), min(self._low[1], seen.pressures[1]))
        self._high = (max(self._high[0], seen.pressures[0]), max(self._high[1], seen.pressures[1]))
        ranges = [high - low for high, low in zip(self._high, self._low, strict=True)]
        self._frames += 1
        if not seen.direction:
            long = seen.time - start.time > RELAXING_S and self._frames >= RELAXING_FRAMES
            return self._relaxed(ranges) if long else ""
        volume = abs(seen.pumped_volume - start.pumped_volume)
        if volume < self._settings.still_ml * ML:
            return ""
        turned = abs(seen.bend - start.bend)
        self._begin(seen)
        return self._judged(volume, ranges, turned)

    def _begin(self, seen: Measurement) -> None:
        self._from, self._frames = seen, 1
        self._low = self._high = seen.pressures

    def _relaxed(self, ranges: list[float]) -> str:
        """The fault that ranges of pressure [MPa] with the pump standing tell of: only one branch relaxes.

        While the pump runs, the supply sags, and with it what a stuck output seems to say.
        """
        for side, mine, other in zip(SIDES, ranges, ranges[::-1], strict=True):
            if mine < self._settings.stuck_kpa * KPA and other > self._settings.relaxing_kpa * KPA:
                return (
                    f"the {side} pressure stays the same while the other relaxes by {other / KPA:.1f} kPa: "
                    "its sensor is stuck; check it"
                )
        return ""

    def _judged(self, volume: float, ranges: list[float], turned: float) -> str:
        """The fault that a pumped volume [mm^3], ranges of pressure [MPa] and a turn [rad] tell of."""
        pumped = f"{volume / ML:.2f} ml pumped"
        for side, mine in zip(SIDES, ranges, strict=True):
            if mine < self._settings.stuck_kpa * KPA:
                return f"{pumped}, but the {side} pressure reads the same: its sensor is stuck; check it"
        if max(ranges) < self._settings.still_kpa * KPA and turned < TURN_SEEN:
            return (
                f"{pumped}, but neither pressure nor angle moved: pump stalled, tube off or fluid lost; "
                "look at the tubes and prime the loop"
            )
        return ""
