"""What a lean bench at its true parameters leaves unexplained, as part of the likelihood.

After Kennedy and O'Hagan, "Bayesian calibration of computer models" (J. R. Stat. Soc. B 63, 2001): data =
model + discrepancy + noise, the discrepancy a Gaussian process. Here it has three parts, of which each
window's covariance consists:

    volume    each pulse brings more or less than modelled, by e ~ N(0, volume^2): that stays in every later
              window (a random walk; its columns are derivatives of the lean bench)
    slow      of each quantity, covariance slow^2 exp(-|t - t'| / 20 s): temperature, drift, the law itself
    fast      beside the sensors' scatter in a mean: converter, steps, what is alike in one window only

Their sizes are found with the parameters integrated out (restricted likelihood, linear about a first fit)
and have wide priors of their own, so that no part vanishes where a recording says little of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import minimize

from tubefoot.units import DEG, KPA

FloatArray = NDArray[np.float64]

MEMORY_S = 20.0
"""Correlation time of the slow part [s]."""
USUAL = {
    "volume": 0.2,
    "fast_pressure": 0.02 * KPA,
    "fast_running": 0.1 * KPA,
    "slow_pressure": 0.05 * KPA,
    "fast_angle": 0.01 * DEG,
    "slow_angle": 0.02 * DEG,
}
"""Middles of the priors of the sizes: of a pulse [mm^3], [MPa] in pauses and while the pump runs, [rad]."""
SPREAD = 1.0
"""Standard deviation of the priors of their logarithms."""
REACH = 4.0
"""Sizes are looked for within so many of them."""


@dataclass(frozen=True)
class Residuals:
    """Residuals of one recording and what they depend on, windows of right, left and angle after each other.

    off : (n,) model less data at a fit [MPa], [rad]; slopes : (n, p) by the parameters
    volumes : (n, pulses) by each pulse's volume [MPa/mm^3], [rad/mm^3]
    noise : (n,) of the means, from the sensors' scatter; time : (n,) middles of the windows [s]
    quantity : (n,) 0 right, 1 left, 2 angle; running : (n,) whether the pump ran
    """

    off: FloatArray
    slopes: FloatArray
    volumes: FloatArray
    noise: FloatArray
    time: FloatArray
    quantity: NDArray[np.int64]
    running: NDArray[np.bool_]

    def covariance(self, sizes: dict[str, float]) -> FloatArray:
        """Of data about the true model, (n, n).

        sizes : as in USUAL
        """
        angle = self.quantity == 2
        fast = np.where(self.running, sizes["fast_running"], sizes["fast_pressure"])
        fast = np.where(angle, sizes["fast_angle"], fast)
        slow = np.where(angle, sizes["slow_angle"], sizes["slow_pressure"])
        apart = np.abs(self.time[:, None] - self.time) / MEMORY_S
        same = self.quantity[:, None] == self.quantity
        found = sizes["volume"] ** 2 * self.volumes @ self.volumes.T
        found += np.where(same, np.exp(-apart), 0.0) * np.outer(slow, slow)
        found[np.diag_indices_from(found)] += self.noise**2 + fast**2
        return np.asarray(found)


def found_sizes(recordings: Sequence[Residuals], spread: FloatArray, away: FloatArray) -> dict[str, float]:
    """The most probable sizes of the discrepancy's parts, as in USUAL.

    recordings : at one fit; spread : (p,) standard deviations of the parameters' priors
    away : (p,) middles of the priors less the fit
    """
    middle = np.log(list(USUAL.values()))

    def misfit(offset: FloatArray) -> float:
        sizes = dict(zip(USUAL, np.exp(middle + offset).tolist(), strict=True))
        information, pull, total = np.diag(spread**-2.0), np.zeros(len(spread)), 0.0
        for each in recordings:
            factor = cholesky(each.covariance(sizes), lower=True)
            start = each.off + each.slopes @ away
            white = solve_triangular(factor, np.column_stack([each.slopes, start]), lower=True)
            information += white[:, :-1].T @ white[:, :-1]
            pull += white[:, :-1].T @ white[:, -1]
            total += 2.0 * float(np.log(np.diag(factor)).sum()) + float(white[:, -1] @ white[:, -1])
        total += float(np.linalg.slogdet(information)[1] - pull @ np.linalg.solve(information, pull))
        return 0.5 * total + 0.5 * float(offset @ offset) / SPREAD**2

    best = minimize(
        misfit,
        np.zeros(len(USUAL)),
        method="L-BFGS-B",
        bounds=[(-REACH * SPREAD, REACH * SPREAD)] * len(USUAL),
        options={"ftol": 1e-6, "maxiter": 40, "eps": 1e-4},
    )
    return dict(zip(USUAL, np.exp(middle + best.x).tolist(), strict=True))
