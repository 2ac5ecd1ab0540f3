"""The soonest hold that no, one or two short pulses allow.

In the hold the pump stands and the wall relaxes on, so the angle drifts. A known bench is held soonest when
the finger is brought a little past its target at once, is kept there by a pulse back while the wall relaxes,
and is let down by a second one just before the hold, whose drift then leads through the target once more
(`benchmarks/bound_control.py`). Paths here are errors past the target over time [rad]: the foreseen path with
the pump standing, and what a second of a short pulse back or on adds to it. For the few tenths of a degree
that short pulses move, answers add up, and a later pulse is answered as one now.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

GRID_S = 0.1
"""Times at which paths are looked at [s]."""
LATEST = 30
"""A hold begins no later, in steps of the grid."""
HELD_S = 2.0
"""So much of a longer hold is looked at: the creep slows down after."""
STOPPED = 1
"""From the begin of a pulse to that of a hold, in steps of the grid."""
FIRSTS = (0, 1, 2, 4, 7, 10, 14, 18)
"""When the first of two pulses may begin, in steps of the grid."""
APART = (4, 6, 8, 11, 14, 18, 22)
"""How long after that the second may."""
SHARES = np.array([0.08, 0.14, 0.2, 0.27, 0.35, 0.45, 0.6, 0.8, 1.0])
"""Durations that are tried for the first of two, over the longest."""
FINE = 25
"""Durations either way that are tried for the only or last one."""
MEAN_COST, BAND_COST, OVERSHOOT_COST = 20.0, 10.0, 20.0
"""What a foreseen miss counts [s/deg]: of the mean error, at the ends of the hold, of the overshoot."""


class Bounds(NamedTuple):
    """What a plan should keep to.

    mean, error : mean and largest error in the hold; overshoot : before it [rad]
    cheap : how many pulses count `pulse_s`; more count `further_s` [s]
    """

    mean: float
    error: float
    overshoot: float
    cheap: int
    pulse_s: float
    further_s: float

    def pulses_cost(self, pulses: int) -> float:
        """What some pulses count [s]; pulses : how many."""
        cheap = min(pulses, max(self.cheap, 0))
        return self.pulse_s * cheap + self.further_s * (pulses - cheap)


@dataclass(frozen=True)
class HoldPlan:
    """The best plan found.

    begins : when the hold does [s]; pulses : before it
    first, duration : when the first pulse is due, and how long it lasts, negative back [s]
    missed : what it misses of the bounds, as a cost [s]
    """

    begins: float
    pulses: int
    first: float
    duration: float
    missed: float


class Answers(NamedTuple):
    """Paths on the grid [rad]: free, and by a second of a pulse back and on [rad/s]."""

    free: FloatArray
    back: FloatArray
    on: FloatArray

    def to(self, durations: FloatArray) -> FloatArray:
        """What pulses add to a path, (n, times) [rad].

        durations : (n,) negative back [s]
        """
        times = durations[:, None]
        return np.asarray(np.where(times < 0, -self.back, self.on) * times, dtype=np.float64)


def grid(hold_s: float) -> FloatArray:
    """Times of the paths [s].

    hold_s : of the hold [s]
    """
    return np.asarray(GRID_S * np.arange(LATEST + 1 + round(min(hold_s, HELD_S) / GRID_S)), dtype=float)


def soonest_hold(answers: Answers, longest: float, bounds: Bounds) -> HoldPlan:
    """The plan that costs least: time to the hold, pulses, what it misses.

    answers : on `grid`
    longest : pulse [s]
    bounds : that a plan should keep
    """
    fine = longest * np.linspace(-1.0, 1.0, 2 * FINE + 1)
    rough = longest * np.concatenate([-SHARES[::-1], SHARES])
    last, first = answers.to(fine), answers.to(rough)
    held = len(answers.free) - LATEST
    free = answers.free[None]
    found = []
    for begin in range(LATEST + 1):
        over = free[:, : begin + 1].max(axis=1)
        missed = float(_missed(free[:, begin : begin + held], over, bounds)[0])
        found.append(HoldPlan(GRID_S * begin, 0, np.inf, 0.0, missed))
    for start in range(LATEST + 1 - STOPPED):
        costs, best = _ended(free, start, last, held, bounds)
        begins = GRID_S * (start + STOPPED)
        found.append(HoldPlan(begins, 1, GRID_S * start, float(fine[best[0]]), float(costs[0])))
    for start in FIRSTS:
        paths = np.repeat(free, len(rough), axis=0)
        paths[:, start:] += first[:, : paths.shape[1] - start]
        for second in (start + apart for apart in APART if start + apart + STOPPED <= LATEST):
            costs, _ = _ended(paths, second, last, held, bounds)
            best_first = int(costs.argmin())
            begins, duration = GRID_S * (second + STOPPED), float(rough[best_first])
            found.append(HoldPlan(begins, 2, GRID_S * start, duration, float(costs[best_first])))
    return min(found, key=lambda plan: plan.begins + bounds.pulses_cost(plan.pulses) + plan.missed)


def _ended(
    paths: FloatArray, start: int, added: FloatArray, held: int, bounds: Bounds
) -> tuple[FloatArray, NDArray[np.intp]]:
    """Of each path (n, times), the least cost of a hold after a last pulse, and which pulse that is.

    start : of the pulse, in steps; added : (m, times) by each pulse; held : steps of the hold
    """
    begin = start + STOPPED
    windows = paths[:, None, begin : begin + held] + added[None, :, STOPPED : STOPPED + held]
    over = np.maximum(paths[:, : start + 1].max(axis=1)[:, None], windows[:, :, 0])
    costs = _missed(windows, over, bounds)
    best = costs.argmin(axis=1)
    return costs[np.arange(len(paths)), best], best


def _missed(windows: FloatArray, over: FloatArray, bounds: Bounds) -> FloatArray:
    """What holds (..., times) and the most before them (...) miss of the bounds [s]."""
    away = np.abs(windows)
    mean = np.maximum(away.mean(axis=-1) - bounds.mean, 0.0)
    ends = np.maximum(np.maximum(away[..., 0], away[..., -1]) - bounds.error, 0.0)
    beyond = np.maximum(over - bounds.overshoot, 0.0)
    return np.asarray((MEAN_COST * mean + BAND_COST * ends + OVERSHOOT_COST * beyond) / DEG)
