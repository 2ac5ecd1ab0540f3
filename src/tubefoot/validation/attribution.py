"""How much each cause explains of the offsets between a finger on a bench and the ideal finger.

Both are pumped up in pulses by the lean bench and read half a second after each, as the paper does. The
offsets are those of claim C9: angle and suction pressure at one pressure of the right branch, less those of
the ideal finger (no seam, elastic wall of nominal stiffness, no air, no losses; of the same weight, tilted
alike). A cause counts by what it
changes when it is switched on first (alone), when it is switched off last (all others on), and by the mean
over all orders (Shapley): these shares add up to the whole offset.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from math import factorial

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.relaxation import DECADES_PER_K, NO_RELAXATION, Prony
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.units import DEG, KPA, ML
from tubefoot.validation.bench_parameters import UNKNOWNS, bench_numbers
from tubefoot.validation.lean_bench import LeanBench

CAUSES: dict[str, dict[str, float]] = {
    "print's stiffness": {"scale": 1.0},
    "seam": {"seam": 0.0},
    "relaxation": {"relaxation_strength": 0.0, "fast_loss_s": 0.0},
    "air columns": {"air_right_ml": 0.0, "air_left_ml": 0.0},
    "bubbles": {"bubble_right_ml": 0.0, "bubble_left_ml": 0.0},
    "losses": {"tube_kpa_s_per_ml": 0.01, "leak_back_ul_per_s_kpa": 0.0},
}
"""The values that switch a cause off: those of the ideal finger."""
QUANTITIES = ("bend_deg", "pressure_left_kpa")
TOP = 30.0 * KPA
"""Pressure of the right branch at which offsets are taken [MPa]."""
FIRST_PULSE_ML, PULSE_S, SETTLE_S, PAUSE_S = 0.02, 0.12, 0.5, 1.0
"""Volume of a pulse for each unit, its length, the reading's delay, the time to the next pulse."""
MOST_PULSES = 256


@dataclass(frozen=True)
class Offset:
    """Angle [rad] and left pressure [MPa] at the top pressure."""

    bend: float
    left: float

    def in_units(self) -> tuple[float, float]:
        """In the units of QUANTITIES."""
        return self.bend / DEG, self.left / KPA


@dataclass(frozen=True)
class Attribution:
    """Shares of the offsets.

    top : pressure of the right branch [MPa]; ideal, real : at the top, in the units of QUANTITIES
    first, last, shapley : by quantity, by cause, in the same units
    """

    top: float
    ideal: tuple[float, float]
    real: tuple[float, float]
    first: Mapping[str, Mapping[str, float]]
    last: Mapping[str, Mapping[str, float]]
    shapley: Mapping[str, Mapping[str, float]]

    def offset(self, quantity: str) -> float:
        """The whole offset, real less ideal.

        quantity : one of QUANTITIES
        """
        at = QUANTITIES.index(quantity)
        return self.real[at] - self.ideal[at]

    def main_cause(self, quantity: str) -> str:
        """The cause with the largest Shapley share that points the way of the whole offset.

        quantity : one of QUANTITIES
        """
        way = np.sign(self.offset(quantity))
        return max(self.shapley[quantity], key=lambda cause: way * self.shapley[quantity][cause])

    def rows(self) -> list[dict[str, float | str]]:
        """Rows of attribution.csv."""
        return [
            {
                "quantity": quantity,
                "cause": cause,
                "first": self.first[quantity][cause],
                "last": self.last[quantity][cause],
                "shapley": self.shapley[quantity][cause],
                "share": self.shapley[quantity][cause] / (self.offset(quantity) or np.inf),
            }
            for quantity in QUANTITIES
            for cause in CAUSES
        ]


def attribute(
    values: Mapping[str, float],
    bench: LeanBench,
    relaxation: Prony,
    top: float = TOP,
    settle: float = SETTLE_S,
) -> Attribution:
    """What each cause does to angle and suction pressure.

    values : of all unknowns, fitted (`BenchFit.values`) or known (`values_of`)
    bench : with the finger at scale one; relaxation : of its wall at 23 degC
    top : pressure of the right branch [MPa]
    settle : from the end of a pulse to its reading, half a second in the paper [s]

    Raises ConvergenceError when the top pressure is not reached above absolute vacuum.
    """
    names = tuple(CAUSES)
    met: dict[frozenset[str], np.ndarray] = {}
    for size in range(len(names) + 1):
        for active in combinations(names, size):
            off = {
                key: value for cause in names if cause not in active for key, value in CAUSES[cause].items()
            }
            state = state_at({**values, **off}, bench, relaxation, top, settle)
            met[frozenset(active)] = np.array(state.in_units())
    none, every = met[frozenset()], met[frozenset(names)]

    def by_quantity(of: Mapping[str, np.ndarray]) -> dict[str, dict[str, float]]:
        return {q: {cause: float(of[cause][k]) for cause in names} for k, q in enumerate(QUANTITIES)}

    return Attribution(
        top,
        (float(none[0]), float(none[1])),
        (float(every[0]), float(every[1])),
        by_quantity({cause: met[frozenset([cause])] - none for cause in names}),
        by_quantity({cause: every - met[frozenset(names) - {cause}] for cause in names}),
        by_quantity({cause: _shapley(met, names, cause) for cause in names}),
    )


def _shapley(met: Mapping[frozenset[str], np.ndarray], names: tuple[str, ...], cause: str) -> np.ndarray:
    """Mean of what a cause adds over all orders in which causes may be switched on."""
    others, n = [name for name in names if name != cause], len(names)
    total = np.zeros(2)
    for size in range(n):
        weight = factorial(size) * factorial(n - 1 - size) / factorial(n)
        for active in combinations(others, size):
            total += weight * (met[frozenset([*active, cause])] - met[frozenset(active)])
    return total


def state_at(
    values: Mapping[str, float],
    bench: LeanBench,
    relaxation: Prony,
    top: float,
    settle: float = SETTLE_S,
) -> Offset:
    """Angle and left pressure when the right branch, read after each pulse, passes a pressure on its way up.

    values : of all unknowns; bench : with the finger; relaxation : of its wall; top : that pressure [MPa]
    settle : from the end of a pulse to its reading, half a second in the paper [s]

    Raises ConvergenceError when it is not reached.
    """
    numbers = bench_numbers(values, relaxation if values["relaxation_strength"] > 0 else NO_RELAXATION)
    waits = np.diff(np.geomspace(0.3, settle, 2 + int(np.log2(settle / 0.3))))
    steps = np.array([PULSE_S / 2, PULSE_S / 2, 0.05, 0.1, 0.15, *waits, PAUSE_S - SETTLE_S])
    volume = FIRST_PULSE_ML * ML * bench.n_units
    pushed = np.zeros(len(steps))
    pushed[:2] = volume / 2
    count = 8
    while count <= MOST_PULSES:
        try:
            course = bench.simulate(np.tile(steps, count), np.tile(pushed, count), numbers)
        except ConvergenceError:
            if count <= 8 and volume < 1e-3 * ML:
                raise
            volume, pushed, count = 0.5 * volume, 0.5 * pushed, 8
            continue
        at = (np.arange(count) + 1) * len(steps) - 1
        right = np.concatenate([[0.0], course.branch[at, 0]])
        if right.max() >= top:
            k = int(np.argmax(right >= top))
            share = (top - right[k - 1]) / (right[k] - right[k - 1])
            bend, left = (np.concatenate([[0.0], of[at]]) for of in (course.bend, course.branch[:, 1]))
            return Offset(
                float(bend[k - 1] + share * (bend[k] - bend[k - 1])),
                float(left[k - 1] + share * (left[k] - left[k - 1])),
            )
        count *= 2
    raise ConvergenceError(
        f"{count // 2} pulses of {volume / ML:.3g} ml bring the right branch to {right.max() / KPA:.1f} kPa "
        f"only, not to {top / KPA:.1f} kPa"
    )


def values_of(make: BenchSettings, duty: float = 0.35) -> dict[str, float]:
    """The unknowns' values of a virtual bench, for tests and for judging a fit.

    make : what it is made of; duty : of the campaign's pulses as the board tells it, of 255

    The board's timer makes (n + 1) / 256 of n / 255.
    """
    values = {unknown.name: unknown.outer(unknown.middle) for unknown in UNKNOWNS}
    climate, pump = make.climate, make.pump
    warmer = 1.0 + climate.stiffness_per_k * climate.start_k
    worn, given = 1.0 - pump.wear, (255.0 * duty + 1.0) / 256.0
    values |= {
        "scale": make.finger.stiffness * warmer,
        "seam": make.finger.seam_stiffening / warmer,
        "air_right_ml": make.branches.air_right_ml,
        "air_left_ml": make.branches.air_left_ml,
        "bubble_right_ml": make.finger.bubble_right_ml,
        "bubble_left_ml": make.finger.bubble_left_ml,
        "tube_kpa_s_per_ml": make.branches.tube_kpa_s_per_ml,
        "leak_back_ul_per_s_kpa": pump.leak_back_ul_per_s_kpa,
        "relaxation_strength": 1.0 if make.finger.creep else 0.0,
        "relaxation_time": 10.0 ** (-DECADES_PER_K * climate.start_k),
        "pump_lag_s": pump.lag_s,
    }
    for way, full, dead in (
        ("forward", pump.flow_forward_ml_per_s, pump.dead_duty_forward),
        ("reverse", pump.flow_reverse_ml_per_s, pump.dead_duty_reverse),
    ):
        values[f"flow_{way}_ml_per_s"] = full * worn * (given - dead) / (1.0 - dead)
    return values
