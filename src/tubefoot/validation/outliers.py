"""Values that do not belong: flagged against the running median, never deleted.

Hampel's rule: a value is odd when it is further from the median of its neighbours than `ODD` robust standard
deviations of these distances. Motion does not trip it: a value on a ramp is the median of its neighbours.
"""

from __future__ import annotations

import numpy as np

from tubefoot.units import DEG, KPA
from tubefoot.validation.recording import BoolArray, FloatArray

WINDOW = 11
"""Neighbours that a value is held against, itself included."""
ODD = 8.0
ROBUST = 1.4826
"""From the median absolute deviation to a standard deviation."""
LEAST_PRESSURE = 0.5 * KPA
"""A pressure this near to its neighbours is never odd: a few steps of a 10-bit converter [MPa]."""
LEAST_ANGLE = 0.3 * DEG
"""The same for angles [rad]."""


def pressure_outliers(time: FloatArray, pressures: FloatArray) -> BoolArray:
    """Which samples are odd in either branch, or not finite, (n,).

    time : (n,) [s]
    pressures : (n, 2) [MPa]
    """
    odd = [_odd(pressures[:, side], LEAST_PRESSURE) for side in (0, 1)]
    return np.asarray(odd[0] | odd[1] | ~np.isfinite(time))


def angle_outliers(time: FloatArray, angle: FloatArray) -> BoolArray:
    """Which angles are odd, or not finite, (m,).

    time : (m,) [s]
    angle : (m,) [rad]
    """
    return np.asarray(_odd(angle, LEAST_ANGLE) | ~np.isfinite(time))


def _odd(values: FloatArray, least: float) -> BoolArray:
    """Hampel's rule; where fewer values than a window exist only what is not finite is odd."""
    lost = ~np.isfinite(values)
    if (~lost).sum() < WINDOW:
        return lost
    whole = values[~lost]
    padded = np.pad(whole, WINDOW // 2, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, WINDOW)
    middle = np.median(around, axis=1)
    spread = ROBUST * np.median(np.abs(around - middle[:, None]), axis=1)
    found = lost.copy()
    found[~lost] = np.abs(whole - middle) > np.maximum(ODD * spread, least)
    return found
