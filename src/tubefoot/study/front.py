"""A Pareto front and its uncertainty.

The objectives of a design that was only looked at are uncertain: their logarithms are normal, with the spread
that leaving-one-out of the calibration showed. Drawing all objectives many times gives each design's
probability of being on the front and the spread of the front's hypervolume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tubefoot.study.ranking import FloatArray, pareto_set

DRAWS = 400
"""Draws of all objectives."""


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


def hypervolume(costs: FloatArray, best: FloatArray, worst: FloatArray, points: int = 4096) -> float:
    """Share of the box between two corners that some design betters.

    costs : (n, m) of the front; best, worst : (m,) corners of the box; points : by so many Sobol points
    """
    from scipy.stats import qmc

    span = np.where(worst > best, worst - best, 1.0)
    placed = (costs - best) / span
    grid = qmc.Sobol(costs.shape[1], scramble=False).random(points)
    return float((placed[None, :, :] <= grid[:, None, :]).all(axis=2).any(axis=1).mean())
