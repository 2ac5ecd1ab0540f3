"""The law of one unit: an energy of its angle and of both chamber pressures, from which all else follows.

With the angle phi of the unit and the gauge pressures p_R, p_L of its chambers,

    Psi(phi, p_R, p_L) = U - p_R v_R - p_L v_L,    M = dPsi/dphi,    v_R = -dPsi/dp_R,    v_L = -dPsi/dp_L

with the strain energy U, the volume changes v and the moment M that holds the unit. So dM/dp = -dv/dphi holds
by construction. Psi is a polynomial in phi / A, (p_R - p_L) / P, (p_R + p_L) / P with constants A, P; mirror
symmetry (phi -> -phi, p_R <-> p_L) leaves only terms with an even sum of the first two exponents. At rest
there is neither moment nor volume change, which removes the constant and the term linear in pressure.

Energies in N mm, angles in rad, pressures in MPa, volumes in mm^3.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ANGLE_SCALE = 0.1
"""Angle by which phi is divided in the polynomial [rad]."""
PRESSURE_SCALE = 0.035
"""Pressure by which sum and difference are divided in the polynomial [MPa]."""


def admissible_terms(degree: int, angle_degree: int) -> tuple[tuple[int, int, int], ...]:
    """Exponents (of angle, pressure difference, pressure sum) that symmetry and rest allow.

    degree : largest sum of the exponents; angle_degree : largest exponent of the angle
    """
    span = range(degree + 1)
    return tuple(
        (a, b, c)
        for a, b, c in product(span, span, span)
        if 2 <= a + b + c <= degree and (a + b) % 2 == 0 and a <= angle_degree
    )


@dataclass(frozen=True)
class UnitLaw:
    """Coefficients of Psi [N mm] by exponents (of angle, pressure difference, pressure sum).

    terms : exponents; coefficients : one a term
    """

    terms: tuple[tuple[int, int, int], ...]
    coefficients: tuple[float, ...]


def derivatives_of_terms(
    terms: tuple[tuple[int, int, int], ...], angle: float, pressures: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each term with coefficient one: energy, moment, volumes; (m,), (m,), (2, m). For fitting.

    terms : exponents; angle : [rad]; pressures : (2,) right and left [MPa]
    """
    a, b, c = np.transpose(terms).astype(float)
    x = angle / ANGLE_SCALE
    u = (pressures[0] - pressures[1]) / PRESSURE_SCALE
    v = (pressures[0] + pressures[1]) / PRESSURE_SCALE
    along_angle, along_difference, along_sum = (
        _slope(base, exponent) for base, exponent in ((x, a), (u, b), (v, c))
    )
    px, pu, pv = x**a, u**b, v**c
    moment = along_angle * pu * pv / ANGLE_SCALE
    by_difference = px * along_difference * pv / PRESSURE_SCALE
    by_sum = px * pu * along_sum / PRESSURE_SCALE
    return px * pu * pv, moment, np.stack([-(by_sum + by_difference), -(by_sum - by_difference)])


def _slope(base: float, exponents: FloatArray) -> FloatArray:
    return np.asarray(exponents * base ** np.maximum(exponents - 1.0, 0.0))
