"""The bench's pressure sensors and the 5 V rail that motor and sensors share.

Each output is 2.5 V + 20 mV / kPa with its own zero, gain, lag and noise, clipped as such sensors do, and
scaled with the rail where the sensor is ratiometric. The rail sags while the motor runs, more at its start.
"""

from __future__ import annotations

from math import exp

import numpy as np

from tubefoot.twin.bench_settings import SensorMake
from tubefoot.units import KPA

TRANSDUCER_V_PER_KPA = 0.02
ZERO_V = 2.5
NOMINAL_V = 5.0
LOW_V, HIGH_V = 0.25, 4.75
START_S = 0.05
"""How long the motor's starting current lasts [s]."""
DRAWN_AT_ONCE = 4096


class Rail:
    """The 5 V rail; `volts` is its present voltage."""

    def __init__(self, make: SensorMake):
        """Switch it on.

        make : how far it sags
        """
        self.volts = NOMINAL_V
        self._running, self._start = make.sag_running_v, make.sag_start_v
        self._started = 0.0

    def step(self, duration: float, load: float) -> None:
        """Move on.

        duration : [s]
        load : share of the motor's full current
        """
        if load <= 0.0:
            self._started = 0.0
            self.volts = NOMINAL_V
            return
        self._started += duration
        surge = self._start * exp(-self._started / START_S) if self._started < 20 * START_S else 0.0
        self.volts = NOMINAL_V - load * (self._running + surge)


class Transducers:
    """Two pressure sensors; the same seed gives the same noise."""

    def __init__(self, make: SensorMake, noise: np.random.Generator):
        """Connect them.

        make : what they are
        noise : where their noise comes from
        """
        self._make = make
        self._slope = (
            make.gain_right * TRANSDUCER_V_PER_KPA / KPA,
            make.gain_left * TRANSDUCER_V_PER_KPA / KPA,
        )
        self._zero = (ZERO_V + make.offset_right_v, ZERO_V + make.offset_left_v)
        self._felt = (0.0, 0.0)
        self._noise = noise
        self._drawn: list[float] = []

    def step(self, duration: float, pressures: tuple[float, float]) -> None:
        """Let them follow the pressures.

        duration : [s]
        pressures : of right and left branch [MPa]
        """
        share = duration / (duration + self._make.lag_s)
        (felt_r, felt_l), (right, left) = self._felt, pressures
        self._felt = (felt_r + share * (right - felt_r), felt_l + share * (left - felt_l))

    def volts(self, rail: float) -> tuple[float, float]:
        """Their outputs [V], right and left; each call draws new noise.

        rail : its voltage [V]
        """
        if not self._drawn:
            self._drawn = (self._make.noise_v * self._noise.standard_normal(DRAWN_AT_ONCE)).tolist()
        scale = rail / NOMINAL_V if self._make.ratiometric else 1.0
        drawn, (zero_r, zero_l), (slope_r, slope_l) = self._drawn, self._zero, self._slope
        right = (zero_r + slope_r * self._felt[0] + drawn.pop()) * scale
        left = (zero_l + slope_l * self._felt[1] + drawn.pop()) * scale
        return min(max(right, LOW_V), HIGH_V), min(max(left, LOW_V), HIGH_V)
