"""A Pareto front and its uncertainty.

The objectives of a design that was only looked at are uncertain: their logarithms are normal, with the spread
that leaving-one-out of the calibration showed. Drawing all objectives many times gives each design's
probability of being on the front and the spread of the front's hypervolume.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tubefoot.study.ranking import FloatArray, pareto_set

DRAWS = 200
"""Draws of all objectives."""
POINTS = 2048


@dataclass(frozen=True)
class Front:
    """Designs by their objectives.

    inside : (n,) whether a design is on the front of the foretold values
    probability : (n,) of being on it; hypervolume : median and 5th and 95th percentile, shares of the box
    """

    inside: np.ndarray
    probability: FloatArray
    hypervolume: tuple[float, float, float]


def uncertain_front(costs: FloatArray, spread: FloatArray, seed: int = 1) -> Front:
    """The front of uncertain designs.

    costs : (n, m) objectives to be made small, NaN for designs that are out
    spread : (n, m) standard deviation of the logarithm of each, 0 where it is known; seed : of the draws
    """
    random = np.random.default_rng(seed)
    inside = pareto_set(costs)
    known = np.isfinite(costs).all(axis=1)
    hits, volumes = np.zeros(len(costs)), []
    best, worst = costs[known].min(axis=0), costs[known].max(axis=0)
    for _ in range(DRAWS):
        drawn = costs * np.exp(spread * random.standard_normal(costs.shape))
        on = pareto_set(drawn)
        hits += on
        volumes.append(hypervolume(drawn[on], best, worst))
    low, median, high = np.percentile(volumes, [5, 50, 95])
    return Front(inside, hits / DRAWS, (float(median), float(low), float(high)))


def hypervolume(costs: FloatArray, best: FloatArray, worst: FloatArray) -> float:
    """Share of the box between two corners that some design betters, by 2048 Sobol points.

    costs : (n, m) of the front; best, worst : (m,) corners of the box
    """
    span = np.where(worst > best, worst - best, 1.0)
    placed = (costs - best) / span
    bettered = np.ones((POINTS, len(costs)), dtype=bool)
    for k, axis in enumerate(_box_points(costs.shape[1]).T):
        bettered &= placed[:, k] <= axis[:, None]
    return float(bettered.any(axis=1).mean())


@cache
def _box_points(dimensions: int) -> FloatArray:
    """Points spread evenly over the unit box, (POINTS, m)."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(POINTS))
