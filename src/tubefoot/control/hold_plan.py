"""The soonest hold that no, one or two short pulses allow.

In the hold the pump stands and the wall relaxes on, so the angle drifts. A known bench is held soonest when
the finger is brought a little past its target at once, is kept there by a pulse back while the wall relaxes,
and is let down by a second one just before the hold, whose drift then leads through the target once more
(`benchmarks/bound_control.py`). Paths here are errors past the target over time [rad]: the foreseen path with
the pump standing, and what a second of a short pulse back or on adds to it. For the few tenths of a degree
that short pulses move, answers add up, and a later pulse is answered as one now. What a pulse moves is known
to some per cent only: what a plan misses is its mean over that scatter, so a smaller last pulse is preferred.
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
FIRSTS = (0, 1, 2, 4, 7, 10, 14)
"""When the first of two pulses may begin, in steps of the grid."""
APART = (4, 5, 6, 7, 8, 10, 12, 15, 18, 22)
"""How long after that the second may."""
SHARES = np.array([0.06, 0.1, 0.14, 0.18, 0.22, 0.27, 0.32, 0.37, 0.43, 0.5, 0.6, 0.7, 0.85, 1.0])
"""Durations that are tried for the first of two, over the longest."""
SPREAD = 1.5**0.5
"""Three values so many standard deviations apart have the mean and the scatter of a normal spread."""
MEAN_COST, BAND_COST, OVERSHOOT_COST = 20.0, 10.0, 20.0
"""What a foreseen miss counts [s/deg]: of the mean error, at the ends of the hold, of the overshoot."""


class Bounds(NamedTuple):
    """What a plan should keep to.

    mean, error : mean and largest error in the hold; overshoot : before it [rad]
    cheap : how many pulses count `pulse_s`; more count `further_s` [s]
    scatter : of what a pulse moves, relative; known_scatter : the same once one that way was seen
    """

    mean: float
    error: float
    overshoot: float
    cheap: int
    pulse_s: float
    further_s: float
    scatter: float = 0.0
    known_scatter: float = 0.0

    def pulses_cost(self, pulses: int) -> float:
        """What some pulses count [s]; pulses : how many."""
        cheap = min(pulses, max(self.cheap, 0))
        return self.pulse_s * cheap + self.further_s * (pulses - cheap)


@dataclass(frozen=True)
class HoldPlan:
    """The best plan found.

    begins : when the hold does [s]; pulses : before it
    first, duration : when the first pulse is due, and how long it lasts, negative back [s]
    missed : what is expected to be missed of the bounds, as a cost; cost : that, time and pulses [s]
    """

    begins: float
    pulses: int
    first: float
    duration: float
    missed: float
    cost: float


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
    durations = longest * np.concatenate([-SHARES[::-1], SHARES])
    firsts = answers.to(durations)
    held = len(answers.free) - LATEST
    free = answers.free[None]
    found = []

    def note(begin: int, pulses: int, first: float, duration: float, missed: float) -> None:
        cost = GRID_S * begin + bounds.pulses_cost(pulses) + missed
        found.append(HoldPlan(GRID_S * begin, pulses, GRID_S * first, duration, missed, cost))

    for begin in range(LATEST + 1):
        over = free[:, : begin + 1].max(axis=1)
        note(begin, 0, np.inf, 0.0, float(_missed(free[:, begin : begin + held], over, bounds)[0]))
    for start in range(LATEST + 1 - STOPPED):
        costs, lasts = _ended(free, start, answers, longest, bounds, bounds.scatter)
        note(start + STOPPED, 1, start, float(lasts[0]), float(costs[0]))
    for start in FIRSTS:
        paths = np.repeat(free, len(firsts), axis=0)
        paths[:, start:] += firsts[:, : paths.shape[1] - start]
        for second in (start + apart for apart in APART if start + apart + STOPPED <= LATEST):
            costs, _ = _ended(paths, second, answers, longest, bounds, bounds.known_scatter)
            best = int(costs.argmin())
            note(second + STOPPED, 2, start, float(durations[best]), float(costs[best]))
    return min(found, key=lambda plan: plan.cost)


def _ended(
    paths: FloatArray, start: int, answers: Answers, longest: float, bounds: Bounds, scatter: float
) -> tuple[FloatArray, FloatArray]:
    """Of each path (n, times), the expected cost of a hold after a last pulse, and its duration [s].

    start : of the pulse, in steps; longest : pulse [s]; scatter : of what it moves, relative

    The pulse is the one with the least mean square of the errors in the hold.
    """
    held = paths.shape[1] - LATEST
    begin, answered = start + STOPPED, slice(STOPPED, STOPPED + held)
    errors = paths[:, begin : begin + held]
    back, on = (
        np.clip(-(errors @ shape) / (shape @ shape), 0.0, longest)
        for shape in (answers.back[answered], answers.on[answered])
    )
    durations = np.where(back > 0.0, -back, on)
    moved = 1.0 + SPREAD * scatter * np.array([-1.0, 0.0, 1.0])
    windows = errors[:, None] + moved[:, None] * answers.to(durations)[:, None, answered]
    before = paths[:, : start + 1].max(axis=1)[:, None]
    over = np.maximum(before, windows[:, :, 0])
    return _missed(windows, over, bounds).mean(axis=1), durations


def hold_cost(mean: float, ends: float, bounds: Bounds) -> float:
    """What a hold misses, as a cost [s].

    mean : of its error; ends : the larger one at its ends [rad]; bounds : that it should keep
    """
    return float(_misses(np.array(mean), np.array(ends), bounds))


def _misses(mean: FloatArray, ends: FloatArray, bounds: Bounds) -> FloatArray:
    """What is missed in holds [s]."""
    beyond_mean, beyond_ends = np.maximum(mean - bounds.mean, 0.0), np.maximum(ends - bounds.error, 0.0)
    return np.asarray((MEAN_COST * beyond_mean + BAND_COST * beyond_ends) / DEG)


def _missed(windows: FloatArray, over: FloatArray, bounds: Bounds) -> FloatArray:
    """What holds (..., times) and the most before them (...) miss of the bounds [s]."""
    away = np.abs(windows)
    ends = np.maximum(away[..., 0], away[..., -1])
    beyond = np.maximum(over - bounds.overshoot, 0.0)
    return _misses(away.mean(axis=-1), ends, bounds) + OVERSHOOT_COST / DEG * beyond
