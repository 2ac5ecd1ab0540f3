"""The paper's controller: error -> bounded pulse duration, sign -> direction, +-1 deg band, 2 s hold.

After each pulse the pump stands for 0.5 s; then the newest angle decides. In the band the finger is held, and
what it shows at the end of the hold is the result; if it has crept out, pulses go on. Which duty and how many
seconds a degree the paper does not say; ours are settings.
"""

from __future__ import annotations

from tubefoot.control.contract import Command, Finished, Measurement, Pulse, Wait
from tubefoot.control.goal import StepGoal
from tubefoot.control.settings import GoalSettings, PaperSettings
from tubefoot.units import DEG


class PaperController:
    """Steps to a target by pulses in proportion to the error."""

    name = "paper"

    def __init__(
        self,
        target: float,
        goal: GoalSettings | None = None,
        settings: PaperSettings | None = None,
    ):
        """Set the target.

        target : bend angle [rad]
        goal : band and hold
        settings : of the pulses
        """
        self._goal_settings = goal or GoalSettings()
        self.settings = settings or PaperSettings()
        self.aim(target)

    def aim(self, target: float) -> None:
        """Take another target.

        target : bend angle [rad]
        """
        self._goal = StepGoal(target, self._goal_settings)
        self._stood_since: float | None = None

    def target_at(self, time: float) -> float:
        """Wanted bend angle [rad], the same at every time.

        time : [s]
        """
        return self._goal.target

    def decide(self, seen: Measurement) -> Command:
        """A pulse, a pause, or the end.

        seen : the newest frame
        """
        goal, settings = self._goal, self.settings
        if seen.direction:
            self._stood_since = None
            return Wait("pulse")
        if self._stood_since is None:
            self._stood_since = seen.time
        if goal.holding:
            if not goal.held(seen):
                return Wait("hold")
            if goal.within(seen):
                return Finished(True, "settled")
            goal.break_hold()
        elif seen.seen_at < self._stood_since + settings.settle_s:
            return Wait("settling")
        elif goal.within(seen):
            goal.begin_hold(seen)
            return Wait("hold")
        error = goal.error(seen)
        wanted = settings.seconds_per_deg * abs(error) / DEG
        duration = min(max(wanted, settings.pulse_min_s), settings.pulse_max_s)
        self._stood_since = None
        return Pulse(1 if error > 0 else -1, settings.duty, duration, "step")
