"""The score of a candidate, its rank, and the Pareto set.

    score = sum_g w_g mean_{k in g} s_k ln(x_k / x_k,base) / sum_g w_g

over four groups g of figures x_k: bending (gain up), stress (99th percentile at a fixed angle down,
concentration down), sealing (S33 on the seam down, narrowest sealing width up) and footprint (envelope down).
The base scores 0; 0.1 is about a tenth better in the weighted mean. The score of one candidate does not
depend on which others are in the study. Manufacturability is no weight but a gate: only what keeps every rule
of printing and slenderness, and reaches 35 kPa, has a rank.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.study.study_file import RankSettings

FloatArray = NDArray[np.float64]

GROUPS: dict[str, dict[str, int]] = {
    "bending": {"gain_deg_per_kpa": 1},
    "stress": {"von_mises_p99_at_angle_kpa": -1, "stress_concentration": -1},
    "sealing": {"seam_s33_p99_kpa": -1, "sealing_width_mm": 1},
    "footprint": {"footprint_cm3": -1},
}
"""Figures of each group, 1 where more is better."""
CRITERIA = tuple(name for figures in GROUPS.values() for name in figures)
OBJECTIVES = {"gain_deg_per_kpa": 1, "von_mises_p99_at_angle_kpa": -1, "footprint_cm3": -1}
"""Figures of the Pareto set, 1 where more is better."""
WEIGHTINGS = 10_000
"""Random weightings with which a choice is tried."""


def criteria_of(figures: Mapping[str, Any]) -> FloatArray:
    """The figures that the score uses, (n_criteria,), NaN where one is missing.

    figures : of a candidate
    """
    return np.array([_number(figures.get(name)) for name in CRITERIA])


def weights_of(settings: RankSettings) -> FloatArray:
    """Weights of the groups, (4,), summing to one.

    settings : of the ranking
    """
    weights = np.array([getattr(settings, f"weight_{group}") for group in GROUPS])
    return weights / weights.sum()


def group_scores(criteria: FloatArray, base: FloatArray) -> FloatArray:
    """Score of each group, (n, 4): logarithm of the improvement on the base.

    criteria : (n, n_criteria); base : (n_criteria,) of the base design

    Raises ConfigError when the base lacks a figure.
    """
    if not (np.isfinite(base).all() and (base > 0).all()):
        lacking = [name for name, value in zip(CRITERIA, base, strict=True) if not value > 0]
        raise ConfigError(
            f"the base design has no {', '.join(lacking)}, so nothing can be compared with it; choose a base "
            "that reaches 35 kPa, or a smaller rank.angle_deg"
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        improvement = np.log(criteria / base)
    columns, start = [], 0
    for figures in GROUPS.values():
        signs = np.array(list(figures.values()))
        columns.append((improvement[:, start : start + len(signs)] * signs).mean(axis=1))
        start += len(signs)
    return np.stack(columns, axis=1)


def ranks_of(scores: FloatArray, eligible: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Rank of each candidate from 1, 0 without one; equal scores share a rank.

    scores : (n,); eligible : (n,) whether it may have a rank
    """
    ranks = np.zeros(len(scores), dtype=np.int64)
    known = eligible & np.isfinite(scores)
    values = np.unique(-np.round(scores[known], 12))
    ranks[known] = 1 + np.searchsorted(values, -np.round(scores[known], 12))
    return ranks


def objectives_of(figures: Mapping[str, Any]) -> FloatArray:
    """The objectives as quantities to be made small, (3,), NaN where one is missing.

    figures : of a candidate
    """
    return np.array([-sign * _number(figures.get(name)) for name, sign in OBJECTIVES.items()])


def pareto_set(costs: FloatArray) -> NDArray[np.bool_]:
    """Which rows no other row betters in one objective without being worse in another, (n,).

    costs : (n, m) to be made small; rows with NaN are out
    """
    inside = np.isfinite(costs).all(axis=1)
    left = np.flatnonzero(inside)
    left = left[np.argsort(costs[left].sum(axis=1), kind="stable")]
    chosen = np.zeros(len(costs), dtype=bool)
    while len(left):
        best = costs[left[0]]
        chosen[left[0]] = True
        equal = (costs[left] == best).all(axis=1)
        chosen[left[equal]] = True
        left = left[(costs[left] < best).any(axis=1)]
    return chosen


def win_shares(groups: FloatArray, seed: int = 1) -> FloatArray:
    """Share of all weightings of the groups under which each candidate scores best, (n,).

    groups : (n, 4) scores of the groups; seed : of the weightings, drawn evenly from all that sum to one
    """
    weightings = np.random.default_rng(seed).dirichlet(np.ones(groups.shape[1]), WEIGHTINGS)
    best = np.argmax(groups @ weightings.T, axis=0)
    return np.bincount(best, minlength=len(groups)) / WEIGHTINGS


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
