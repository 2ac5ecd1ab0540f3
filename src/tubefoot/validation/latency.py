"""How late the angles' stamps are: the shift at which the pressures explain the angle's rate best.

The wall creeps, so the angle follows the pressures late even on a perfect clock: the plain correlation of
the two rates is off by some 50 ms. Here the rate of the angle is explained by the rate of p_R - p_L and by
what is left of it after several memories (exponential filters), each also times the pressure; the shift is
the one with the largest multiple correlation. A short memory and a late stamp look alike: two sets of
memories are taken, their mean is the estimate, and half their difference goes into its standard error beside
the scatter between stretches of the recording (delete-one jackknife).
"""

from __future__ import annotations

import math

import numpy as np

from tubefoot.validation.pulses import GRID_S, pressure_rate, smoothed
from tubefoot.validation.recording import NO_LATENCY, BenchRecord, FloatArray, Latency

LARGEST_S = 1.0
"""Largest shift that is looked for, either way [s]."""
MEMORIES_S = ((0.3, 1.5, 8.0), (0.1, 0.5, 2.5, 12.0))
"""Time constants of the filters [s]: two sets that span what walls remember."""
LEAST_ANGLES = 40
LEAST_CORRELATION, LEAST_SIGMAS = 0.5, 2.0
"""With a lower correlation, or a shift of fewer standard errors, the angles' times stay as they are."""
STRETCHES = 8
"""Parts of the recording for the jackknife."""


def estimate_latency(record: BenchRecord) -> Latency:
    """The latency of a recording's angles; nan where there are too few angles or no motion.

    record : with times as the source has them
    """
    seen = np.isfinite(record.angle) & ~record.angle_outlier
    if seen.sum() < LEAST_ANGLES:
        return NO_LATENCY
    grid, rate = pressure_rate(record.time, record.pressures, record.pressure_outlier)
    own_grid, bend = smoothed(record.angle_time[seen], record.angle[seen])
    if len(own_grid) < 2 or len(grid) < 8 * LARGEST_S / GRID_S:
        return NO_LATENCY
    # The pressures' grid begins anywhere; the angles are put on the same one.
    turn = np.interp(grid, own_grid, np.gradient(bend, GRID_S), left=0.0, right=0.0)
    good = ~record.pressure_outlier
    right, left = record.pressures[good].T
    difference = np.interp(grid, record.time[good], right - left)
    found = [_best_shift(_explaining(rate, difference, memories), turn) for memories in MEMORIES_S]
    shifts, scatter, heights = np.array(found).T
    if not np.isfinite(shifts).all():
        return NO_LATENCY
    sigma = math.hypot(float(scatter.mean()), 0.5 * abs(float(shifts[0] - shifts[1])))
    return Latency(float(shifts.mean()) * GRID_S, sigma * GRID_S, float(heights.max()), False)


def _explaining(rate: FloatArray, difference: FloatArray, memories: tuple[float, ...]) -> FloatArray:
    """What explains the angle's rate, scaled, (n, 2 (1 + memories))."""
    from scipy.signal import lfilter

    kept = [math.exp(-GRID_S / memory) for memory in memories]
    columns = [rate, *(lfilter([1.0 - share], [1.0, -share], rate) for share in kept)]
    linear = np.column_stack(columns)
    level = np.abs(difference) / max(float(np.abs(difference).max()), 1e-12)
    both = np.hstack([linear, linear * level[:, None]])
    return both / np.maximum(np.sqrt((both**2).mean(axis=0)), 1e-300)


def _best_shift(explaining: FloatArray, turn: FloatArray) -> tuple[float, float, float]:
    """Shift in steps of the grid, its jackknife error, the multiple correlation; nan without one."""
    most = round(LARGEST_S / GRID_S)
    shifts = np.arange(-most, most + 1)
    parts = np.array_split(np.arange(most, len(turn) - most), STRETCHES)
    among = np.array([explaining[part].T @ explaining[part] for part in parts])
    with_turn = np.array([[explaining[part].T @ turn[part + s] for part in parts] for s in shifts])
    of_turn = np.array([[turn[part + s] @ turn[part + s] for part in parts] for s in shifts])
    best, height = _top(_explained(among.sum(axis=0), with_turn.sum(axis=1), of_turn.sum(axis=1)))
    left_out = [np.delete(np.arange(STRETCHES), part) for part in range(STRETCHES)]
    without = np.array(
        [
            _top(
                _explained(
                    among[kept].sum(axis=0), with_turn[:, kept].sum(axis=1), of_turn[:, kept].sum(axis=1)
                )
            )[0]
            for kept in left_out
        ]
    )
    without = without[np.isfinite(without)]
    if len(without) < STRETCHES:
        return float("nan"), float("nan"), 0.0
    spread = (STRETCHES - 1) / STRETCHES * ((without - without.mean()) ** 2).sum()
    return best, float(np.sqrt(spread)), math.sqrt(max(height, 0.0))


def _explained(among: FloatArray, with_turn: FloatArray, of_turn: FloatArray) -> FloatArray:
    """Share of the turn's square that is explained at each shift, (shifts,)."""
    ridge = 1e-9 * np.trace(among) / len(among) * np.eye(len(among))
    weights = np.linalg.solve(among + ridge, with_turn.T)
    return np.asarray((with_turn * weights.T).sum(axis=1) / np.maximum(of_turn, 1e-300))


def _top(curve: FloatArray) -> tuple[float, float]:
    """Shift in steps of the grid and height of the highest point, between grid points by a parabola."""
    at = int(np.argmax(curve))
    if curve[at] <= 0 or at in (0, len(curve) - 1):
        return float("nan"), 0.0
    below, top, above = curve[at - 1 : at + 2]
    bend = below - 2 * top + above
    offset = 0.5 * (below - above) / bend if bend < 0 else 0.0
    return at + float(offset) - (len(curve) - 1) / 2, float(top - 0.25 * (below - above) * offset)
