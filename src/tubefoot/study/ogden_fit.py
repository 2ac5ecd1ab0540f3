"""Ogden parameters from stress curves of any kinds at once, with what the data do and do not determine.

For given exponents the stress is linear in the moduli, so only the exponents are searched (variable
projection), from many starts; the moduli follow by least squares, kept >= 0 where the law must be stable at
every stretch.
Residuals are weighted by sigma_i = hypot(share of the stress, floor of the test's largest stress).

At the solution, with J the weighted derivatives and s^2 the misfit a degree of freedom, the covariance is
s^2 (J'J)^-1; bands of the curves follow from it and stay narrow where single parameters are wide. Singular
values of J, in proportions of the initial modulus and in exponents, say how many combinations the data
determine; starts that end at other parameters with the same misfit are kept as proof; profiles give
intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.study.material_tests import StressTest
from tubefoot.study.ogden_curves import stress_basis

FloatArray = NDArray[np.float64]

STARTS = 16
LARGEST_EXPONENT = 20.0
SMALLEST_EXPONENT = 0.05
SPAN = (-6.0, 9.0)
"""From where starting exponents are drawn."""
SAME_MISFIT = 1.05
"""A start whose misfit is within 5 % of the least fits the data as well."""
OTHER_EXPONENT = 0.5
"""Difference of an exponent from which on a solution counts as another one."""
LOST = 0.5
"""Deviation (share of the initial modulus, or exponent) above which a combination is not determined."""


@dataclass(frozen=True)
class Weighting:
    """How exact a stress is taken to be.

    share : of the stress itself; floor : of the largest stress of its test
    """

    share: float = 0.02
    floor: float = 0.01

    def sigma(self, stress: FloatArray) -> FloatArray:
        """Standard deviation of each stress [MPa].

        stress : (n,) of one test [MPa]
        """
        return np.asarray(np.hypot(self.share * stress, self.floor * np.abs(stress).max()))


@dataclass(frozen=True)
class OgdenFit:
    """An Ogden law and how well the data determine it.

    mu : (n,) [MPa]; alpha : (n,), ascending; misfit : weighted, root mean square over all points
    covariance : (2n, 2n) of mu, then alpha
    singular_values : of the weighted derivatives by mu over the initial modulus, and by alpha
    undetermined : combinations whose standard deviation exceeds LOST, as weights of each parameter
    others : parameters of other solutions that fit as well
    """

    mu: FloatArray
    alpha: FloatArray
    misfit: float
    points: int
    covariance: FloatArray
    singular_values: FloatArray
    undetermined: tuple[dict[str, float], ...]
    others: tuple[tuple[FloatArray, FloatArray], ...]

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus [MPa]."""
        return float(self.mu.sum())

    @property
    def information_criterion(self) -> float:
        """Akaike's, for few points: the smaller, the better is the number of terms."""
        k, n = 2 * len(self.mu), self.points
        return n * float(np.log(max(self.misfit, 1e-12) ** 2)) + 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)

    def stress(self, kind: str, deformation: FloatArray) -> FloatArray:
        """Nominal stress [MPa].

        kind : of the test; deformation : (n,) stretch, or amount of shear
        """
        return np.asarray(stress_basis(kind, deformation, self.alpha) @ self.mu)

    def stress_sigma(self, kind: str, deformation: FloatArray) -> FloatArray:
        """Standard deviation of the stress by the fit's covariance [MPa].

        kind : of the test; deformation : (n,) stretch, or amount of shear
        """
        rows = _derivatives(kind, deformation, self.mu, self.alpha)
        return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", rows, self.covariance, rows), 0.0)))


def fit_ogden(
    tests: Sequence[StressTest],
    terms: int = 3,
    stable: bool = True,
    weighting: Weighting | None = None,
    starts: int = STARTS,
    seed: int = 0,
) -> OgdenFit:
    """The Ogden law that fits all tests best.

    tests : curves of stress; terms : of the law; stable : whether all moduli must be >= 0
    weighting : how exact stresses are; starts : number of searches; seed : of their exponents

    Raises ConfigError when there are fewer points than parameters.
    """
    data = _Data(tests, weighting or Weighting(), stable)
    if data.count < 2 * terms:
        raise ConfigError(
            f"{data.count} points for {2 * terms} parameters of {terms} terms; give more data or "
            "fewer --terms"
        )
    found = sorted(_searches(data, terms, starts, seed), key=lambda end: end[0])
    cost, alpha = found[0]
    order = np.argsort(alpha)
    alpha = alpha[order]
    mu = data.moduli(alpha)
    misfit = float(np.sqrt(cost / data.count))
    covariance, singular, lost = _uncertainty(data, mu, alpha, cost)
    others = tuple(
        (data.moduli(np.sort(other)), np.sort(other))
        for value, other in _distinct(found)
        if value <= SAME_MISFIT**2 * cost + 1e-18
    )
    return OgdenFit(mu, alpha, misfit, data.count, covariance, singular, lost, others)


def profile_exponent(
    tests: Sequence[StressTest],
    fit: OgdenFit,
    which: int,
    values: FloatArray,
    stable: bool = True,
    weighting: Weighting | None = None,
) -> FloatArray:
    """Misfit with one exponent held and everything else fitted anew, over the least misfit, (n_values,).

    tests : curves of stress; fit : the best law; which : exponent that is held
    values : (n,) where it is held
    stable, weighting : as in `fit_ogden`
    """
    from scipy.optimize import least_squares

    data = _Data(tests, weighting or Weighting(), stable)
    free = np.delete(fit.alpha, which)
    found = []
    for value in values:
        if free.size:
            ends = least_squares(
                lambda rest, held=value: data.residual(np.append(rest, held)),
                free,
                bounds=(-LARGEST_EXPONENT, LARGEST_EXPONENT),
                x_scale=1.0,
            )
            cost = 2.0 * ends.cost
        else:
            cost = float((data.residual(np.array([value])) ** 2).sum())
        found.append(np.sqrt(cost / data.count))
    return np.array(found) / max(fit.misfit, 1e-12)


class _Data:
    """All tests as one weighted problem."""

    def __init__(self, tests: Sequence[StressTest], weighting: Weighting, stable: bool):
        self.tests = list(tests)
        self.sigma = np.concatenate([weighting.sigma(test.stress) for test in tests])
        self.wanted = np.concatenate([test.stress for test in tests]) / self.sigma
        self.count = len(self.wanted)
        self.stable = stable

    def basis(self, alpha: FloatArray) -> FloatArray:
        rows = [stress_basis(test.kind, test.deformation, alpha) for test in self.tests]
        return np.asarray(np.vstack(rows) / self.sigma[:, None])

    def moduli(self, alpha: FloatArray) -> FloatArray:
        from scipy.optimize import nnls

        rows = self.basis(alpha)
        size = np.linalg.norm(rows, axis=0)
        if self.stable:
            return np.asarray(nnls(rows / size, self.wanted)[0] / size)
        return np.asarray(np.linalg.lstsq(rows / size, self.wanted, rcond=1e-10)[0] / size)

    def residual(self, alpha: FloatArray) -> FloatArray:
        return np.asarray(self.basis(alpha) @ self.moduli(alpha) - self.wanted)

    def derivatives(self, mu: FloatArray, alpha: FloatArray) -> FloatArray:
        rows = [_derivatives(test.kind, test.deformation, mu, alpha) for test in self.tests]
        return np.asarray(np.vstack(rows) / self.sigma[:, None])


def _derivatives(kind: str, deformation: FloatArray, mu: FloatArray, alpha: FloatArray) -> FloatArray:
    """Of the stress by mu and by alpha, (n_points, 2 n_terms); the latter by central differences."""
    step = 1e-5
    by_alpha = (
        stress_basis(kind, deformation, alpha + step) - stress_basis(kind, deformation, alpha - step)
    ) * (0.5 * mu / step)
    return np.hstack([stress_basis(kind, deformation, alpha), by_alpha])


def _searches(data: _Data, terms: int, starts: int, seed: int) -> list[tuple[float, FloatArray]]:
    """Cost and exponents of each search's end."""
    from scipy.optimize import least_squares

    chance = np.random.default_rng([seed, terms])
    ends = []
    for number in range(max(starts, 1)):
        start = chance.uniform(*SPAN, size=terms) if number else np.linspace(-2.0, 4.0, terms + 2)[1:-1]
        start = np.where(np.abs(start) < 2 * SMALLEST_EXPONENT, 1.0, start)
        found = least_squares(data.residual, start, bounds=(-LARGEST_EXPONENT, LARGEST_EXPONENT), x_scale=1.0)
        alpha = np.where(np.abs(found.x) < SMALLEST_EXPONENT, SMALLEST_EXPONENT, found.x)
        ends.append((float((data.residual(alpha) ** 2).sum()), alpha))
    return ends


def _distinct(found: Sequence[tuple[float, FloatArray]]) -> list[tuple[float, FloatArray]]:
    """Ends whose exponents differ from those of all better ones."""
    kept: list[tuple[float, FloatArray]] = [found[0]]
    for value, alpha in found[1:]:
        if all(np.abs(np.sort(alpha) - np.sort(other)).max() > OTHER_EXPONENT for _, other in kept):
            kept.append((value, alpha))
    return kept[1:]


def _uncertainty(
    data: _Data, mu: FloatArray, alpha: FloatArray, cost: float
) -> tuple[FloatArray, FloatArray, tuple[dict[str, float], ...]]:
    """Covariance, singular values, combinations that are not determined."""
    n = len(mu)
    scale = np.concatenate([np.full(n, max(abs(float(mu.sum())), 1e-12)), np.ones(n)])
    free = np.concatenate([(mu != 0.0) | (not data.stable), mu != 0.0])
    rows = (data.derivatives(mu, alpha) * scale)[:, free]
    _, singular, directions = np.linalg.svd(rows, full_matrices=False)
    variance = cost / max(data.count - int(free.sum()), 1)
    safe = np.maximum(singular, 1e-9 * singular.max())
    inside = (directions.T / safe**2) @ directions * variance
    covariance = np.zeros((2 * n, 2 * n))
    covariance[np.ix_(free, free)] = inside * np.outer(scale[free], scale[free])
    names = [f"{kind}_{k + 1}" for kind in ("mu", "alpha") for k in range(n)]
    names = [name for name, kept in zip(names, free, strict=True) if kept]
    doubt = np.sqrt(variance) / safe
    lost = tuple(
        {name: round(float(weight), 3) for name, weight in zip(names, direction, strict=True)}
        for direction, wide in zip(directions, doubt, strict=True)
        if wide > LOST
    )
    return covariance, singular, lost
