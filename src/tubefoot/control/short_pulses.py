"""Short pulses either way from the present bench, and what would come of each.

Some durations are tried with the model; what lies between them is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import BenchModel
from tubefoot.control.foresight import Paths, Planned, foresee
from tubefoot.control.hold_plan import Answers
from tubefoot.control.settings import AdaptiveSettings
from tubefoot.lab.settings import PumpSettings

FloatArray = NDArray[np.float64]

SHARES = np.array([0.06, 0.15, 0.3, 0.6, 1.0])
"""Short pulses that are tried either way, over the longest."""
UNIT = 2
"""Which of them stands for the answer to a second of a short pulse."""
BETWEEN = 121
"""Durations that are compared by interpolation."""


@dataclass(frozen=True)
class ShortPulses:
    """What was tried.

    durations : signed by the direction, the first one 0: no pulse (n,) [s]; paths : of each, from now on
    """

    durations: FloatArray
    paths: Paths

    def free(self, times: FloatArray) -> FloatArray:
        """Bend angles with the pump standing, (times,) [rad].

        times : from now on [s]
        """
        return np.asarray(self.paths.bend_at(times)[0])

    def answers(self, way: int, target: float, times: FloatArray) -> Answers:
        """Errors past the target, and how they answer to pulses.

        way : 1 or -1, to the target; target : bend angle [rad]; times : of the paths [s]
        """
        past = way * (self.paths.bend_at(times) - target)
        onward, back = (1 + UNIT, 1 + len(SHARES) + UNIT)[::way]
        by_onward, by_back = ((past[row] - past[0]) / abs(self.durations[row]) for row in (onward, back))
        return Answers(past[0], by_back, by_onward)

    def best(self, target: float, times: FloatArray) -> float:
        """The pulse with the least mean error at some times, signed [s].

        target : bend angle [rad]; times : from now on [s]
        """
        order = np.argsort(self.durations)
        known, bends = self.durations[order], self.paths.bend_at(times)[order]
        between = np.linspace(known[0], known[-1], BETWEEN)
        found = np.array([np.interp(between, known, column) for column in bends.T]).T
        return float(between[int(np.abs(target - found).mean(axis=1).argmin())])


def short_pulses(
    model: BenchModel, present: FloatArray, pump: PumpSettings, settings: AdaptiveSettings, horizon: float
) -> ShortPulses:
    """Try short pulses.

    model : of the finger; present : (rows, 1) state; pump : as calibrated
    settings : duty and longest duration; horizon : how far to look [s]
    """
    lasts = settings.trim_max_s * SHARES
    durations = np.concatenate([[0.0], lasts, -lasts])
    plans = [Planned(1 if last >= 0 else -1, settings.trim_duty, abs(last)) for last in durations]
    return ShortPulses(durations, foresee(model, present, pump, plans, horizon))
