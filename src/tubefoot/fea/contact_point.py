"""One contact: the energy of a sample and a facet opposite, residual and tangent (compiled).

A point x of a wall with unit normal n meets a facet X(s, t) at the length l. With F = x + l n - X(s, t) = 0
solved for z = (l, s, t), J = dF/dz, a the first row of its inverse,

    z_u = -J^-1 F_u,   l_uv = -a . (l_u n_v + l_v n_u + l n_uv - second derivatives of X),

so residual and tangent are exactly those of the energy E(l, s, t, c) of `fading`. With the other rows, s_uv
and t_uv, which the weights need, have the same form: one vector `pulled` stands for all.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tubefoot.fea.fading import add_fading, add_tilts, cross, dot, faded, times_axis, turn_of_area


@njit(cache=True, error_model="numpy")
def add_contact(  # type: ignore[no-untyped-def]
    gap,
    tangents,
    surface,
    own,
    other,
    placing,
    weight,
    barrier,
    fade,
    stiff,
    rates,
    turns,
    tilts,
    residual,
    matrix,
):
    """Add a sample's energy to an element of both facets' nodes; the energy [mJ] and its weight by the angle.

    gap : below the reach, see `gap_along`; tangents : (2, 3) of the own facet
    surface : (8, 3), see `assemble_contacts`
    own : (3, n) shape functions and their slopes at the sample; other : (6, n) opposite, up to second slopes
    placing : (6,) of `placed`; weight : undeformed area [mm^2]; barrier : (reach, stiffness)
    fade : see `faded`, or UNFADED; stiff : whether the matrix is wanted
    rates : (8, 6 n), turns, tilts : (3, 6 n) scratch; residual : (6 n,), matrix : (6 n, 6 n) in and out
    """
    reach, stiffness = barrier
    n = own.shape[1]
    size = 3 * n
    excess = reach - gap
    energy = weight * stiffness / (3.0 * reach) * excess**3
    push = -weight * stiffness / reach * excess * excess
    firm = 2.0 * weight * stiffness / reach * excess
    normal, dual = np.empty(3), np.empty((3, 3))
    cross(tangents[0], tangents[1], normal)
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    normal /= length
    facing = np.empty(3)
    cross(surface[1], surface[2], facing)
    area = np.sqrt(facing[0] ** 2 + facing[1] ** 2 + facing[2] ** 2)
    dual[0] = facing
    facing /= area
    cosine = -(normal[0] * facing[0] + normal[1] * facing[1] + normal[2] * facing[2])
    share, slope, bend = faded(cosine, fade)
    if share == 0.0 or placing[0] == 0.0:
        return 0.0, 0.0
    # w's derivatives by the length along the normal and, where the gap is the length times it, the cosine.
    to_plane = fade[1] > -1.0
    sight, times = (gap / cosine, cosine) if to_plane else (gap, 1.0)
    first, second = np.zeros(2), np.zeros((2, 2))
    first[0], second[0, 0] = times * push, times * times * firm
    if to_plane:
        first[1], second[1, 1] = sight * push, sight * sight * firm
        second[0, 1] = push + sight * cosine * firm
    # Derivatives of the energy by l, s, t and the cosine, first and second.
    by, by_both = np.empty(4), np.empty((4, 4))
    by[0], by[3] = placing[0] * share * first[0], placing[0] * (slope * energy + share * first[1])
    by_both[0, 0] = placing[0] * share * second[0, 0]
    by_both[3, 3] = placing[0] * (bend * energy + 2.0 * slope * first[1] + share * second[1, 1])
    by_both[0, 3] = by_both[3, 0] = placing[0] * (slope * first[0] + share * second[0, 1])
    for z in range(2):
        by[1 + z] = placing[1 + z] * share * energy
        by_both[0, 1 + z] = by_both[1 + z, 0] = placing[1 + z] * share * first[0]
        by_both[3, 1 + z] = by_both[1 + z, 3] = placing[1 + z] * (slope * energy + share * first[1])
        by_both[1 + z, 1 + z] = placing[3 + 2 * z] * share * energy
    by_both[1, 2] = by_both[2, 1] = placing[4] * share * energy
    cross(normal, surface[2], dual[1])
    cross(surface[1], normal, dual[2])
    dual /= normal[0] * dual[0, 0] + normal[1] * dual[0, 1] + normal[2] * dual[0, 2]
    # Changes of the other facet's area vector with s and t, and of the cosine with that vector.
    along_s, along_t, by_area = np.zeros(3), np.zeros(3), np.zeros(3)
    pulled = by[0] * dual[0] + by[1] * dual[1] + by[2] * dual[2]
    if to_plane:
        turn_of_area(surface, along_s, along_t)
        for m in range(3):
            by_area[m] = -(normal[m] + cosine * facing[m]) / area
        of_s, of_t = dot(by_area, along_s), dot(by_area, along_t)
        for m in range(3):
            pulled[m] += by[3] * (of_s * dual[1, m] + of_t * dual[2, m])
    # What the second derivative of the normal is multiplied with.
    bent_normal = -sight * pulled
    if to_plane:
        bent_normal -= by[3] * facing
    straight = dot(bent_normal, normal)
    # Rates by each unknown: l, s, t; bent_normal . n; the logarithm of |c|, c the area vector; pulled . n;
    # the cosine; turns: n itself, tilts: the other facet's area vector.
    rates[:] = 0.0
    turns[:] = 0.0
    tilts[:] = 0.0
    unit, change = np.empty(3), np.empty(3)
    for node in range(n):
        for i in range(3):
            p = 3 * node + i
            for m in range(3):
                unit[m] = own[1, node] * tangents[1, m] - own[2, node] * tangents[0, m]
            times_axis(i, unit, change)
            along = dot(normal, change) / length
            rates[4, p] = along
            for m in range(3):
                turns[m, p] = change[m] / length - along * normal[m]
                rates[3, p] += bent_normal[m] * turns[m, p]
                rates[5, p] += pulled[m] * turns[m, p]
            for z in range(3):
                value = own[0, node] * dual[z, i]
                for m in range(3):
                    value += sight * dual[z, m] * turns[m, p]
                rates[z, p] = -value
                rates[z, size + p] = other[0, node] * dual[z, i]
    if to_plane:
        add_tilts(surface, other, along_s, along_t, rates, tilts)
        for p in range(2 * size):
            for m in range(3):
                rates[6, p] += by_area[m] * tilts[m, p] - facing[m] * turns[m, p]
    for p in range(2 * size):
        residual[p] += by[0] * rates[0, p] + by[1] * rates[1, p] + by[2] * rates[2, p] + by[3] * rates[6, p]
    if not stiff:
        return placing[0] * share * energy, share
    across, bent = np.empty(3), np.empty((2, 2))
    for m in range(3):
        across[m] = (bent_normal[m] - straight * normal[m]) / length
    bent[0, 0] = dot(pulled, surface[3])
    bent[0, 1] = bent[1, 0] = dot(pulled, surface[4])
    bent[1, 1] = dot(pulled, surface[5])
    pushed = np.empty(4)
    for p in range(2 * size):
        for z in range(4):
            pushed[z] = (
                by_both[z, 0] * rates[0, p]
                + by_both[z, 1] * rates[1, p]
                + by_both[z, 2] * rates[2, p]
                + by_both[z, 3] * rates[6, p]
            )
        node_p, i = (p % size) // 3, p % 3
        for q in range(2 * size):
            node_q, j = (q % size) // 3, q % 3
            value = rates[0, p] * rates[5, q] + rates[0, q] * rates[5, p]
            for s in range(2):
                if q >= size:
                    value -= rates[1 + s, p] * other[1 + s, node_q] * pulled[j]
                if p >= size:
                    value -= rates[1 + s, q] * other[1 + s, node_p] * pulled[i]
                for t in range(2):
                    value -= bent[s, t] * rates[1 + s, p] * rates[1 + t, q]
            value = (
                pushed[0] * rates[0, q]
                + pushed[1] * rates[1, q]
                + pushed[2] * rates[2, q]
                + pushed[3] * rates[6, q]
                - value
            )
            if p < size and q < size:
                if i != j:
                    sign = 1.0 if (i + 1) % 3 == j else -1.0
                    slopes = own[1, node_p] * own[2, node_q] - own[1, node_q] * own[2, node_p]
                    value += sign * slopes * across[3 - i - j]
                turning = turns[0, p] * turns[0, q] + turns[1, p] * turns[1, q] + turns[2, p] * turns[2, q]
                value -= rates[4, q] * rates[3, p] + rates[4, p] * rates[3, q] + straight * turning
            matrix[p, q] += value
    if to_plane:
        add_fading(
            surface,
            other,
            normal,
            facing,
            area,
            cosine,
            by_area,
            by[3],
            rates,
            turns,
            tilts,
            matrix,
        )
    return placing[0] * share * energy, share
