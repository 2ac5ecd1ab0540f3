"""Least squares within bounds: Gauss and Newton's steps, shortened by Levenberg and Marquardt's damping.

Each step minimises the linearised sum of squares within the bounds (an active set finds those that it
touches) with a damping that counts as a prior about the present point. Derivatives are dear here: there is
one set of them a step, and the search ends where the next would gain no more than a share of one standard
deviation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from tubefoot.errors import ConvergenceError

FloatArray = NDArray[np.float64]

FINE, COARSE = 1e-3, 0.1
"""What the next step would take off half the sum of squares where a search ends; a standard deviation is
0.5."""
MOST_STEPS = 30
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-6, 1e6
LEAST_SHARE = 0.05
"""A step that gains less than this share of what was foretold is not made."""


class LeastSquares(Protocol):
    """What is searched: weighted residuals of data and priors.

    low, high : (p,) bounds; spread : (p,) size of a prior about each unknown
    """

    low: FloatArray
    high: FloatArray
    spread: FloatArray

    def all_residuals(self, x: FloatArray) -> FloatArray:
        """Residuals, (n,).

        x : (p,)

        Raises ConvergenceError where there are none.
        """

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Their derivatives, (n, p).

        x : (p,)
        """


@dataclass(frozen=True)
class Found:
    """Where a search ended.

    x : (p,); cost : half the sum of squares; steps : sets of derivatives; converged : whether it ended by
        itself
    """

    x: FloatArray
    cost: float
    steps: int
    converged: bool


def search(problem: LeastSquares, x: FloatArray, tolerance: float = FINE, most: int = MOST_STEPS) -> Found:
    """The least sum of squares near a start.

    problem : residuals and bounds; x : (p,) start, within the bounds
    tolerance : gain of half the sum of squares at which it ends; most : steps

    Raises ConvergenceError when the start has no residuals.
    """
    residuals = problem.all_residuals(x)
    cost, damping = 0.5 * float(residuals @ residuals), FIRST_DAMPING
    for step in range(1, most + 1):
        both = np.column_stack([problem.jacobian(x), residuals])
        triangle: FloatArray = np.asarray(np.linalg.qr(both, mode="r"))
        matrix, wanted = triangle[:, :-1], -triangle[:, -1]
        while damping < MOST_DAMPING:
            move = _bounded(matrix, wanted, problem, x, damping)
            left = matrix @ move - wanted
            foretold = cost - 0.5 * float(left @ left)
            if foretold < tolerance:
                return Found(x, cost, step, True)
            after, there = _cost(problem, x + move)
            if cost - after > LEAST_SHARE * foretold:
                damping = max(damping * (0.1 if cost - after > 0.5 * foretold else 1.0), LEAST_DAMPING)
                x, cost, residuals = x + move, after, there
                break
            damping *= 10.0
        else:
            return Found(x, cost, step, False)
    return Found(x, cost, most, False)


def _bounded(
    matrix: FloatArray, wanted: FloatArray, problem: LeastSquares, x: FloatArray, damping: float
) -> FloatArray:
    """The step (p,) that minimises the linearised sum of squares within the bounds."""
    rows = np.vstack([matrix, np.diag(np.sqrt(damping) / problem.spread)])
    right = np.concatenate([wanted, np.zeros(len(x))])
    scaled = lsq_linear(
        rows * problem.spread,
        right,
        ((problem.low - x) / problem.spread - 1e-12, (problem.high - x) / problem.spread + 1e-12),
        method="bvls",
    )
    return np.asarray(np.clip(x + scaled.x * problem.spread, problem.low, problem.high) - x)


def _cost(problem: LeastSquares, x: FloatArray) -> tuple[float, FloatArray]:
    """Half the sum of squares, infinite where there is none, and the residuals."""
    try:
        residuals = problem.all_residuals(x)
    except ConvergenceError:
        return float("inf"), np.zeros(0)
    return 0.5 * float(residuals @ residuals), residuals
