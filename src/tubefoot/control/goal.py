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
        self._errors: list[float] = []

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
        self._since, self._errors = seen.seen_at, []
        self.note(seen)

    def note(self, seen: Measurement) -> None:
        """Take a frame of the hold into its mean error.

        seen : during the hold
        """
        self._errors.append(abs(self.error(seen)))

    def mean_error(self) -> float:
        """Of the hold so far [rad]."""
        return sum(self._errors) / len(self._errors)

    def break_hold(self) -> None:
        """Give the hold up."""
        self._since = None

    def since(self, seen: Measurement) -> float:
        """How long the hold has lasted [s].

        seen : at a frame
        """
        return 0.0 if self._since is None else seen.seen_at - self._since

    def held(self, seen: Measurement) -> bool:
        """Whether the pump has stood for the whole hold.

        seen : at a frame
        """
        return self._since is not None and self.since(seen) >= self.hold_s - 1e-6
