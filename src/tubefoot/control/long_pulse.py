"""The long pulse that brings the finger near its target: how long still, and at which duty.

It lasts until the creep alone leads past the target by some tenths of a degree soon after its end. The duty
is the largest whose pressure stays below the limit for the next moment: while the pump runs it is chosen anew
at each frame, so the pressure rises to the limit at full flow and then follows it, as the wall relaxes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import BenchModel
from tubefoot.control.foresight import EDGES_S, Paths, Planned, foresee
from tubefoot.control.settings import AdaptiveSettings
from tubefoot.lab.settings import PumpSettings

FloatArray = NDArray[np.float64]

REACTION_S = 0.012
"""From the decision to the standing pump [s]."""
LASTS_S = np.array([REACTION_S, 0.08, 0.2, 0.4, 0.8, 1.6])
"""Durations that are tried."""
DUTIES = 5
"""Duties that are tried."""
RIDE_S = 0.3
"""How far ahead the pressure counts: the duty can be changed before [s]."""
LOOKS = 8
"""Times after the end at which the angle counts."""


@dataclass(frozen=True)
class LongPulse:
    """Direction, duty, duration from now on [s], highest pressure that it will make soon [MPa]."""

    direction: int
    duty: float
    duration: float
    peak: float


class LongPulses:
    """Chooses them for one bench."""

    def __init__(
        self, model: BenchModel, pump: PumpSettings, settings: AdaptiveSettings, pressure_limit: float
    ):
        """Take the bench.

        model : of the finger; pump : as calibrated; settings : how pulses are chosen
        pressure_limit : gauge [MPa]
        """
        self._model, self._pump, self._settings = model, pump, settings
        self._pressure_limit = pressure_limit

    def fastest(
        self, present: FloatArray, pressed: float, target: float, direction: int, least: float
    ) -> LongPulse:
        """The fastest long pulse under the pressure limit.

        present : (rows, 1) state; pressed : larger pressure as measured, gauge [MPa]
        target : bend angle [rad]; direction : 1 or -1; least : duty
        """
        settings = self._settings
        duties = np.linspace(settings.fill_duty_max, least, DUTIES)
        plans = [Planned(direction, float(duty), float(last)) for duty in duties for last in LASTS_S]
        paths = foresee(self._model, present, self._pump, plans, LASTS_S[-1] + settings.arrive_s)
        limit = self._pressure_limit - (pressed - float(paths.pressures[0, 0]))
        durations, peaks = np.empty(DUTIES), np.empty(DUTIES)
        for number in range(DUTIES):
            rows = slice(number * len(LASTS_S), (number + 1) * len(LASTS_S))
            mine = Paths(paths.bends[rows], paths.pressures[rows])
            durations[number], peaks[number] = self._needed(mine, target, direction)
        duty = float(np.interp(limit, peaks[::-1], duties[::-1]))
        last, peak = (float(np.interp(duty, duties[::-1], some[::-1])) for some in (durations, peaks))
        return LongPulse(direction, duty, last, peak)

    def _needed(self, paths: Paths, target: float, direction: int) -> tuple[float, float]:
        """Of all durations at one duty: the one that is needed [s], its pressure soon [MPa]."""
        ahead = np.linspace(0.0, self._settings.arrive_s, LOOKS)
        reached = [
            float((direction * paths.bend_at(last + ahead)[k]).max()) for k, last in enumerate(LASTS_S)
        ]
        missing = direction * target - np.array(reached) + np.radians(self._settings.arrive_deg)
        duration = float(np.interp(0.0, -missing, LASTS_S))
        soon = int(np.searchsorted(EDGES_S, RIDE_S, side="right"))
        return duration, float(np.interp(duration, LASTS_S, paths.pressures[:, :soon].max(axis=1)))
