"""Our controller: pulses chosen by a model of the finger that is learnt while it moves.

A soft finger with trapped air creeps long after a pulse. So each decision looks at the angle to come, not
at the present one. A long pulse fills the chamber until the creep alone will bring the finger to the target
a little later; its duty follows the pressure that is foreseen, and it ends as soon as the model, corrected
at every frame, sees enough fluid in place. When the creep arrives, a short pulse back stops it. Of all
volumes the one is taken that leaves the smallest error (least squares) over the coming hold; the pulse is
given only when that leaves the finger within the hold's tolerance, or when it would overshoot otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.contract import Command, Finished, Measurement, Pulse, Stop, Wait
from tubefoot.control.creep import CreepLaw
from tubefoot.control.estimator import BendEstimator, Forecast
from tubefoot.control.goal import StepGoal
from tubefoot.control.settings import AdaptiveSettings, GoalSettings
from tubefoot.lab.pump import pumped_volume
from tubefoot.lab.settings import PumpSettings
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

PULSE_RISE_S = 0.25
"""From the begin of a short pulse to where its effect is seen in full [s]."""
WINDOW = 12
"""Times at which the coming hold is looked at."""
LONGEST_PULSE = 1.6
"""A pulse is asked for so many times the expected duration; the model ends it."""
REACTION_S = 0.012
"""From the decision to the standing pump [s]."""
HALF_FRAME_S = 1 / 60
SURE, GAIN = 0.8, 0.5
"""Shares of the tolerance: what a correction may leave at most, what it must gain at least."""
ROOM = 0.2
"""A long pulse begins when the pressure limit lets so much of it happen."""
LOADED = 0.6
"""Share of the pressure limit above which waiting makes room."""
LATE = 1.75
"""So much later than planned the creep may arrive before more is pumped."""
DUTY_CHANGE, WORTH_S = 0.06, 0.2
"""The duty of a running pulse is changed by no less, and not when less time is left [s]."""
DUTIES = 8
"""Duties that are tried for a long pulse."""
ROUNDS = 4
"""Of finding a pulse's volume and duration together."""


@dataclass(frozen=True)
class Correction:
    """The best pulse now: relaxed angle it is worth [rad], largest error left in the hold [rad]."""

    angle: float
    left: float


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
        law : creep of this kind of finger
        pump : as calibrated
        pressure_limit : that a long pulse shall not exceed, gauge [MPa]
        goal : band and hold
        settings : how pulses are chosen
        """
        self.estimator = BendEstimator(law)
        self.settings = settings or AdaptiveSettings()
        self._pump = pump
        self._pressure_limit = pressure_limit
        self._goal_settings = goal or GoalSettings()
        self.aim(target)

    def aim(self, target: float) -> None:
        """Take another target; what was learnt is kept.

        target : bend angle [rad]
        """
        self._goal = StepGoal(target, self._goal_settings)
        self._way = 0
        self._filling = 0.0
        self._ran_until = self._now = float("-inf")

    def target_at(self, time: float) -> float:
        """Wanted bend angle [rad], the same at every time.

        time : [s]
        """
        return self._goal.target

    def decide(self, seen: Measurement) -> Command:
        """A pulse, the end of one, patience, or the end of the motion.

        seen : the newest frame
        """
        self.estimator.observe(seen)
        ahead = self.estimator.forecast(seen)
        self._now = seen.time
        if not self._way:
            self._way = 1 if self._goal.error(seen) >= 0 else -1
        if seen.direction:
            self._ran_until = seen.time
            return self._while_filling(seen, ahead) if self._filling else Wait("pulse")
        self._filling = 0.0
        if self._goal.holding:
            return self._hold(seen, ahead)
        if seen.seen_at < self._ran_until + self.settings.rest_s:
            return Wait("learning")
        return self._next(seen, ahead)

    # ---- parts of a decision -------------------------------------------------------------------------------

    def _next(self, seen: Measurement, ahead: Forecast) -> Command:
        """With the pump standing: hold, correct, wait for the creep, or pump on."""
        settings, goal = self.settings, self._goal
        tolerance = settings.hold_error_deg * DEG
        alone = float(np.abs(goal.target - ahead.free(self._window(0.0))).max())
        if goal.within(seen) and alone <= tolerance:
            goal.begin_hold(seen)
            return Wait("hold")
        best = self._correction(ahead)
        if best.left <= SURE * tolerance and best.left <= alone - GAIN * tolerance:
            return self._trim(ahead, best.angle)
        soon = np.linspace(0.0, PULSE_RISE_S + 0.1, 4)
        if float((self._way * (ahead.free(soon) - goal.target)).max()) > settings.overshoot_deg * DEG:
            return self._trim(ahead, best.angle)
        arrival = np.linspace(0.0, LATE * settings.arrive_s, WINDOW)
        reached = float((self._way * (ahead.free(arrival) - goal.target)).max())
        if reached > -tolerance:
            return Wait("creeping")
        return self._fill(seen, ahead)

    def _hold(self, seen: Measurement, ahead: Forecast) -> Command:
        """In the hold: done, or out of the band soon."""
        goal = self._goal
        if goal.held(seen):
            if goal.within(seen):
                return Finished(True, "settled")
            goal.break_hold()
            return self._next(seen, ahead)
        if float(np.abs(goal.target - ahead.free(np.array([0.1, 0.4]))).max()) > 0.95 * goal.band:
            goal.break_hold()
            return self._next(seen, ahead)
        return Wait("hold")

    def _fill(self, seen: Measurement, ahead: Forecast) -> Command:
        """A long pulse that lets the creep arrive, as fast as the pressure limit allows."""
        settings = self.settings
        duty, angle, duration = self._fastest(ahead, settings.fill_duty_min)
        now = max(seen.pressures)
        room, needed = self._pressure_limit - now, ahead.pressure(angle, duration) - now
        if now > LOADED * self._pressure_limit and room < ROOM * needed:
            return Wait("the pressure relaxes", pressed=True)
        if duration * duty < 0.5 * settings.trim_max_s * settings.trim_duty:
            return self._trim(ahead, angle)
        self._filling = duty
        return Pulse(1 if angle > 0 else -1, duty, LONGEST_PULSE * duration, "fill")

    def _while_filling(self, seen: Measurement, ahead: Forecast) -> Command:
        """End the long pulse when enough fluid is in place; change its duty when the pressure asks for it."""
        settings = self.settings
        angle, duration = self._missing(ahead, self._filling)
        soon = ahead.free(np.linspace(0.0, 0.4, 4)) - self._goal.target
        crossed = float((seen.direction * soon).max()) > 0.0
        if angle * seen.direction <= 0 or duration <= REACTION_S + HALF_FRAME_S or crossed:
            self._filling = 0.0
            return Stop("enough fluid in place")
        loaded = max(seen.pressures) > LOADED * self._pressure_limit
        duty, _, duration = self._fastest(
            ahead, settings.running_duty_min if loaded else settings.fill_duty_min
        )
        if abs(duty - self._filling) > DUTY_CHANGE and duration > WORTH_S:
            self._filling = duty
            return Pulse(seen.direction, duty, LONGEST_PULSE * duration, "fill on", in_place=True)
        return Wait("fill")

    def _fastest(self, ahead: Forecast, least: float) -> tuple[float, float, float]:
        """The fastest long pulse under the pressure limit: duty (at least one), relaxed angle [rad], [s]."""
        duties = np.linspace(self.settings.fill_duty_max, least, DUTIES)
        for duty in duties:
            angle, duration = self._missing(ahead, float(duty))
            if ahead.pressure(angle, duration) < self._pressure_limit:
                break
        return float(duty), angle, duration

    def _trim(self, ahead: Forecast, angle: float) -> Command:
        """A short pulse worth a relaxed angle [rad]."""
        settings = self.settings
        direction = 1 if angle > 0 else -1
        flow = self._flow(direction, settings.trim_duty)
        duration = abs(angle) / ahead.gain(direction) / flow
        if duration < 2e-3:
            return Wait("correction below a pulse of 2 ms")
        duration = min(duration, settings.trim_max_s)
        self._ran_until = max(self._ran_until, self._now + duration)
        return Pulse(direction, settings.trim_duty, duration, "trim")

    def _correction(self, ahead: Forecast) -> Correction:
        """The pulse that leaves the least squared error over the coming hold."""
        coming = self._window(self.settings.trim_ahead_s)
        error = self._goal.target - ahead.free(coming)
        unit = ahead.step(coming)
        angle = float(unit @ error / (unit @ unit))
        return Correction(angle, float(np.abs(error - angle * unit).max()))

    def _missing(self, ahead: Forecast, duty: float) -> tuple[float, float]:
        """Relaxed angle still to pump so that the creep arrives in time [rad], its duration [s]."""
        duration, angle = 0.0, 0.0
        for _ in range(ROUNDS):
            at = np.array([duration + self.settings.arrive_s])
            angle = (self._goal.target - float(ahead.free(at)[0])) / float(ahead.step(at, duration)[0])
            direction = 1 if angle > 0 else -1
            duration = abs(angle) / ahead.gain(angle) / self._flow(direction, duty)
        return angle, duration

    def _window(self, delay: float) -> FloatArray:
        """Times of the hold that would begin after a delay [s]."""
        return delay + np.linspace(0.0, self._goal.hold_s, WINDOW)

    def _flow(self, direction: int, duty: float) -> float:
        """Flow at a duty, as calibrated [mm^3/s]."""
        return abs(pumped_volume(self._pump, direction, duty, 1.0)[0])
