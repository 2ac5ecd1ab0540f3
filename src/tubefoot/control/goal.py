"""The goal of a step: a target, its band, and the hold during which the pump stands."""

from __future__ import annotations

from tubefoot.control.contract import Measurement
from tubefoot.control.settings import GoalSettings
from tubefoot.units import DEG


class StepGoal:
    """Keeps the time of the hold; the error at its end decides."""

    def __init__(self, target: float, settings: GoalSettings):
        """Set the goal.

        target : bend angle [rad]
        settings : band and hold
        """
        self.target = target
        self.band = settings.band_deg * DEG
        self.hold_s = settings.hold_s
        self._since: float | None = None

    @property
    def holding(self) -> bool:
        """Whether the hold has begun."""
        return self._since is not None

    def error(self, seen: Measurement) -> float:
        """Target less angle [rad].

        seen : at a frame
        """
        return self.target - seen.bend

    def within(self, seen: Measurement) -> bool:
        """Whether the angle is in the band.

        seen : at a frame
        """
        return abs(self.error(seen)) <= self.band

    def begin_hold(self, seen: Measurement) -> None:
        """Begin the hold with this frame.

        seen : its first frame
        """
        self._since = seen.seen_at

    def break_hold(self) -> None:
        """Give the hold up."""
        self._since = None

    def held(self, seen: Measurement) -> bool:
        """Whether the pump has stood for the whole hold.

        seen : at a frame
        """
        return self._since is not None and seen.seen_at - self._since >= self.hold_s - 1e-6
