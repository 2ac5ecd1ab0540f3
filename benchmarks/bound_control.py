"""The least time to a hold that a few pulses allow on a bench that is fully known: a random search.

`python -m benchmarks.bound_control` (some minutes). What bounds it is the wall: in the hold of 2 s the pump
stands, and the creep goes on. Volumes and times of all pulses are drawn, kept near the best, and drawn again;
the model is the controller's own (`control/bench_model.py`), with nothing to learn, no latency, no scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import FORWARD, GASES, REVERSE, STIFFNESS, BenchModel
from tubefoot.control.crowd import MIDDLES
from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG, KPA, ML

FloatArray = NDArray[np.float64]

TARGET_DEG, HOLD_S, OVERSHOOT_DEG, LIMIT_KPA = 30.0, 2.0, 0.9, 83.0
FLOW_ML_PER_S = 1.1
STEP_S, LAST_S = 0.04, 7.0
DRAWN, KEPT, ROUNDS = 240, 24, 8
STARTS = 3
"""Searches that begin anew; the best of them counts, and the least may still be less."""
VOLUME_ML, PAUSE_S, TRIM_ML = (0.4, 2.5), (0.1, 2.5), (-0.25, 0.15)
"""Ranges of the first volume, of the pauses, and of the further volumes."""


@dataclass(frozen=True)
class Bench:
    """A known bench: stiffness of the print, gas of each side [ml]."""

    stiffness: float
    gas_ml: float


def least_time(bench: Bench, pulses: int, tolerance_deg: float, mean_deg: float, seed: int = 0) -> float:
    """Time from the start to the end of the hold [s], a penalty for what is missed in it."""
    chance = np.random.default_rng(seed)
    low = np.array([VOLUME_ML[0], *(PAUSE_S[0], TRIM_ML[0]) * (pulses - 1)])
    high = np.array([VOLUME_ML[1], *(PAUSE_S[1], TRIM_ML[1]) * (pulses - 1)])
    drawn = low + (high - low) * chance.random((3 * DRAWN, len(low)))
    for _ in range(ROUNDS):
        costs = _times(bench, drawn, pulses, tolerance_deg, mean_deg)
        best = drawn[np.argsort(costs)[:KEPT]]
        spread = 0.7 * best.std(axis=0) + 1e-3 * (high - low)
        least = float(costs.min())
        drawn = np.clip(best[0] + spread * chance.standard_normal((DRAWN, len(low))), low, high)
        drawn[0] = best[0]
    return least


def _times(bench: Bench, drawn: FloatArray, pulses: int, tolerance_deg: float, mean_deg: float) -> FloatArray:
    """Of each row of drawn volumes and pauses, the time to the end of its hold [s]."""
    bends, pressures, ended = _paths(bench, drawn, pulses)
    over = np.maximum(bends.max(axis=0) - TARGET_DEG - OVERSHOOT_DEG, 0.0)
    pressed = np.maximum(pressures.max(axis=0) - LIMIT_KPA, 0.0)
    width = round(HOLD_S / STEP_S) + 1
    windows = np.lib.stride_tricks.sliding_window_view(np.abs(bends - TARGET_DEG), width, axis=0)
    missed = 3.0 * np.maximum(windows.max(axis=-1) - tolerance_deg, 0.0)
    missed += 6.0 * np.maximum(windows.mean(axis=-1) - mean_deg, 0.0)
    begins = STEP_S * (1.0 + np.arange(len(windows)))[:, None]
    missed[begins < ended + 0.1] = np.inf
    return np.asarray((begins + missed).min(axis=0) + HOLD_S + 3.0 * over + 0.2 * pressed)


def _paths(bench: Bench, drawn: FloatArray, pulses: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bend [deg] and highest pressure [kPa] (steps, rows), and when the last pulse ended [s]."""
    reference = reference_file()
    model = BenchModel(reference.to_finger(), reference.to_prony())
    guess = MIDDLES.copy()
    guess[STIFFNESS], guess[GASES] = np.log(bench.stiffness), np.log(bench.gas_ml * ML)
    guess[FORWARD] = guess[REVERSE] = 0.0
    state = model.at_rest(np.repeat(guess[:, None], len(drawn), axis=1))
    begins, lasts, ways = (np.zeros((len(drawn), pulses)) for _ in range(3))
    for number in range(pulses):
        volume = drawn[:, 0] if not number else drawn[:, 2 * number]
        lasts[:, number], ways[:, number] = np.abs(volume) / FLOW_ML_PER_S, np.sign(volume)
        if number:
            begins[:, number] = begins[:, number - 1] + lasts[:, number - 1] + drawn[:, 2 * number - 1]
    bends, pressures, pumped = [], [], np.zeros(len(drawn))
    for step in range(1, round(LAST_S / STEP_S) + 1):
        now = (np.clip(step * STEP_S - begins, 0.0, lasts) * ways).sum(axis=1) * FLOW_ML_PER_S * ML
        state = model.step(state, STEP_S, now - pumped)
        pumped = now
        bends.append(model.bend(state) / DEG)
        pressures.append(model.branch_pressures(state).max(axis=0) / KPA)
    return np.array(bends), np.array(pressures), begins[:, -1] + lasts[:, -1]


if __name__ == "__main__":
    for known in (Bench(0.5, 0.7), Bench(1.0, 1.1), Bench(1.0, 0.5), Bench(1.7, 1.1)):
        for tolerance, mean in ((0.6, 0.3), (0.9, 0.45)):
            found = {
                count: round(
                    min(least_time(known, count, tolerance, mean, seed) for seed in range(STARTS)), 2
                )
                for count in (2, 3, 4)
            }
            print(known, f"within {tolerance:g} deg:", found, flush=True)
