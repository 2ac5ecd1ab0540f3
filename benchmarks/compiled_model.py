"""The controller's picture of a bench compiled by Numba, for populations: `BenchModel` to rounding, faster.

The controller itself stays free of Numba, for bench laptops.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.control import bench_model as rows
from tubefoot.control.bench_model import BenchModel
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import ATMOSPHERE_MPA

FloatArray = NDArray[np.float64]


class CompiledBenchModel(BenchModel):
    """The same equations; only a step is compiled."""

    def __init__(self, finger: ReducedFinger, prony: Prony):
        super().__init__(finger, prony)
        self._pairs = finger.chain.pairs
        self._limits = (self._valid.angle, self._valid.pressure_low, self._valid.pressure_high)
        self._scales = (self._weight, self._rigid, self._loss)

    def step(self, state: FloatArray, duration: float, sent: FloatArray) -> FloatArray:
        """The states after a time, as `BenchModel.step` has them."""
        after = state.copy()
        self._pump(after, duration, sent)
        count = 0
        for _ in range(2):  # all guesses take as many Newton steps as the slowest one needs
            count = _step(
                state,
                after,
                duration,
                self._table,
                self._pairs,
                self._limits,
                self._scales,
                self._strengths[:, 0],
                self._times[:, 0],
                count,
            )
        return after


@njit(cache=True)
def _step(  # type: ignore[no-untyped-def]
    state, after, duration, table, pairs, limits, scales, strengths, times, least
):
    """Fill `after`, whose pump has moved already; the most Newton steps of a guess, at least `least`."""
    weight, rigid, loss_scale = scales
    terms, count = len(times), 0
    decay, gain, carried, found = np.empty(terms), np.empty(terms), np.empty(3), np.empty(10)
    for n in range(state.shape[1]):
        pace = np.exp(state[rows.PACE, n])
        instant = 1.0
        for k in range(terms):
            ratio = duration / (times[k] * pace)
            decay[k] = np.exp(-ratio)
            gain[k] = strengths[k] * (1.0 - decay[k]) / ratio
            instant += gain[k]
        for c in range(3):
            carried[c] = -(instant - 1.0) * state[rows.BEFORE + c, n]
            for k in range(terms):
                carried[c] += decay[k] * state[rows.OVER + c * terms + k, n]
        stiffness = np.exp(state[rows.STIFFNESS, n])
        spring = max(stiffness * state[rows.SPRING, n] - weight, -rows.SOFTEST * stiffness) * rigid
        loss = loss_scale * pace * stiffness * rigid / duration
        gas_r, gas_l = np.exp(state[rows.GAS_RIGHT, n]), np.exp(state[rows.GAS_LEFT, n])
        ease = np.exp(state[rows.TUBE, n]) / duration
        fluid = after[rows.PUMPED, n] + after[rows.AHEAD, n]
        phi_before = state[rows.PHI, n]
        was_r, was_l = state[rows.VOLUME_RIGHT, n], state[rows.VOLUME_LEFT, n]
        phi, right, left = phi_before, state[rows.RIGHT, n], state[rows.LEFT, n]
        soft = 1.0 / (instant * stiffness)
        by_phi = by_right = by_left = 0.0
        for iteration in range(1, rows.ITERATIONS + 1):
            _wall(table, pairs, limits, phi, (right - carried[0]) * soft, (left - carried[1]) * soft, found)
            moment, by_angle, v_r, v_l, c_r, c_l, rr, rl, ll, _unused = found
            top_r, top_l = right + ease * (v_r - was_r), left + ease * (v_l - was_l)
            space_r = ATMOSPHERE_MPA + max(top_r, -0.97 * ATMOSPHERE_MPA)
            space_l = ATMOSPHERE_MPA + max(top_l, -0.97 * ATMOSPHERE_MPA)
            spread_r = gas_r * ATMOSPHERE_MPA / space_r**2
            spread_l = gas_l * ATMOSPHERE_MPA / space_l**2
            wide_r, wide_l = 1.0 + spread_r * ease, 1.0 + spread_l * ease
            turn = stiffness * instant * moment + carried[2] + spring * phi + loss * (phi - phi_before)
            miss_r = v_r + gas_r * (1.0 - ATMOSPHERE_MPA / space_r) - fluid
            miss_l = v_l + gas_l * (1.0 - ATMOSPHERE_MPA / space_l) + fluid
            a00, a01, a02 = stiffness * instant * by_angle + spring + loss, -c_r, -c_l
            a10, a11, a12 = c_r * wide_r, rr * soft * wide_r + spread_r, rl * soft * wide_r
            a20, a21, a22 = c_l * wide_l, rl * soft * wide_l, ll * soft * wide_l + spread_l
            m0, m1, m2 = a11 * a22 - a12 * a21, a12 * a20 - a10 * a22, a10 * a21 - a11 * a20
            whole = a00 * m0 + a01 * m1 + a02 * m2
            by_phi = (
                turn * m0 + a01 * (a12 * miss_l - miss_r * a22) + a02 * (miss_r * a21 - a11 * miss_l)
            ) / whole
            by_right = (
                a00 * (miss_r * a22 - a12 * miss_l) + turn * m1 + a02 * (a10 * miss_l - miss_r * a20)
            ) / whole
            by_left = (
                a00 * (a11 * miss_l - miss_r * a21) + a01 * (miss_r * a20 - a10 * miss_l) + turn * m2
            ) / whole
            low_r, low_l = 0.5 * (right - ATMOSPHERE_MPA), 0.5 * (left - ATMOSPHERE_MPA)
            phi, right, left = phi - by_phi, max(right - by_right, low_r), max(left - by_left, low_l)
            count = max(count, iteration)
            if iteration >= least and max(abs(by_phi), abs(by_right), abs(by_left)) < rows.CLOSE:
                break
        _, _, v_r, v_l, c_r, c_l, rr, rl, ll, _unused = found
        turned, pressed_r, pressed_l = -by_phi, -by_right * soft, -by_left * soft
        after[rows.PHI, n], after[rows.RIGHT, n], after[rows.LEFT, n] = phi, right, left
        after[rows.VOLUME_RIGHT, n] = v_r + c_r * turned + rr * pressed_r + rl * pressed_l
        after[rows.VOLUME_LEFT, n] = v_l + c_l * turned + rl * pressed_r + ll * pressed_l
        held = (right, left, -(spring * phi + loss * (phi - phi_before)))
        for c in range(3):
            relaxed = (held[c] - carried[c]) / instant
            more = relaxed - state[rows.BEFORE + c, n]
            after[rows.BEFORE + c, n] = relaxed
            for k in range(terms):
                at = rows.OVER + c * terms + k
                after[at, n] = decay[k] * state[at, n] + gain[k] * more
    return count


@njit(cache=True)
def _wall(table, pairs, limits, phi, right, left, found):  # type: ignore[no-untyped-def]
    """What `BenchModel.answer` tells of one guess: moment, by angle, volumes, couplings, compliances."""
    angle, low, high = limits
    x = min(max(phi, -angle), angle) / ANGLE_SCALE
    right, left = min(max(right, low), high) / PRESSURE_SCALE, min(max(left, low), high) / PRESSURE_SCALE
    d, s = right - left, right + left
    most = 0
    for p in range(pairs.shape[1]):
        most = max(most, pairs[0, p], pairs[1, p])
    d_powers, s_powers = np.ones(most + 1), np.ones(most + 1)
    for i in range(most):
        d_powers[i + 1], s_powers[i + 1] = d_powers[i] * d, s_powers[i] * s
    moment = rigid = m_d = m_s = e_d = e_s = e_dd = e_ds = e_ss = 0.0
    for p in range(pairs.shape[1]):
        energy = slope = curve = 0.0
        for a in range(table.shape[0] - 1, -1, -1):
            curve = curve * x + 2.0 * slope
            slope = slope * x + energy
            energy = energy * x + table[a, p]
        i, j = pairs[0, p], pairs[1, p]
        f, g = d_powers[i], s_powers[j]
        f_d = i * d_powers[i - 1] if i > 0 else 0.0
        g_s = j * s_powers[j - 1] if j > 0 else 0.0
        f_dd = i * (i - 1) * d_powers[i - 2] if i > 1 else 0.0
        g_ss = j * (j - 1) * s_powers[j - 2] if j > 1 else 0.0
        moment += slope * f * g
        rigid += curve * f * g
        m_d += slope * f_d * g
        m_s += slope * f * g_s
        e_d += energy * f_d * g
        e_s += energy * f * g_s
        e_dd += energy * f_dd * g
        e_ds += energy * f_d * g_s
        e_ss += energy * f * g_ss
    found[0], found[1] = moment / ANGLE_SCALE, rigid / ANGLE_SCALE**2
    found[2], found[3] = (e_d + e_s) / -PRESSURE_SCALE, (e_s - e_d) / -PRESSURE_SCALE
    both = -(ANGLE_SCALE * PRESSURE_SCALE)
    found[4], found[5] = (m_d + m_s) / both, (m_s - m_d) / both
    square = -(PRESSURE_SCALE**2)
    found[6], found[7], found[8] = (
        (e_dd + 2.0 * e_ds + e_ss) / square,
        (e_ss - e_dd) / square,
        (e_dd - 2.0 * e_ds + e_ss) / square,
    )
    found[9] = 0.0
