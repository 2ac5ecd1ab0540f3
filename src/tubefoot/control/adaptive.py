"""Our controller: pulses chosen by a model of the whole bench that is learnt while it moves.

A soft finger with trapped air creeps long after a pulse. So each decision looks at the angle to come, not
at the present one: `crowd.py` learns the bench from angle and pressures, `foresight.py` tells what it will
do. A long pulse (`long_pulse.py`) fills the chamber until the creep alone will lead a little past the target
soon. Then short pulses back (`short_pulses.py`) keep the finger there while the wall relaxes, and let it
down just before the hold: of all plans with up to two of them the one that gets to the hold soonest
(`hold_plan.py`), each pulse being worth some time. The plan is made anew while the finger creeps; only a
pulse that is due now is given. A hold begins once no plan is better than to hold now; early on it is given up
where it turns out that another one, later or after a pulse, is better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.contract import Command, Finished, Measurement, Pulse, Stop, Wait
from tubefoot.control.creep import CreepLaw
from tubefoot.control.crowd import Crowd
from tubefoot.control.foresight import Planned, foresee
from tubefoot.control.goal import StepGoal
from tubefoot.control.hold_plan import GRID_S, STOPPED, Bounds, HoldPlan, grid, hold_cost, soonest_hold
from tubefoot.control.long_pulse import REACTION_S, LongPulse, LongPulses
from tubefoot.control.settings import AdaptiveSettings, GoalSettings
from tubefoot.control.short_pulses import ShortPulses, short_pulses
from tubefoot.lab.settings import PumpSettings
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

WINDOW = 16
"""Times at which the coming hold is looked at."""
LONGEST_PULSE = 1.6
"""A pulse is asked for so many times the expected duration; the model ends it."""
HALF_FRAME_S = 1 / 60
LOOK_S = 0.06
"""While the finger creeps, a decision is due no sooner than that after the last."""
SHORTEST_S = 3e-3
"""Of a pulse."""
SURE, EDGE = 0.85, 0.95
"""Shares of the band: that a foreseen hold may take, beyond which a hold is broken."""
FEW = 3
"""Pulses of a motion; more must save more time."""
MISSED = 0.4
"""A plan that misses its bounds by more is none [s]."""
FAR = 0.6 * DEG
"""A finger that will stay so far before its target needs a long pulse [rad]."""
YOUNG_S, SOON_S = 1.0, 0.4
"""So soon after its begin a hold is broken for a better one; later only when it soon leaves the band [s]."""
LEAST_GAIN_S = 0.1
"""What another hold must be better by."""
STOPPED_S = 0.03
"""After a pulse the pump stands that long before a hold may begin [s]."""
ROOM = 0.2
"""A long pulse begins when the pressure limit lets so much of it happen."""
LOADED = 0.6
"""Share of the pressure limit above which waiting makes room."""
LATE = 2.4
"""So much later than planned the creep may arrive before more is pumped."""
DUTY_CHANGE, WORTH_S = 0.04, 0.2
"""The duty of a running pulse is changed by no less, and not when less time is left [s]."""


class AdaptiveController:
    """Steps to a target with few pulses."""

    name = "adaptive"

    def __init__(
        self,
        target: float,
        law: CreepLaw,
        pump: PumpSettings,
        pressure_limit: float,
        goal: GoalSettings | None = None,
        settings: AdaptiveSettings | None = None,
    ):
        """Set the target.

        target : bend angle [rad]
        law : what is known of this kind of finger
        pump : as calibrated
        pressure_limit : that a long pulse shall not exceed, gauge [MPa]
        goal : band and hold
        settings : how pulses are chosen
        """
        self.crowd = Crowd(law.model)
        self.settings = settings or AdaptiveSettings()
        self._pump = pump
        self._pressure_limit = pressure_limit
        self._long = LongPulses(law.model, pump, self.settings, pressure_limit)
        self._goal_settings = goal or GoalSettings()
        self.aim(target)

    def aim(self, target: float) -> None:
        """Take another target; what was learnt is kept.

        target : bend angle [rad]
        """
        self._goal = StepGoal(target, self._goal_settings)
        self._way = 0
        self._filling = 0.0
        self._given = 0
        self._ran_until = self._now = self._look_at = float("-inf")
        self._patience = Wait("creeping")

    def target_at(self, time: float) -> float:
        """Wanted bend angle [rad], the same at every time.

        time : on the rig's clock [s]
        """
        return self._goal.target

    def decide(self, seen: Measurement) -> Command:
        """A pulse, the end of one, patience, or the end of the motion.

        seen : the newest frame
        """
        self.crowd.observe(seen)
        self._now = seen.time
        if not self._way:
            self._way = 1 if self._goal.error(seen) >= 0 else -1
        if seen.direction:
            self._ran_until = seen.time
            return self._while_filling(seen) if self._filling else Wait("pulse")
        self._filling = 0.0
        if self._goal.holding:
            return self._hold(seen)
        return self._next(seen)

    # ---- parts of a decision -------------------------------------------------------------------------------

    def _next(self, seen: Measurement) -> Command:
        """With the pump standing: what is due, or the wait that was decided on a moment ago."""
        if seen.time < self._look_at or seen.seen_at < self._ran_until + STOPPED_S:
            return self._patience
        self._look_at = seen.time + LOOK_S
        command = self._due(seen)
        self._patience = command if isinstance(command, Wait) else Wait("learning")
        return command

    def _due(self, seen: Measurement) -> Command:
        """Hold, correct, wait for the creep, or pump on."""
        goal, settings = self._goal, self.settings
        tried, plan = self._plan(seen)
        if not plan.pulses and plan.begins <= 0.0 and goal.within(seen):
            goal.begin_hold(seen)
            return Wait("hold")
        if seen.seen_at < self._ran_until + settings.rest_s:
            return Wait("learning")
        arrival = np.linspace(0.0, LATE * settings.arrive_s, WINDOW)
        short = float((self._way * (goal.target - tried.free(arrival))).min())
        if plan.missed > MISSED and short > FAR:
            return self._fill(seen)
        if not plan.pulses or plan.first > 0.0:
            return Wait("creeping")
        if plan.pulses > 1:
            return self._trim(self._way * plan.duration)
        return self._trim(tried.best(goal.target, STOPPED * GRID_S + self._window()))

    def _plan(self, seen: Measurement) -> tuple[ShortPulses, HoldPlan]:
        """What short pulses would do, and the soonest hold that they allow."""
        goal, settings = self._goal, self.settings
        times = grid(goal.hold_s)
        present = self.crowd.present(seen)
        tried = short_pulses(self.crowd.model, present, self._pump, settings, float(times[-1]))
        answers = tried.answers(self._way, goal.target, times)
        return tried, soonest_hold(answers, settings.trim_max_s, self._bounds())

    def _bounds(self) -> Bounds:
        """What a plan should keep to now."""
        settings = self.settings
        return Bounds(
            settings.plan_error_deg * DEG,
            SURE * self._goal.band,
            settings.overshoot_deg * DEG,
            FEW - self._given,
            settings.pulse_worth_s,
            settings.further_worth_s,
            float(np.hypot(settings.trim_scatter, self.crowd.gain_spread(-self._way))),
            settings.trim_scatter,
        )

    def _hold(self, seen: Measurement) -> Command:
        """In the hold: done, or given up where that is better."""
        goal = self._goal
        if goal.held(seen):
            if goal.within(seen):
                return Finished(True, "settled")
            goal.break_hold()
            return self._next(seen)
        goal.note(seen)
        if seen.time < self._look_at:
            return Wait("hold")
        self._look_at = seen.time + LOOK_S
        if self._better_broken(seen):
            goal.break_hold()
            return self._due(seen)
        return Wait("hold")

    def _better_broken(self, seen: Measurement) -> bool:
        """Whether the finger would leave the band, or another hold, with a pulse or without, costs less."""
        goal = self._goal
        since = goal.since(seen)
        left = goal.hold_s - since
        ahead = left * np.linspace(0.0, 1.0, WINDOW)
        still = [Planned(1, 0.0, 0.0)]
        free = foresee(self.crowd.model, self.crowd.present(seen), self._pump, still, left)
        away = np.abs(free.bend_at(ahead)[0] - goal.target)
        if since >= YOUNG_S:
            return bool(away[ahead < SOON_S].max() > EDGE * goal.band)
        mean = (since * goal.mean_error() + left * float(away.mean())) / goal.hold_s
        cost = hold_cost(mean, float(max(away[0], away[-1])), self._bounds())
        if cost < self.settings.pulse_worth_s:
            return False
        return since + self._plan(seen)[1].cost + LEAST_GAIN_S < cost

    def _fill(self, seen: Measurement) -> Command:
        """A long pulse that lets the creep arrive, as fast as the pressure limit allows."""
        settings = self.settings
        fill = self._longest(seen, self._way, settings.fill_duty_min)
        now = max(seen.pressures)
        room, needed = self._pressure_limit - now, fill.peak - now
        if now > LOADED * self._pressure_limit and room < ROOM * needed:
            return Wait("the pressure relaxes", pressed=True)
        if fill.duration * fill.duty < 0.5 * settings.trim_max_s * settings.trim_duty:
            return self._trim(fill.direction * fill.duration * fill.duty / settings.trim_duty)
        self._filling = fill.duty
        self._given += 1
        return Pulse(fill.direction, fill.duty, LONGEST_PULSE * fill.duration, "fill")

    def _while_filling(self, seen: Measurement) -> Command:
        """End the long pulse when enough fluid is in place; change its duty when the pressure asks for it."""
        settings = self.settings
        loaded = max(seen.pressures) > LOADED * self._pressure_limit
        least = settings.running_duty_min if loaded else settings.fill_duty_min
        fill = self._longest(seen, seen.direction, least)
        if fill.duration * fill.duty <= (REACTION_S + HALF_FRAME_S) * self._filling:
            self._filling = 0.0
            return Stop("enough fluid in place")
        if abs(fill.duty - self._filling) > DUTY_CHANGE and fill.duration > WORTH_S:
            self._filling = fill.duty
            return Pulse(seen.direction, fill.duty, LONGEST_PULSE * fill.duration, "fill on", in_place=True)
        return Wait("fill")

    def _longest(self, seen: Measurement, direction: int, least: float) -> LongPulse:
        present = self.crowd.present(seen)
        return self._long.fastest(present, max(seen.pressures), self._goal.target, direction, least)

    def _trim(self, duration: float) -> Command:
        """A short pulse; duration : signed by its direction [s]."""
        settings = self.settings
        if abs(duration) < SHORTEST_S:
            return Wait("correction below the shortest pulse")
        lasts = min(abs(duration), settings.trim_max_s)
        self._ran_until = max(self._ran_until, self._now + lasts)
        self._given += 1
        return Pulse(1 if duration > 0 else -1, settings.trim_duty, lasts, "trim")

    def _window(self) -> FloatArray:
        """Times of a hold [s]."""
        return np.linspace(0.0, self._goal.hold_s, WINDOW)
