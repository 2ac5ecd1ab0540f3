"""What a unit of the reduced finger answers to angle and pressures, one state at a time (compiled).

The energy of `reduced/law.py`, a sum over powers of the angle and of the pressures' difference and sum, with
its first and second derivatives.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE


@njit(cache=True)
def room_for_powers(pairs):  # type: ignore[no-untyped-def]
    """Where `unit_answer` keeps monomials of pressure difference and sum and their two derivatives.

    pairs : (2, n_pairs) exponents
    """
    return np.zeros((2, 3, 1 + pairs.max()))


@njit(cache=True)
def _powers(base, found):  # type: ignore[no-untyped-def]
    """Monomials of 0, 1, ... and their first and second derivatives, into (3, exponents)."""
    found[0, 0], found[1, 0], found[2, 0] = 1.0, 0.0, 0.0
    for k in range(1, found.shape[1]):
        found[0, k] = base * found[0, k - 1]
        found[1, k] = k * found[0, k - 1]
        found[2, k] = k * found[1, k - 1]


@njit(cache=True)
def unit_answer(table, pairs, limits, angle, right, left, powers, out):  # type: ignore[no-untyped-def]
    """Of one unit: moment, stiffness, coupling right and left, volumes, compliance rr, rl, ll into `out`
    (9,).

    table : (exponents of the angle, pairs); pairs : (2, n_pairs); limits : angle, low, high pressure
    angle : [rad]; right, left : [MPa]; out : (9,)
    powers : (2, 3, exponents) to work in, see `room_for_powers`

    Beyond the range the energy is continued by its second-order Taylor polynomial at the nearest point
    inside.
    """
    phi = min(max(angle, -limits[0]), limits[0])
    p_r = min(max(right, limits[1]), limits[2])
    p_l = min(max(left, limits[1]), limits[2])
    x = phi / ANGLE_SCALE
    _powers((p_r - p_l) / PRESSURE_SCALE, powers[0])
    _powers((p_r + p_l) / PRESSURE_SCALE, powers[1])
    m = k = md = ms = d = s = dd = ds = ss = 0.0
    for pair in range(pairs.shape[1]):
        p0 = p1 = p2 = 0.0
        for a in range(table.shape[0] - 1, -1, -1):
            p2 = p2 * x + 2.0 * p1
            p1 = p1 * x + p0
            p0 = p0 * x + table[a, pair]
        u, u1, u2 = powers[0, :, pairs[0, pair]]
        v, v1, v2 = powers[1, :, pairs[1, pair]]
        m += p1 * u * v
        k += p2 * u * v
        md += p1 * u1 * v
        ms += p1 * u * v1
        d += p0 * u1 * v
        s += p0 * u * v1
        dd += p0 * u2 * v
        ds += p0 * u1 * v1
        ss += p0 * u * v2
    ia, ip = 1.0 / ANGLE_SCALE, 1.0 / PRESSURE_SCALE
    out[0], out[1] = m * ia, k * ia * ia
    out[2], out[3] = -(ms + md) * ia * ip, -(ms - md) * ia * ip
    out[4], out[5] = -(s + d) * ip, -(s - d) * ip
    out[6], out[7], out[8] = (
        -(ss + 2 * ds + dd) * ip * ip,
        -(ss - dd) * ip * ip,
        -(ss - 2 * ds + dd) * ip * ip,
    )
    over, over_r, over_l = angle - phi, right - p_r, left - p_l
    if over != 0.0 or over_r != 0.0 or over_l != 0.0:
        out[0] += out[1] * over - out[2] * over_r - out[3] * over_l
        out[4] += out[2] * over + out[6] * over_r + out[7] * over_l
        out[5] += out[3] * over + out[7] * over_r + out[8] * over_l
