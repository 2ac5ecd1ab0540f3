"""Stress of an incompressible Ogden solid in the usual tests, and the range in which it is stable.

W = sum_i 2 mu_i / alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), l1 l2 l3 = 1: the convention of
`fea/ogden.py`, with the initial shear modulus sum mu_i. A test drives one stretch l; another one follows as
l^-k, k = 1/2 uniaxial, 1 planar, 2 equibiaxial, and the nominal stress in the driven direction is

    P = sum_i 2 mu_i / alpha_i (l^alpha_i - l^(-k alpha_i)) / l.

Simple shear by g has the planar stretches l - 1/l = g and the shear stress dW/dg = P l^2 / (l^2 + 1).

Stability (Drucker): with e = ln l, tau_a = dW/de_a in the plane of two free stretches, the matrix
dtau_a/de_b = sum_i 2 mu_i (l_a^alpha_i delta_ab + l3^alpha_i) must be positive definite. mu_i >= 0 is enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

LATERAL = {"uniaxial": 0.5, "planar": 1.0, "equibiaxial": 2.0, "shear": 1.0}
"""Exponent k of each kind of test: the stretch that follows is l^-k."""
SMALL = 1e-6
"""|alpha ln l| below which l^alpha - l^(-k alpha) is replaced by its first term."""


def driven_stretch(kind: str, deformation: ArrayLike) -> FloatArray:
    """The largest stretch in the driven direction.

    kind : a key of LATERAL; deformation : stretch, or the amount of shear for `shear`
    """
    given = np.asarray(deformation, float)
    return given if kind != "shear" else np.asarray(0.5 * given + np.sqrt(1.0 + 0.25 * given**2))


def stress_basis(kind: str, deformation: ArrayLike, alpha: ArrayLike) -> FloatArray:
    """Nominal stress for moduli of one, (n_points, n_terms): times mu it is the stress.

    kind : a key of LATERAL; deformation : (n_points,) stretch, or amount of shear; alpha : (n_terms,)
    """
    stretch, exponents = driven_stretch(kind, deformation)[:, None], np.asarray(alpha, float)
    log, k = np.log(stretch), LATERAL[kind]
    x = exponents * log
    small = np.abs(x) < SMALL
    safe = np.where(np.abs(exponents) < SMALL, 1.0, exponents)
    exact = (np.expm1(x) - np.expm1(-k * x)) / safe
    found = 2.0 / stretch * np.where(small, (1.0 + k) * log * (1.0 + 0.5 * (1.0 - k) * x), exact)
    return found * stretch**2 / (stretch**2 + 1.0) if kind == "shear" else found


def nominal_stress(kind: str, deformation: ArrayLike, mu: ArrayLike, alpha: ArrayLike) -> FloatArray:
    """Nominal stress in the driven direction, (n_points,) [MPa]; for `shear` the shear stress.

    kind : a key of LATERAL; deformation : stretch, or amount of shear; mu : [MPa]; alpha : exponents
    """
    return np.asarray(stress_basis(kind, deformation, alpha) @ np.asarray(mu, float))


@dataclass(frozen=True)
class Stability:
    """Where a law is stable in one kind of test.

    kind : of the test; low, high : range of the deformation that was looked at
    stable_low, stable_high : range about rest in which the law is stable
    margin : least eigenvalue of the tangent over twice the initial shear modulus, within low to high
    """

    kind: str
    low: float
    high: float
    stable_low: float
    stable_high: float
    margin: float

    @property
    def stable(self) -> bool:
        """Whether the whole range is stable."""
        return self.margin > 0.0


def drucker_stability(
    kind: str, low: float, high: float, mu: Sequence[float], alpha: Sequence[float], points: int = 401
) -> Stability:
    """Where the law is stable between two deformations.

    kind : a key of LATERAL; low, high : stretches about 1, or amounts of shear about 0
    mu : [MPa]; alpha : exponents; points : how many states are looked at
    """
    rest = 0.0 if kind == "shear" else 1.0
    states = np.union1d(np.linspace(min(low, rest), max(high, rest), points), [rest])
    first = np.log(driven_stretch(kind, states))
    third = -LATERAL[kind] * first
    second = -first - third
    doubled, exponents = 2.0 * np.asarray(mu, float), np.asarray(alpha, float)
    one, two, three = (np.exp(np.outer(logs, exponents)) @ doubled for logs in (first, second, third))
    tangent = np.array([[one + three, three], [three, two + three]]).transpose(2, 0, 1)
    least = np.linalg.eigvalsh(tangent)[:, 0] / abs(doubled.sum())
    bad = states[least <= 0.0]
    below, above = bad[bad < rest], bad[bad > rest]
    at_rest = bool(np.any(bad == rest))
    inside = (states >= low) & (states <= high)
    return Stability(
        kind,
        low,
        high,
        rest if at_rest else float(below.max()) if below.size else float(states[0]),
        rest if at_rest else float(above.min()) if above.size else float(states[-1]),
        float(least[inside].min()),
    )
