"""A population of benches: what differs from print to print and from bench to bench, and by how much.

One table says how each number is distributed and why. A seed draws a whole bench; seeds for tuning and for
the verdict are fixed and do not overlap. Numbers that are not in the table are those of the nominal bench.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tubefoot.config import parse_settings
from tubefoot.twin.bench_settings import BenchSettings

VERDICT_SEEDS = tuple(range(1, 201))
"""The 200 benches by which controllers are judged; never look at them while tuning."""
TUNING_SEEDS = tuple(range(1001, 1101))
"""Another 100, for tuning."""
_STREAM = 20_240


@dataclass(frozen=True)
class Spread:
    """How one number of a bench varies.

    key : dotted name in `BenchSettings`
    kind : even between low and high, even in the logarithm, or normal and cut at low and high
    low, high : bounds
    middle, sigma : of a normal spread
    why : source or reason
    """

    key: str
    kind: Literal["even", "log", "normal"]
    low: float
    high: float
    why: str
    middle: float = 0.0
    sigma: float = 0.0

    def draw(self, chance: np.random.Generator) -> float:
        """One value.

        chance : where it comes from; each spread takes exactly one number
        """
        if self.kind == "even":
            return float(chance.uniform(self.low, self.high))
        if self.kind == "log":
            return float(np.exp(chance.uniform(np.log(self.low), np.log(self.high))))
        return float(np.clip(self.middle + self.sigma * chance.standard_normal(), self.low, self.high))


SPREADS = (
    Spread("finger.stiffness", "log", 0.4, 1.7, "long-term moduli of printed Agilus30 in the literature"),
    Spread("finger.seam_stiffening", "log", 0.02, 0.3, "full-thickness film of 10 N/mm: -15 % angle"),
    Spread("finger.bubble_right_ml", "log", 0.02, 1.0, "air left after filling, 0 to 1 ml plausible"),
    Spread("finger.bubble_left_ml", "log", 0.02, 1.0, "the same"),
    Spread("branches.air_right_ml", "log", 0.2, 2.0, "air columns of 0.2 to 2 ml plausible"),
    Spread("branches.air_left_ml", "log", 0.2, 2.0, "the same"),
    Spread("branches.tube_kpa_s_per_ml", "log", 1.0, 5.0, "bore 2.5 to 3.5 mm, length 0.3 to 1 m about 1.9"),
    Spread("pump.flow_forward_ml_per_s", "even", 1.05, 1.5, "1.5 at most by the maker, less by supply"),
    Spread("pump.flow_reverse_ml_per_s", "even", 1.05, 1.5, "drawn apart: rollers are not symmetric"),
    Spread("pump.dead_duty_forward", "even", 0.08, 0.25, "bridge drops 1.5 to 2.5 of 12 V, friction"),
    Spread("pump.dead_duty_reverse", "even", 0.08, 0.25, "the same"),
    Spread("pump.stiction_duty", "even", 0.0, 0.08, "friction at rest above that in motion; assumed"),
    Spread("pump.lag_s", "even", 0.03, 0.09, "small geared motor; assumed"),
    Spread("pump.ripple", "even", 0.2, 0.5, "three rollers, about 0.35"),
    Spread("pump.wear", "even", 0.0, 0.15, "users recalibrate monthly"),
    Spread("pump.wear_per_l", "even", 0.0, 0.02, "the same, during a run"),
    Spread("pump.leak_back_ul_per_s_kpa", "log", 0.002, 0.05, "a standing pump holds for minutes; assumed"),
    Spread("sensors.offset_right_v", "normal", -0.05, 0.05, "0.25 % of full scale, and a year", 0.0, 0.015),
    Spread("sensors.offset_left_v", "normal", -0.05, 0.05, "the same", 0.0, 0.015),
    Spread("sensors.gain_right", "normal", 0.97, 1.03, "the same", 1.0, 0.01),
    Spread("sensors.gain_left", "normal", 0.97, 1.03, "the same", 1.0, 0.01),
    Spread("sensors.noise_v", "log", 0.002, 0.01, "about one count of 4.9 mV"),
    Spread("sensors.sag_running_v", "even", 0.02, 0.2, "motor and board on one supply"),
    Spread("camera.latency_ms", "even", 40.0, 70.0, "USB webcams at 30 frames/s"),
    Spread("camera.jitter_ms", "even", 2.0, 8.0, "about 5"),
    Spread("camera.drop_share", "even", 0.005, 0.025, "1 to 2 %"),
    Spread("camera.exposure_ms", "even", 5.0, 15.0, "room light"),
    Spread("camera.angle_sigma_deg", "log", 0.012, 0.05, "docs/verification.md: 40 px plain to 30 px spoilt"),
    Spread("camera.angle_offset_deg", "normal", -0.1, 0.1, "zero taken from a few frames", 0.0, 0.03),
    Spread("camera.angle_gain", "normal", 0.99, 1.01, "plane known to some tenths of a degree", 1.0, 0.003),
    Spread("climate.start_k", "normal", -5.0, 5.0, "laboratories are at 18 to 28 degC", 0.0, 2.0),
    Spread("climate.drift_k_per_h", "normal", -4.0, 4.0, "a room that warms up", 0.0, 1.5),
    Spread("climate.swing_k", "even", 0.0, 0.5, "air conditioning"),
    Spread("climate.swing_period_s", "log", 300.0, 1800.0, "the same"),
)
"""How the benches differ."""


def drawn_bench(seed: int) -> BenchSettings:
    """The bench of a seed; the same for ever.

    seed : of the population; see VERDICT_SEEDS and TUNING_SEEDS
    """
    tables: dict[str, dict[str, Any]] = {}
    for spread, value in zip(SPREADS, drawn_values(seed), strict=True):
        table, key = spread.key.split(".")
        tables.setdefault(table, {})[key] = value
    return parse_settings(tables, BenchSettings, source=f"bench of seed {seed}")


def drawn_values(seed: int) -> list[float]:
    """The numbers of a bench in the order of SPREADS, six significant digits.

    seed : of the population
    """
    chance = np.random.default_rng([_STREAM, seed])
    return [float(f"{spread.draw(chance):.6g}") for spread in SPREADS]


def population_table(seeds: Iterable[int]) -> list[dict[str, float]]:
    """One row a bench, columns as in SPREADS: the record to keep beside a verdict.

    seeds : of the benches
    """
    return [
        {"seed": seed, **dict(zip((spread.key for spread in SPREADS), drawn_values(seed), strict=True))}
        for seed in seeds
    ]


def spread_table() -> list[dict[str, Any]]:
    """The table of distributions, one row a number, for the record."""
    return [
        {
            "key": spread.key,
            "kind": spread.kind,
            "low": spread.low,
            "high": spread.high,
            "middle": spread.middle if spread.kind == "normal" else "",
            "sigma": spread.sigma if spread.kind == "normal" else "",
            "why": spread.why,
        }
        for spread in SPREADS
    ]
