"""A lean model of bench and finger for fits: hundreds of steps for a recording, compiled.

Leaner than the virtual bench by purpose, so that a fit of the one to the other proves something: no inertia,
weight as a linear spring of even bending, no sensors, one temperature, steps from hundredths of a second to
seconds. Units that have the same law have the same angle: at given pressures free units do not see each
other, so there are three kinds (base, inner, tip). Its equations are those of docs/theory.md, "Reduced
finger" and "Hydraulics of the bench":

    unit k      a M_1(phi_k, p_e) + what the past adds + (seam K_1 - w_k / g) phi_k + a K_1 T phi_k' = 0
    chamber     sum_k n_k V_k(phi_k, p_e) + B - B p0 / (p0 + p_c) = liquid that came in
    branch      liquid l_b = A - A p0 / (p0 + p_b),     flow into the chamber (p_b - p_c) / R

solved together at the end of each step by Newton's method, moments over the print's scale g (a, p_e:
instantaneous modulus and equilibrium pressure of the relaxing wall, `reduced/relaxation.py`; w_k: of the
weight above; T: loss of what relaxes faster than the shortest term). MPa, mm^3, s, rad; right, then left.

What relaxes follows in each step h the parabola through its ends and the beginning of the step before, k:

    x' = dx / h + 2 c (s / h - 1 / 2) (dx / h - dx_k / k),     0 < s < h,     c = h / (h + k)

On a straight course (c = 0) a step's end has the step's mean rate, a tenth too much for a wall that creeps
with the logarithm of time: 0.02 kPa in long holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.units import ATMOSPHERE_MPA, STANDARD_GRAVITY
from tubefoot.validation.unit_answer import room_for_powers, unit_answer

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-8
"""Of the last correction of the chamber pressures [MPa]."""
LEAST_VOLUME = 1e-4
"""Of the last correction of what leaked in a step [mm^3]."""
MOST_ITERATIONS = 60
LARGEST_TURN = 0.05
"""Of a unit in one iteration [rad]."""
LARGEST_GROWTH = 4.0
"""Of a step over the one before; after a shorter one it is taken as straight."""


@dataclass(frozen=True)
class BenchNumbers:
    """What a lean bench is made of.

    scale : of the wall's moduli; seam : bending stiffness that the bond adds, share of a unit's own
    air, bubble : right and left, in branches and chambers [mm^3]; resistance : of the tubes [MPa s/mm^3]
    leak : back through the pump [mm^3/(s MPa)]; fast_loss : T, of relaxation too fast for the terms [s]
    shares, times : relaxation over the long-term modulus [-], [s]; none for an elastic wall
    """

    scale: float
    seam: float
    air: tuple[float, float]
    bubble: tuple[float, float]
    resistance: float
    leak: float
    fast_loss: float
    shares: FloatArray
    times: FloatArray


@dataclass(frozen=True)
class Course:
    """What the lean bench did at the end of each step; index 0 is the start.

    branch, chamber : (n + 1, 2) gauge pressures [MPa]; bend : (n + 1,) of the tip [rad]
    """

    branch: FloatArray
    chamber: FloatArray
    bend: FloatArray


class LeanBench:
    """The law of a finger laid out for `simulate`."""

    def __init__(self, finger: ReducedFinger, tilt: float = 0.0):
        """Lay the laws out.

        finger : at scale one; tilt : of the straight finger against the vertical, 0 stands, pi hangs [rad]
        """
        inner, base, tip = finger.chain.table
        n = finger.n_units
        kinds = [inner + base + tip] if n == 1 else [inner, inner + base, inner + tip]
        self._tables = np.array(kinds)
        self._counts = np.array([1.0] if n == 1 else [n - 2.0, 1.0, 1.0])
        self._pairs = finger.chain.pairs
        valid = finger.valid
        self._limits = (valid.angle, valid.pressure_low, valid.pressure_high)
        self._stiffness = finger.unit_stiffness
        weights = np.cos(tilt) * toppling(finger)
        self._weights = (
            weights if n == 1 else np.array([weights[1:-1].mean() if n > 2 else 0.0, *weights[[0, -1]]])
        )
        self.n_units = n

    def simulate(self, durations: FloatArray, pumped: FloatArray, numbers: BenchNumbers) -> Course:
        """What pressures and bend become from rest.

        durations : (n,) of the steps [s]; pumped : (n,) volume that the rollers bring into the right branch
            [mm^3]
        numbers : what the bench is made of

        Raises ConvergenceError when no pressures satisfy the balance.
        """
        found = np.zeros((len(durations) + 1, 5))
        failed = _run(
            durations,
            pumped,
            self._tables,
            self._counts,
            self._pairs,
            self._limits,
            self._stiffness,
            numbers.seam,
            self._weights,
            numbers.scale,
            np.array([*numbers.air, *numbers.bubble, numbers.resistance, numbers.leak, numbers.fast_loss]),
            numbers.shares,
            numbers.times,
            found,
        )
        if failed >= 0:
            raise ConvergenceError(
                f"the lean bench found no balance in step {failed} of {len(durations)}: "
                f"scale {numbers.scale:.3g}, air {numbers.air[0]:.3g} and {numbers.air[1]:.3g} mm3"
            )
        return Course(found[:, 0:2], found[:, 2:4], found[:, 4])


def toppling(finger: ReducedFinger) -> FloatArray:
    """Moment of the weight on each hinge for each radian that all units are bent, upright, (n,) [N mm/rad].

    finger : gives lengths and masses
    """
    n = finger.n_units
    masses = np.full(n, finger.unit_mass)
    masses[-1] += finger.cap_mass - 0.5 * finger.unit_mass
    lengths = np.full(n, finger.pitch)
    lengths[-1] = 0.5 * finger.pitch + finger.cap
    above = np.cumsum(masses[::-1])[::-1]
    loads = STANDARD_GRAVITY * lengths * (above - 0.5 * masses)
    reach = np.arange(1.0, n + 1.0) * loads
    return np.asarray(np.cumsum(reach[::-1])[::-1])


@njit(cache=True)
def _flow(pressure, air, liquid, supply, resistance, duration):  # type: ignore[no-untyped-def]
    """Flow into a chamber at a step's end, its change with the chamber's pressure, the branch's pressure and
    its change with the supply; see twin.hydraulics.
    """
    ease = duration / resistance
    half = 0.5 * (air - liquid - supply - ease * (ATMOSPHERE_MPA + pressure))
    root = sqrt(half * half + ease * air * ATMOSPHERE_MPA)
    absolute = air * ATMOSPHERE_MPA / (half + root) if half > 0 else (root - half) / ease
    stiffening = absolute / (2.0 * root)
    branch = absolute - ATMOSPHERE_MPA
    return (branch - pressure) / resistance, (ease * stiffening - 1.0) / resistance, branch, stiffening


@njit(cache=True)
def _memory(step, curve, shares, times, decay, gain, bow):  # type: ignore[no-untyped-def]
    """What each term keeps over a step, gains by a change, and by what of it the step before did not
    foretell, into (n_terms,) each.

    step : [s]; curve : c of the module's formula; shares, times : (n_terms,), [s]
    """
    for term in range(shares.shape[0]):
        ratio = step / times[term]
        decay[term] = np.exp(-ratio)
        gain[term] = -shares[term] * np.expm1(-ratio) / ratio
        bow[term] = 2.0 * curve * (gain[term] * (0.5 - 1.0 / ratio) + shares[term] * decay[term] / ratio)


@njit(cache=True)
def _run(  # type: ignore[no-untyped-def]
    durations, pumped, tables, counts, pairs, limits, own, seam, weights, scale, fluid, shares, times, found
):
    """March through all steps; the number of the one that failed, or -1.

    found : (n + 1, 5) out: branch right, left, chamber right, left [MPa], bend [rad]
    """
    n_kinds, n_terms = tables.shape[0], shares.shape[0]
    angles, start = np.zeros(n_kinds), np.zeros(n_kinds)
    elastic = seam * own - weights / scale
    before, over = np.zeros(n_kinds + 2), np.zeros((n_terms, n_kinds + 2))
    carried, now = np.zeros(n_kinds + 2), np.zeros(n_kinds + 2)
    rates, turning = np.zeros(n_kinds + 2), np.zeros(n_kinds)
    decay, gain, bow = np.zeros(n_terms), np.zeros(n_terms), np.zeros(n_terms)
    answer, turn, stiff = np.zeros((n_kinds, 9)), np.zeros(n_kinds), np.zeros(n_kinds)
    in_branch, in_chamber = np.zeros(2), np.zeros(2)
    chamber, branch, flow, ease = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    resistance, leak = fluid[4], fluid[5]
    powers = room_for_powers(pairs)
    h = 0.0
    for step in range(durations.shape[0]):
        last, h = h, durations[step]
        curve = h / (h + last) if h <= LARGEST_GROWTH * last else 0.0
        _memory(h, curve, shares, times, decay, gain, bow)
        instant = 1.0 + gain.sum() + bow.sum()
        for j in range(n_kinds + 2):
            carried[j] = -(instant - 1.0) * before[j] - bow.sum() * h * rates[j]
            for term in range(n_terms):
                carried[j] += decay[term] * over[term, j]
        # The leak takes the mean of its drive at both ends of the step; its end is part of the balance.
        drive, leaked = branch[0] - branch[1], h * leak * (branch[0] - branch[1])
        soft = 1.0 / (instant * scale)
        dash = fluid[6] * (1.0 + shares.sum()) * own * (1.0 + curve) / h
        start[:] = angles
        foretold = curve / (1.0 + curve) * h * turning
        done = False
        for _ in range(MOST_ITERATIONS):
            e_r, e_l = (chamber[0] - carried[0]) * soft, (chamber[1] - carried[1]) * soft
            miss_r = miss_l = rr = rl = ll = 0.0
            for k in range(n_kinds):
                unit_answer(tables[k], pairs, limits, angles[k], e_r, e_l, powers, answer[k])
                a, count = answer[k], counts[k]
                stiff[k] = instant * a[1] + elastic[k] + dash
                force = instant * a[0] + carried[k + 2] + elastic[k] * angles[k]
                turn[k] = -(force + dash * (angles[k] - start[k] - foretold[k])) / stiff[k]
                miss_r += count * (a[4] + a[2] * turn[k])
                miss_l += count * (a[5] + a[3] * turn[k])
                rr += count * (a[6] * soft + a[2] * a[2] / (scale * stiff[k]))
                rl += count * (a[7] * soft + a[2] * a[3] / (scale * stiff[k]))
                ll += count * (a[8] * soft + a[3] * a[3] / (scale * stiff[k]))
            back, give = leaked - 0.5 * h * leak * drive, 1.0
            for i in range(2):
                supply = pumped[step] - leaked if i == 0 else leaked - pumped[step]
                flow[i], ease[i], end, stiffening = _flow(
                    chamber[i], fluid[i], in_branch[i], supply, resistance, h
                )
                back -= 0.5 * h * leak * (end if i == 0 else -end)
                give += 0.5 * h * leak * stiffening
            gas_r = fluid[2] * ATMOSPHERE_MPA / (ATMOSPHERE_MPA + chamber[0])
            gas_l = fluid[3] * ATMOSPHERE_MPA / (ATMOSPHERE_MPA + chamber[1])
            miss_r += fluid[2] - gas_r - in_chamber[0] - h * flow[0]
            miss_l += fluid[3] - gas_l - in_chamber[1] - h * flow[1]
            rr += gas_r / (ATMOSPHERE_MPA + chamber[0]) - h * ease[0]
            ll += gas_l / (ATMOSPHERE_MPA + chamber[1]) - h * ease[1]
            det = rr * ll - rl * rl
            by_r, by_l = -(miss_r * ll - miss_l * rl) / det, -(miss_l * rr - miss_r * rl) / det
            by_r = max(by_r, -0.5 * (chamber[0] + ATMOSPHERE_MPA))
            by_l = max(by_l, -0.5 * (chamber[1] + ATMOSPHERE_MPA))
            largest = 0.0
            for k in range(n_kinds):
                turn[k] += (answer[k, 2] * by_r + answer[k, 3] * by_l) / (scale * stiff[k])
                turn[k] = min(max(turn[k], -LARGEST_TURN), LARGEST_TURN)
                angles[k] += turn[k]
                largest = max(largest, abs(turn[k]))
            chamber[0] += by_r
            chamber[1] += by_l
            leaked -= back / give
            if max(abs(by_r), abs(by_l)) < TOLERANCE and largest < 1e-6 and abs(back) < LEAST_VOLUME:
                done = True
                break
        if not done:
            return step
        for i in range(2):
            supply = pumped[step] - leaked if i == 0 else leaked - pumped[step]
            flow[i] = _flow(chamber[i], fluid[i], in_branch[i], supply, resistance, h)[0]
            in_chamber[i] += h * flow[i]
            in_branch[i] += supply - h * flow[i]
            branch[i] = ATMOSPHERE_MPA * (fluid[i] / (fluid[i] - in_branch[i]) - 1.0)
        e_r, e_l = (chamber[0] - carried[0]) / instant, (chamber[1] - carried[1]) / instant
        now[0], now[1] = e_r, e_l
        bend = 0.0
        for k in range(n_kinds):
            unit_answer(tables[k], pairs, limits, angles[k], e_r / scale, e_l / scale, powers, answer[k])
            now[k + 2] = answer[k, 0]
            turning[k] = (angles[k] - start[k]) / h
            bend += counts[k] * angles[k]
        for j in range(n_kinds + 2):
            change = now[j] - before[j]
            for term in range(n_terms):
                gained = gain[term] * change + bow[term] * (change - h * rates[j])
                over[term, j] = decay[term] * over[term, j] + gained
            rates[j], before[j] = change / h, now[j]
        found[step + 1, 0], found[step + 1, 1] = branch[0], branch[1]
        found[step + 1, 2], found[step + 1, 3] = chamber[0], chamber[1]
        found[step + 1, 4] = bend
    return -1
