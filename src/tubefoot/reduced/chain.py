"""What a chain of units answers at given angles and pressures: moments, volumes, and all second derivatives.

Three laws make a finger of any length: `inner` for each unit, and what the caps with their neighbourhood
add at the base and at the tip. One answer takes some twenty NumPy calls, however many units there are.

Outside of the range that was identified the energy is continued by its second-order Taylor polynomial at the
nearest point inside: forces grow linearly there and never turn back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE, UnitLaw

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class FingerRange:
    """Where the law was identified: angle of a unit [rad] and gauge pressures [MPa], of the unscaled wall."""

    angle: float
    pressure_low: float
    pressure_high: float


class Response(NamedTuple):
    """Answer of a chain of n units.

    moments : (n,) that the outside must apply to hold the angles [N mm]
    stiffness : (n,) dM/dphi at fixed pressures [N mm/rad]
    volumes : (2,) changes of the right and the left chamber from rest [mm^3]
    compliance : (2, 2) dV/dp at fixed angles [mm^3/MPa]; coupling : (2, n) dV/dphi = -dM/dp [mm^3/rad]
    energy : Psi = strain energy less the work of both fluids [N mm]
    """

    moments: FloatArray
    stiffness: FloatArray
    volumes: FloatArray
    compliance: FloatArray
    coupling: FloatArray
    energy: float


class Chain:
    """The polynomials of n units, laid out for quick evaluation.

    table : (3 laws: inner, base, tip; exponents of the angle; pairs) coefficients [N mm]
    pairs : (2, n_pairs) exponents of pressure difference and sum
    """

    def __init__(self, n_units: int, inner: UnitLaw, base: UnitLaw, tip: UnitLaw, valid: FingerRange):
        """Lay the coefficients out.

        n_units : number of units; inner : law of every unit; base, tip : what the ends add
        valid : where the laws hold
        """
        laws = (inner, base, tip)
        angle_powers = 1 + max(term[0] for law in laws for term in law.terms)
        pairs = sorted({term[1:] for law in laws for term in law.terms})
        self.table: FloatArray = np.zeros((3, angle_powers, len(pairs)))
        for number, law in enumerate(laws):
            for (a, b, c), value in zip(law.terms, law.coefficients, strict=True):
                self.table[number, a, pairs.index((b, c))] += value
        self.pairs = np.array(pairs).T.copy()
        self.n_units = n_units
        self._valid = valid
        self._lay_out()

    def _lay_out(self) -> None:
        """Prepare what `_inside` needs."""
        b, c = self.pairs
        n_p, n_a = 1 + int(self.pairs.max()), self.table.shape[1]
        by_difference, by_sum = np.transpose(ORDERS)
        self._flat = self.table.reshape(3 * n_a, -1)
        self._of_difference = by_difference[:, None] * n_p + b
        self._of_sum = 3 * n_p + by_sum[:, None] * n_p + c
        self._powers = np.arange(n_p, dtype=float)
        self._slopes = _derivative_matrices(n_p)
        self._angle_powers = np.arange(n_a, dtype=float)
        self._angle_slopes = _derivative_matrices(n_a)
        self._shape = (3, n_a, len(ORDERS))
        self._of_unit, self._of_total = _selections()

    def respond(self, angles: FloatArray, pressures: FloatArray) -> Response:
        """The answer at a state.

        angles : (n,) of the units [rad]; pressures : (2,) right and left, gauge [MPa]
        """
        valid = self._valid
        right, left = float(pressures[0]), float(pressures[1])
        held_right = min(max(right, valid.pressure_low), valid.pressure_high)
        held_left = min(max(left, valid.pressure_low), valid.pressure_high)
        inside = held_right == right and held_left == left
        if inside and np.abs(angles).max() <= valid.angle:
            return self._inside(angles, right, left)
        held = np.clip(angles, -valid.angle, valid.angle)
        found = self._inside(held, held_right, held_left)
        return _continued(found, angles - held, np.array([right - held_right, left - held_left]))

    def _inside(self, angles: FloatArray, right: float, left: float) -> Response:
        n = len(angles)
        both = np.array([[right - left], [right + left]]) / PRESSURE_SCALE
        powers = (both**self._powers @ self._slopes).ravel()
        by_pressure = powers[self._of_difference] * powers[self._of_sum]
        inner, base, tip = (self._flat @ by_pressure.T).reshape(self._shape)
        of_angle = (angles / ANGLE_SCALE)[:, None] ** self._angle_powers @ self._angle_slopes
        of_angle = of_angle.reshape(3 * n, -1)
        terms = of_angle @ inner
        terms[:3] += of_angle[:3] @ base
        terms[-3:] += of_angle[-3:] @ tip
        by_unit = terms.reshape(n, -1)
        units = self._of_unit @ by_unit.T
        total = by_unit.sum(axis=0) @ self._of_total
        return Response(units[0], units[1], total[0:2], total[2:6].reshape(2, 2), units[2:4], float(total[6]))


ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of the derivatives by pressure difference and by pressure sum."""


def _derivative_matrices(size: int) -> FloatArray:
    """(size, 3 size): powers of x times this are the powers, their first and their second derivatives."""
    first = np.diag(np.arange(1.0, size), 1)
    return np.hstack([np.eye(size), first, first @ first])


def _selections() -> tuple[FloatArray, FloatArray]:
    """From derivatives of Psi (order by angle x `ORDERS`) to a unit's and to the chain's answers.

    Right and left: d/dp_R = (d/dsum + d/ddifference) / P, d/dp_L = (d/dsum - d/ddifference) / P.
    """
    by_angle, by_pressure, n = 1.0 / ANGLE_SCALE, 1.0 / PRESSURE_SCALE, len(ORDERS)
    unit, total = np.zeros((4, 3 * n)), np.zeros((3 * n, 7))
    unit[0, n], unit[1, 2 * n] = by_angle, by_angle**2
    unit[2, [n + 1, n + 2]] = -by_angle * by_pressure
    unit[3, [n + 1, n + 2]] = by_angle * by_pressure, -by_angle * by_pressure
    total[[1, 2], 0] = -by_pressure
    total[[1, 2], 1] = by_pressure, -by_pressure
    total[[3, 4, 5], 2] = -np.array([1.0, 2.0, 1.0]) * by_pressure**2
    total[[3, 5], 3] = total[[3, 5], 4] = np.array([1.0, -1.0]) * by_pressure**2
    total[[3, 4, 5], 5] = -np.array([1.0, -2.0, 1.0]) * by_pressure**2
    total[0, 6] = 1.0
    return unit, total


def _continued(found: Response, angles: FloatArray, pressures: FloatArray) -> Response:
    """The answer beyond the range, by the Taylor polynomial of second order.

    found : at the nearest point inside; angles, pressures : from there to the state
    """
    moments = found.moments + found.stiffness * angles - pressures @ found.coupling
    volumes = found.volumes + found.coupling @ angles + found.compliance @ pressures
    energy = found.energy + (found.moments + moments) @ angles / 2 - (found.volumes + volumes) @ pressures / 2
    return Response(moments, found.stiffness, volumes, found.compliance, found.coupling, float(energy))
