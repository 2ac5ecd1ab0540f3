"""Which differences between benches make the offsets differ: Sobol indices over the population of benches.

First-order and total indices by Saltelli's sampling (SALib), with bootstrap confidence. They answer another
question than an attribution: not what an offset consists of, but what its scatter from bench to bench comes
from.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.relaxation import Prony
from tubefoot.twin.population import SPREADS
from tubefoot.validation.attribution import QUANTITIES, TOP, state_at
from tubefoot.validation.bench_parameters import UNKNOWNS
from tubefoot.validation.lean_bench import LeanBench

FloatArray = NDArray[np.float64]

BENCH_KEYS = {
    "scale": "finger.stiffness",
    "seam": "finger.seam_stiffening",
    "air_right_ml": "branches.air_right_ml",
    "air_left_ml": "branches.air_left_ml",
    "bubble_right_ml": "finger.bubble_right_ml",
    "bubble_left_ml": "finger.bubble_left_ml",
    "tube_kpa_s_per_ml": "branches.tube_kpa_s_per_ml",
    "leak_back_ul_per_s_kpa": "pump.leak_back_ul_per_s_kpa",
}
"""Unknowns that the population of benches draws, even in the logarithm, and its key."""
TIME_RANGE = (0.3, 3.3)
"""Relaxation times over those at 23 degC: two standard deviations of the population's temperature."""
STRENGTH_RANGE = (0.74, 1.35)
"""Relaxation over that of the material's test: two standard deviations of the prior."""
REFERENCE_UNITS = 12


def sobol_rows(
    bench: LeanBench,
    relaxation: Prony,
    samples: int = 64,
    seed: int = 0,
    top: float = TOP,
    say: Callable[[str], None] = lambda _: None,
) -> list[dict[str, Any]]:
    """Rows of sobol.csv: quantity, unknown, first-order and total index with 95 % confidence.

    bench : with the finger at scale one; relaxation : of its wall; samples : a power of two; seed : of the
        sampling; top : pressure at which offsets are taken [MPa]; say : told how many benches count

    A bench that does not reach the top pressure above vacuum is given the mean of all others.
    """
    from SALib.analyze import sobol as analyse
    from SALib.sample import sobol as sample

    names, bounds = _ranges(bench.n_units)
    problem = {"num_vars": len(names), "names": names, "bounds": np.log(bounds).tolist()}
    points = np.exp(sample.sample(problem, samples, calc_second_order=False, seed=seed))
    base = {unknown.name: unknown.outer(unknown.middle) for unknown in UNKNOWNS}
    found = np.full((len(points), len(QUANTITIES)), np.nan)
    for k, point in enumerate(points):
        values = base | dict(zip(names, map(float, point), strict=True))
        try:
            found[k] = state_at(values, bench, relaxation, top).in_units()
        except ConvergenceError:
            continue
    missing = np.isnan(found[:, 0])
    found[missing] = np.nanmean(found, axis=0)
    say(f"Sobol: {len(points) - missing.sum()} of {len(points)} benches reach the pressure")
    rows = []
    for column, quantity in enumerate(QUANTITIES):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            index = analyse.analyze(problem, found[:, column], calc_second_order=False, seed=seed)
        for k, name in enumerate(names):
            rows.append(
                {
                    "quantity": quantity,
                    "unknown": name,
                    "first_order": float(index["S1"][k]),
                    "first_order_conf": float(index["S1_conf"][k]),
                    "total": float(index["ST"][k]),
                    "total_conf": float(index["ST_conf"][k]),
                    "standard_deviation": float(found[:, column].std()),
                }
            )
    return rows


def _ranges(units: int) -> tuple[list[str], list[tuple[float, float]]]:
    """Names and bounds; bubbles of the population are those of a 12-unit finger."""
    spreads = {spread.key: spread for spread in SPREADS}
    names, bounds = [], []
    for name, key in BENCH_KEYS.items():
        share = units / REFERENCE_UNITS if name.startswith("bubble") else 1.0
        names.append(name)
        bounds.append((share * spreads[key].low, share * spreads[key].high))
    return [*names, "relaxation_time", "relaxation_strength"], [*bounds, TIME_RANGE, STRENGTH_RANGE]
