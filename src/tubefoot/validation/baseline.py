"""The baseline: zero from the rest before the first pulse, as in the paper dP(t) = P(t) - P(0), and drift.

A sensor that drifts is told from a wall that creeps only while nothing was pumped yet; a line through the
first and the last rest takes off both, and is right only where the finger was given time to come back.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.validation.recording import BoolArray, FloatArray, RawSeries, RecordedPulse, Rest

DriftLine = Literal["none", "rest", "ends"]

LEAST_REST_S = 0.3
"""Shortest rest before the first pulse that a baseline is taken from [s]."""
LEAST_SAMPLES = 5
BEFORE_PULSE_S = 0.05
"""Kept clear before the first pulse, whose start may be known only so well [s]."""
LEAST_LINE_S = 3.0
"""Shortest rest that a drift line is taken from [s]."""
LAST_REST_S = 1.0
"""Length of the last rest [s]."""


def rest_of(
    raw: RawSeries, pulses: Sequence[RecordedPulse], wild: BoolArray, drift: DriftLine
) -> tuple[Rest, FloatArray]:
    """The baseline and the line to subtract, (n, 2) [MPa].

    raw : the series, times on the source's clock
    pulses : on a clock that is zero at the first sample
    wild : (n,) samples to be passed over
    drift : none, that of the first rest, or from the first rest to the last

    Raises ConfigError when the recording begins with the pump running, or a rest is too short for the line.
    """
    time = raw.time - raw.time[0]
    until = pulses[0].start - BEFORE_PULSE_S
    quiet = (time <= until) & ~wild
    if until < LEAST_REST_S or quiet.sum() < LEAST_SAMPLES:
        raise ConfigError(
            f"the first pulse begins {pulses[0].start:.2f} s after the first sample: a baseline needs "
            f"{LEAST_REST_S:g} s of rest and {LEAST_SAMPLES} samples; record some seconds before pumping"
        )
    offsets = np.median(raw.pressures[quiet], axis=0)
    scatter = raw.pressures[quiet].std(axis=0, ddof=1)
    slope, slope_sigma = _slope(time[quiet], raw.pressures[quiet])
    if drift == "rest" and until < LEAST_LINE_S:
        raise ConfigError(
            f"drift = rest needs {LEAST_LINE_S:g} s before the first pulse, here are {until:.1f} s; "
            "use drift = none or ends"
        )
    middle = 0.5 * until
    taken = np.zeros(2)
    if drift == "rest":
        taken = slope
    elif drift == "ends":
        at, last = _last_rest(time, raw.pressures, pulses, wild)
        taken = (last - offsets) / (at - middle)
    line = offsets + np.outer(time - middle, taken)
    angle, angle_scatter = _angle_rest(raw, until)
    rest = Rest(
        (float(offsets[0]), float(offsets[1])),
        (float(taken[0]), float(taken[1])),
        (float(slope_sigma[0]), float(slope_sigma[1])),
        angle,
        (float(scatter[0]), float(scatter[1]), angle_scatter),
    )
    return rest, line


def _slope(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes of the least-squares lines of the columns and their standard errors."""
    about = time - time.mean()
    spread = float(about @ about)
    if spread <= 0:
        return np.zeros(2), np.full(2, np.inf)
    slope = about @ values / spread
    left = values - values.mean(axis=0) - np.outer(about, slope)
    return slope, np.sqrt((left**2).sum(axis=0) / max(len(time) - 2, 1) / spread)


def _last_rest(
    time: FloatArray, pressures: FloatArray, pulses: Sequence[RecordedPulse], wild: BoolArray
) -> tuple[float, FloatArray]:
    """Mean time [s] and median pressures [MPa] of the rest at the recording's end."""
    last = (time >= max(pulses[-1].end, time[-1] - LAST_REST_S)) & ~wild
    if last.sum() < LEAST_SAMPLES:
        raise ConfigError(
            f"drift = ends needs {LEAST_SAMPLES} samples of rest in the last {LAST_REST_S:g} s, here are "
            f"{last.sum()}; use drift = none or rest"
        )
    return float(time[last].mean()), np.asarray(np.median(pressures[last], axis=0))


def _angle_rest(raw: RawSeries, until: float) -> tuple[float, float]:
    """Median angle before the first pulse and its scatter [rad]; zero and nan where none was seen."""
    early = raw.angle[(raw.angle_time - raw.time[0] <= until) & np.isfinite(raw.angle)]
    if len(early) == 0:
        return 0.0, float("nan")
    return float(np.median(early)), float(early.std(ddof=1)) if len(early) > 1 else float("nan")
