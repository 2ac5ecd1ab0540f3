"""Our controller: pulses chosen by a model of the whole bench that is learnt while it moves.

A soft finger with trapped air creeps long after a pulse. So each decision looks at the angle to come, not
at the present one: `crowd.py` learns the bench from angle and pressures, `foresight.py` tells what it will
do. A long pulse fills the chamber until the creep alone will bring the finger to the target a little later;
its duty follows the pressure that is foreseen, and it ends as soon as enough fluid is in place. When the
creep arrives, a short pulse back stops it: of all short pulses the one whose path over the coming hold strays
least from the target. It is given only when that leaves the finger within the hold's tolerance, or when it
would overshoot otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.contract import Command, Finished, Measurement, Pulse, Stop, Wait
from tubefoot.control.creep import CreepLaw
from tubefoot.control.crowd import Crowd
from tubefoot.control.foresight import Paths, Planned, foresee
from tubefoot.control.goal import StepGoal
from tubefoot.control.settings import AdaptiveSettings, GoalSettings
from tubefoot.lab.settings import PumpSettings
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

WINDOW = 16
"""Times at which the coming hold is looked at."""
LONGEST_PULSE = 1.6
"""A pulse is asked for so many times the expected duration; the model ends it."""
REACTION_S = 0.012
"""From the decision to the standing pump [s]."""
HALF_FRAME_S = 1 / 60
LOOK_S = 0.06
"""While the finger creeps, a decision is due no sooner than that after the last."""
SHORTEST_S = 3e-3
"""Of a pulse."""
SURE, GAIN = 0.9, 0.4
"""Shares of the tolerance: what a correction may leave at most, what it must gain at least."""
ROOM = 0.2
"""A long pulse begins when the pressure limit lets so much of it happen."""
LOADED = 0.6
"""Share of the pressure limit above which waiting makes room."""
LATE = 1.6
"""So much later than planned the creep may arrive before more is pumped."""
DUTY_CHANGE, WORTH_S = 0.06, 0.2
"""The duty of a running pulse is changed by no less, and not when less time is left [s]."""
TRIM_SHARES = np.array([0.06, 0.15, 0.3, 0.6, 1.0])
"""Short pulses that are tried either way, over the longest."""
TRIED = 121
"""Short pulses between them."""
DELAYS_S = (0.4, 0.7, 1.0, 1.3, 1.6, 2.0)
"""Times after a pulse back at which a hold may begin."""
WAITS_S = (0.3, 0.6, 0.9, 1.2)
"""Times after which a hold that needs no pulse is waited for."""
NEAR_S = 1.2
"""How long the finger shall stay near the target after a pulse back where no hold can follow yet."""
FILLS_S = np.array([REACTION_S, 0.08, 0.2, 0.4, 0.8, 1.6])
"""Long pulses that are tried."""
DUTIES = 5
"""Duties that are tried for a long pulse."""


@dataclass(frozen=True)
class Fill:
    """A long pulse: direction, duty, duration [s], highest pressure that it will make [MPa]."""

    direction: int
    duty: float
    duration: float
    peak: float


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
        self._goal_settings = goal or GoalSettings()
        self.aim(target)

    def aim(self, target: float) -> None:
        """Take another target; what was learnt is kept.

        target : bend angle [rad]
        """
        self._goal = StepGoal(target, self._goal_settings)
        self._way = 0
        self._filling = 0.0
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
        if seen.seen_at < self._ran_until + self.settings.rest_s:
            return Wait("learning")
        return self._next(seen)

    # ---- parts of a decision -------------------------------------------------------------------------------

    def _next(self, seen: Measurement) -> Command:
        """With the pump standing: what is due, or the wait that was decided on a moment ago."""
        if seen.time < self._look_at:
            return self._patience
        self._look_at = seen.time + LOOK_S
        command = self._due(seen)
        self._patience = command if isinstance(command, Wait) else Wait("creeping")
        return command

    def _due(self, seen: Measurement) -> Command:
        """Hold, correct, wait for the creep, or pump on."""
        settings, goal = self.settings, self._goal
        tolerance = settings.hold_error_deg * DEG
        trims, paths = self._trims(seen)
        free = Paths(paths.bends[:1], paths.pressures[:1])
        alone = self._astray(free.bend_at(self._window(0.0)))[0]
        if goal.within(seen) and alone <= tolerance:
            goal.begin_hold(seen)
            return Wait("hold")
        if self._soon_held(free, tolerance):
            return Wait("creeping")
        duration, left = self._best(trims, paths, settings.trim_ahead_s)
        if left <= SURE * tolerance and left <= alone - GAIN * tolerance:
            return self._trim(duration)
        soon = np.linspace(0.0, settings.trim_ahead_s, 6)
        if self._beyond(free.bend_at(soon)) > settings.overshoot_deg * DEG:
            return self._trim(self._turned_back(trims, paths, tolerance))
        arrival = np.linspace(0.0, LATE * settings.arrive_s, WINDOW)
        if self._beyond(free.bend_at(arrival)) > -tolerance:
            return Wait("creeping")
        return self._fill(seen)

    def _hold(self, seen: Measurement) -> Command:
        """In the hold: done, or out of the band soon."""
        goal = self._goal
        if goal.held(seen):
            if goal.within(seen):
                return Finished(True, "settled")
            goal.break_hold()
            return self._next(seen)
        free = self._foresee(seen, [Planned(1, 0.0, 0.0)], 0.4)
        if self._astray(free.bend_at(np.array([0.1, 0.4])))[0] > 0.95 * goal.band:
            goal.break_hold()
            return self._next(seen)
        return Wait("hold")

    def _fill(self, seen: Measurement) -> Command:
        """A long pulse that lets the creep arrive, as fast as the pressure limit allows."""
        settings = self.settings
        fill = self._fastest(seen, self._way, settings.fill_duty_min)
        now = max(seen.pressures)
        room, needed = self._pressure_limit - now, fill.peak - now
        if now > LOADED * self._pressure_limit and room < ROOM * needed:
            return Wait("the pressure relaxes", pressed=True)
        if fill.duration * fill.duty < 0.5 * settings.trim_max_s * settings.trim_duty:
            return self._trim(fill.direction * fill.duration * fill.duty / settings.trim_duty)
        self._filling = fill.duty
        return Pulse(fill.direction, fill.duty, LONGEST_PULSE * fill.duration, "fill")

    def _while_filling(self, seen: Measurement) -> Command:
        """End the long pulse when enough fluid is in place; change its duty when the pressure asks for it."""
        settings = self.settings
        loaded = max(seen.pressures) > LOADED * self._pressure_limit
        least = settings.running_duty_min if loaded else settings.fill_duty_min
        fill = self._fastest(seen, seen.direction, least)
        if fill.duration * fill.duty <= (REACTION_S + HALF_FRAME_S) * self._filling:
            self._filling = 0.0
            return Stop("enough fluid in place")
        if abs(fill.duty - self._filling) > DUTY_CHANGE and fill.duration > WORTH_S:
            self._filling = fill.duty
            return Pulse(seen.direction, fill.duty, LONGEST_PULSE * fill.duration, "fill on", in_place=True)
        return Wait("fill")

    def _fastest(self, seen: Measurement, direction: int, least: float) -> Fill:
        """The fastest long pulse under the pressure limit."""
        settings = self.settings
        duties = np.linspace(settings.fill_duty_max, least, DUTIES)
        plans = [Planned(direction, float(duty), float(last)) for duty in duties for last in FILLS_S]
        paths = self._foresee(seen, plans, FILLS_S[-1] + settings.arrive_s)
        ahead = np.linspace(0.0, settings.arrive_s, 8)
        for number in range(DUTIES):
            rows = slice(number * len(FILLS_S), (number + 1) * len(FILLS_S))
            mine = Paths(paths.bends[rows], paths.pressures[rows])
            reached = [
                float((direction * mine.bend_at(last + ahead)[k]).max()) for k, last in enumerate(FILLS_S)
            ]
            missing = direction * self._goal.target - np.array(reached) + settings.arrive_deg * DEG
            duration = float(np.interp(0.0, -missing, FILLS_S))
            peak = float(np.interp(duration, FILLS_S, mine.pressures.max(axis=1)))
            if peak < self._pressure_limit:
                break
        return Fill(direction, float(duties[number]), duration, peak)

    def _trim(self, duration: float) -> Command:
        """A short pulse; duration : signed by its direction [s]."""
        settings = self.settings
        if abs(duration) < SHORTEST_S:
            return Wait("correction below the shortest pulse")
        lasts = min(abs(duration), settings.trim_max_s)
        self._ran_until = max(self._ran_until, self._now + lasts)
        return Pulse(1 if duration > 0 else -1, settings.trim_duty, lasts, "trim")

    def _trims(self, seen: Measurement) -> tuple[FloatArray, Paths]:
        """Short pulses that are tried, the first none at all, signed [s], and what comes of them."""
        settings = self.settings
        shares = settings.trim_max_s * TRIM_SHARES
        trims = np.concatenate([[0.0], shares, -shares])
        plans = [Planned(1 if trim >= 0 else -1, settings.trim_duty, abs(trim)) for trim in trims]
        return trims, self._foresee(seen, plans, self._window(DELAYS_S[-1])[-1])

    def _best(
        self, trims: FloatArray, paths: Paths, delay: float, lasts: float | None = None
    ) -> tuple[float, float]:
        """The short pulse that strays least in the hold after a delay: duration [s], largest error [rad].

        lasts : of the time that counts, the hold's if None [s]
        """
        order = np.argsort(trims)
        bends = paths.bend_at(self._window(delay, lasts))[order]
        tried = np.linspace(trims.min(), trims.max(), TRIED)
        found = np.array([np.interp(tried, trims[order], column) for column in bends.T]).T
        astray = self._astray(found)
        best = int(astray.argmin())
        return float(tried[best]), float(astray[best])

    def _turned_back(self, trims: FloatArray, paths: Paths, tolerance: float) -> float:
        """The short pulse against an overshoot, signed [s]: a hold is to follow as soon as it can be.

        Where none can yet, it keeps the finger near, so that it goes on relaxing.
        """
        for delay in DELAYS_S:
            duration, left = self._best(trims, paths, delay)
            if left <= SURE * tolerance:
                return duration
        return self._best(trims, paths, DELAYS_S[0], NEAR_S)[0]

    def _soon_held(self, free: Paths, tolerance: float) -> bool:
        """Whether the creep alone leads to a hold soon."""
        return any(self._astray(free.bend_at(self._window(delay)))[0] <= tolerance for delay in WAITS_S)

    def _foresee(self, seen: Measurement, plans: list[Planned], horizon: float) -> Paths:
        return foresee(self.crowd.model, self.crowd.present(seen), self._pump, plans, horizon)

    def _astray(self, bends: FloatArray) -> FloatArray:
        """Largest error of each path [rad]; bends : (paths, times)."""
        return np.asarray(np.abs(self._goal.target - bends).max(axis=1))

    def _beyond(self, bends: FloatArray) -> float:
        """How far a path passes the target [rad]; bends : (1, times)."""
        return float((self._way * (bends - self._goal.target)).max())

    def _window(self, delay: float, lasts: float | None = None) -> FloatArray:
        """Times of the hold that would begin after a delay [s]."""
        return delay + np.linspace(0.0, self._goal.hold_s if lasts is None else lasts, WINDOW)
