"""The relaxing wall of a finger compiled by Numba, for the twin's thousand steps a second.

The same law as `tubefoot.reduced` (chain, scale, relaxation), which stays free of Numba for bench laptops;
a test holds the two against each other. Between two steps the angles do not change: their sums over the
units are made once, and each question for volumes is then one polynomial in the two pressures. Where
angle and pressure both are beyond the identified range, the two continue the energy differently in third
order.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE
from tubefoot.reduced.relaxation import Prony

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ORDERS = 6
"""Derivatives by pressure difference d and sum s: none, d, s, dd, ds, ss."""


class CompiledWall:
    """A finger's wall with memory: volumes asked for any number of times, then one step accepted."""

    def __init__(self, finger: ReducedFinger, prony: Prony):
        """Begin straight, at rest, relaxed.

        finger : the equilibrium law; prony : its relaxation
        """
        n, terms = finger.n_units, len(prony.strengths)
        self.n_units = n
        self.scale = finger.scale
        self._table, self._pairs = finger.chain.table, finger.chain.pairs
        valid = finger.valid
        self._limits = (valid.angle, valid.pressure_low, valid.pressure_high)
        self._strengths, self._times = np.array(prony.strengths), np.array(prony.times_s)
        self._duration, self._instant = -1.0, 1.0
        self._decay, self._gain = np.zeros(terms), np.zeros(terms)
        self._before, self._over = np.zeros(n + 2), np.zeros((terms, n + 2))
        self._carried = np.zeros(n + 2)
        self._summed = np.zeros(self._pairs.shape[1])
        self._angles = np.zeros(n)

    def prepare(self, angles: FloatArray, duration: float) -> None:
        """Get ready for a step from some angles.

        angles : (n,) [rad]; duration : of the step [s]
        """
        if duration != self._duration:
            ratio = duration / self._times
            self._decay = np.exp(-ratio)
            self._gain = -self._strengths * np.expm1(-ratio) / ratio
            self._instant = 1.0 + float(self._gain.sum())
            self._duration = duration
        prepare_step(
            self._table,
            angles,
            self._limits,
            self._summed,
            self._decay,
            self._instant,
            self._before,
            self._over,
            self._carried,
        )

    def volumes(self, right: float, left: float) -> tuple[float, float, float, float, float]:
        """Volume changes right and left at the prepared angles [mm^3], and their derivatives [mm^3/MPa].

        right, left : pressures at the end of the step [MPa]

        The derivatives: right by right, right by left and back, left by left.
        """
        return chamber_volumes(
            self._summed, self._pairs, right, left, self._carried, self._instant, self.scale, self._limits
        )

    def commit(
        self, angles: FloatArray, right: float, left: float, moments: FloatArray, stiffness: FloatArray
    ) -> None:
        """Accept the prepared step.

        angles : (n,) as prepared [rad]; right, left : pressures at its end [MPa]
        moments, stiffness : (n,) out: that hold the angles [N mm], their derivatives over the step [N mm/rad]
        """
        commit_step(
            self._table,
            self._pairs,
            angles,
            right,
            left,
            self.scale,
            self._limits,
            self._decay,
            self._gain,
            self._instant,
            self._before,
            self._over,
            self._carried,
            moments,
            stiffness,
        )

    def settle(self) -> None:
        """Forget the history: straight, at rest, relaxed."""
        self._before[:], self._over[:], self._duration = 0.0, 0.0, -1.0


@njit(cache=True)
def held(value, low, high):  # type: ignore[no-untyped-def]
    """The nearest value within two bounds.

    value : any; low, high : bounds
    """
    return min(max(value, low), high)


@njit(cache=True)
def prepare_step(  # type: ignore[no-untyped-def]
    table, angles, limits, summed, decay, instant, before, over, carried
):
    """Energy of all units as a polynomial in the pressures, and what the past adds.

    table : (3 laws, exponents of the angle, pairs); angles : (n,) [rad]; limits : angle, pressures
    summed : (n_pairs,) out; decay : (n_terms,); instant : fast over equilibrium modulus
    before : (n + 2,), over : (n_terms, n + 2) history; carried : (n + 2,) out
    """
    n, n_a = angles.shape[0], table.shape[1]
    summed[:] = 0.0
    for unit in range(n):
        inside = held(angles[unit], -limits[0], limits[0])
        x, beyond = inside / ANGLE_SCALE, (angles[unit] - inside) / ANGLE_SCALE
        power, slope = 1.0, 0.0
        for a in range(n_a):
            if a > 0:
                power, slope = power * x, slope * x + power
            factor = power + slope * beyond
            for law in range(3):
                if (law == 0) or (law == 1 and unit == 0) or (law == 2 and unit == n - 1):
                    for pair in range(summed.shape[0]):
                        summed[pair] += table[law, a, pair] * factor
    for k in range(n + 2):
        carried[k] = -(instant - 1.0) * before[k]
        for term in range(decay.shape[0]):
            carried[k] += decay[term] * over[term, k]


@njit(cache=True)
def scaled_pressures(right, left, carried, instant, scale, limits):  # type: ignore[no-untyped-def]
    """Equilibrium pressures of the unscaled wall: held within the range (2), and what lies beyond (2).

    right, left : actual pressures [MPa]; carried : what the past adds; instant : fast modulus over
        equilibrium; scale : stiffness of the wall; limits : angle, pressures
    """
    own_right = (right - carried[0]) / (instant * scale)
    own_left = (left - carried[1]) / (instant * scale)
    in_right, in_left = held(own_right, limits[1], limits[2]), held(own_left, limits[1], limits[2])
    return in_right, in_left, own_right - in_right, own_left - in_left


@njit(cache=True)
def pressure_derivatives(pairs, right, left):  # type: ignore[no-untyped-def]
    """Each pair's monomial and derivatives by d and s, (n_pairs, 6), in units of the pressure scale.

    pairs : (2, n_pairs) exponents; right, left : [MPa]
    """
    powers = np.ones((2, 1 + pairs.max()))
    for k in range(1, powers.shape[1]):
        powers[0, k] = powers[0, k - 1] * (right - left) / PRESSURE_SCALE
        powers[1, k] = powers[1, k - 1] * (right + left) / PRESSURE_SCALE
    found = np.empty((pairs.shape[1], ORDERS))
    for pair in range(pairs.shape[1]):
        b, c = pairs[0, pair], pairs[1, pair]
        d0, s0 = powers[0, b], powers[1, c]
        d1, s1 = b * powers[0, max(b - 1, 0)], c * powers[1, max(c - 1, 0)]
        d2 = b * (b - 1) * powers[0, max(b - 2, 0)]
        s2 = c * (c - 1) * powers[1, max(c - 2, 0)]
        found[pair, 0], found[pair, 1], found[pair, 2] = d0 * s0, d1 * s0, d0 * s1
        found[pair, 3], found[pair, 4], found[pair, 5] = d2 * s0, d1 * s1, d0 * s2
    return found


@njit(cache=True)
def chamber_volumes(  # type: ignore[no-untyped-def]
    summed, pairs, right, left, carried, instant, scale, limits
):
    """Volume changes right and left, then their derivatives: rr, rl, ll.

    summed : (n_pairs,) of `prepare_step`; pairs : (2, n_pairs); right, left : actual pressures [MPa]
    carried, instant, scale, limits : as for `scaled_pressures`
    """
    in_right, in_left, over_right, over_left = scaled_pressures(right, left, carried, instant, scale, limits)
    found = pressure_derivatives(pairs, in_right, in_left)
    sums = np.zeros(ORDERS)
    for pair in range(summed.shape[0]):
        for order in range(ORDERS):
            sums[order] += summed[pair] * found[pair, order]
    unit = 1.0 / PRESSURE_SCALE
    rr = -(sums[5] + 2.0 * sums[4] + sums[3]) * unit**2
    rl = -(sums[5] - sums[3]) * unit**2
    ll = -(sums[5] - 2.0 * sums[4] + sums[3]) * unit**2
    volume_right = -(sums[2] + sums[1]) * unit + rr * over_right + rl * over_left
    volume_left = -(sums[2] - sums[1]) * unit + rl * over_right + ll * over_left
    soft = 1.0 / (instant * scale)
    return volume_right, volume_left, rr * soft, rl * soft, ll * soft


@njit(cache=True)
def commit_step(  # type: ignore[no-untyped-def]
    table,
    pairs,
    angles,
    right,
    left,
    scale,
    limits,
    decay,
    gain,
    instant,
    before,
    over,
    carried,
    moments,
    stiffness,
):
    """Moments and stiffness of all units at the end of a step, and the history moved on.

    table, pairs : of the laws; angles : (n,) [rad]; right, left : actual pressures [MPa]
    scale, limits : of the wall
    decay, gain : (n_terms,) of the step; instant : fast over equilibrium modulus
    before, over : history, in and out; carried : (n + 2,) what the past adds
    moments, stiffness : (n,) out
    """
    n, n_a = angles.shape[0], table.shape[1]
    in_right, in_left, over_right, over_left = scaled_pressures(right, left, carried, instant, scale, limits)
    found = pressure_derivatives(pairs, in_right, in_left)
    by_law = np.zeros((3, n_a, 3))
    for law in range(3):
        for a in range(n_a):
            for pair in range(pairs.shape[1]):
                value = table[law, a, pair]
                for order in range(3):
                    by_law[law, a, order] += value * found[pair, order]
    now = np.empty(n + 2)
    now[0], now[1] = (right - carried[0]) / instant, (left - carried[1]) / instant
    for unit in range(n):
        inside = held(angles[unit], -limits[0], limits[0])
        x, beyond = inside / ANGLE_SCALE, angles[unit] - inside
        power, slope, bow = 1.0, 0.0, 0.0
        moment = rigid = by_d = by_s = 0.0
        for a in range(n_a):
            if a > 0:
                power, slope, bow = power * x, slope * x + power, bow * x + 2.0 * slope
            for law in range(3):
                if (law == 0) or (law == 1 and unit == 0) or (law == 2 and unit == n - 1):
                    moment += slope * by_law[law, a, 0]
                    rigid += bow * by_law[law, a, 0]
                    by_d += slope * by_law[law, a, 1]
                    by_s += slope * by_law[law, a, 2]
        rigid *= scale / ANGLE_SCALE**2
        pull = (by_s + by_d) * over_right + (by_s - by_d) * over_left
        now[unit + 2] = scale * (moment + pull / PRESSURE_SCALE) / ANGLE_SCALE + rigid * beyond
        moments[unit] = instant * now[unit + 2] + carried[unit + 2]
        stiffness[unit] = instant * rigid
    for k in range(n + 2):
        for term in range(decay.shape[0]):
            over[term, k] = decay[term] * over[term, k] + gain[term] * (now[k] - before[k])
        before[k] = now[k]
