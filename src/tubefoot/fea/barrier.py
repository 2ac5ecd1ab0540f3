"""The barrier between two walls at one place: its energy, residual and tangent (compiled).

A point x of a wall with unit normal n meets a facet X(s, t) at the gap g. With F = x + g n - X(s, t) = 0
solved for z = (g, s, t), J = dF/dz, a the first row of its inverse,

    z_u = -J^-1 F_u,   g_uv = -a . (g_u n_v + g_v n_u + g n_uv - second derivatives of X),

so residual and tangent are those of the energy w(g) = k / (3 d) max(0, d - g)^3 per undeformed area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.fea.proximity import gap_along

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Barrier:
    """How two walls repel each other.

    reach : gap from which on they do [mm]
    stiffness : k [N/mm^3]; at zero gap the pressure is k * reach
    depth : penetration up to which a partner is looked for [mm], less than the thinnest wall
    ahead : gap up to which possible partners are prepared for [mm]
    """

    reach: float = 0.1
    stiffness: float = 3.0
    depth: float = 0.6
    ahead: float = 1.2

    def pressure(self, gap: FloatArray) -> FloatArray:
        """Contact pressure [MPa] at some gaps.

        gap : [mm]
        """
        return self.stiffness / self.reach * np.maximum(0.0, self.reach - gap) ** 2


@njit(cache=True, error_model="numpy")
def cross(a, b, out):  # type: ignore[no-untyped-def]
    """Write the vector product of two vectors.

    a, b : (3,); out : (3,) out
    """
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = a[j] * b[k] - a[k] * b[j]


@njit(cache=True, error_model="numpy")
def add_contact(  # type: ignore[no-untyped-def]
    gap, tangents, surface, own, other, weight, barrier, rates, turns, residual, matrix
):
    """Add a sample's energy to an element of its own facet's nodes and the other's; the energy [mJ].

    gap : below the reach; tangents : (2, 3) of the own facet; surface : (6, 3) of `surface_at`
    own, other : (3, n) shape functions and their slopes at the sample and opposite
    weight : undeformed area [mm^2]; barrier : (reach, stiffness)
    rates : (6, 6 n), turns : (3, 6 n) scratch; residual : (6 n,), matrix : (6 n, 6 n) in and out
    """
    reach, stiffness = barrier
    n = own.shape[1]
    size = 3 * n
    excess = reach - gap
    first = -weight * stiffness / reach * excess * excess
    second = 2.0 * weight * stiffness / reach * excess
    normal, dual = np.empty(3), np.empty((3, 3))
    cross(tangents[0], tangents[1], normal)
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    normal /= length
    cross(surface[1], surface[2], dual[0])
    cross(normal, surface[2], dual[1])
    cross(surface[1], normal, dual[2])
    dual /= normal[0] * dual[0, 0] + normal[1] * dual[0, 1] + normal[2] * dual[0, 2]
    a = dual[0]
    # Rates by each unknown: g, s, t; a . n; the logarithm of |c|, c the area vector; turns: n itself.
    rates[:] = 0.0
    turns[:] = 0.0
    unit, change = np.empty(3), np.empty(3)
    for node in range(n):
        for i in range(3):
            p = 3 * node + i
            for m in range(3):
                unit[m] = own[1, node] * tangents[1, m] - own[2, node] * tangents[0, m]
            # e_i x unit
            j, k = (i + 1) % 3, (i + 2) % 3
            change[i], change[j], change[k] = 0.0, -unit[k], unit[j]
            along = (normal[0] * change[0] + normal[1] * change[1] + normal[2] * change[2]) / length
            rates[4, p] = along
            for m in range(3):
                turns[m, p] = change[m] / length - along * normal[m]
                rates[3, p] += a[m] * turns[m, p]
            for z in range(3):
                value = own[0, node] * dual[z, i]
                for m in range(3):
                    value += gap * dual[z, m] * turns[m, p]
                rates[z, p] = -value
                rates[z, size + p] = other[0, node] * dual[z, i]
    across, bent = np.empty(3), np.empty((2, 2))
    for m in range(3):
        across[m] = (a[m] - normal[m]) / length
    bent[0, 0] = a[0] * surface[3, 0] + a[1] * surface[3, 1] + a[2] * surface[3, 2]
    bent[0, 1] = a[0] * surface[4, 0] + a[1] * surface[4, 1] + a[2] * surface[4, 2]
    bent[1, 0] = bent[0, 1]
    bent[1, 1] = a[0] * surface[5, 0] + a[1] * surface[5, 1] + a[2] * surface[5, 2]
    for p in range(2 * size):
        residual[p] += first * rates[0, p]
        node_p, i = (p % size) // 3, p % 3
        for q in range(2 * size):
            node_q, j = (q % size) // 3, q % 3
            value = rates[0, p] * rates[3, q] + rates[0, q] * rates[3, p]
            if p < size and q < size:
                twist = 0.0
                if i != j:
                    sign = 1.0 if (i + 1) % 3 == j else -1.0
                    slopes = own[1, node_p] * own[2, node_q] - own[1, node_q] * own[2, node_p]
                    twist = sign * slopes * across[3 - i - j]
                turning = turns[0, p] * turns[0, q] + turns[1, p] * turns[1, q] + turns[2, p] * turns[2, q]
                mixed = rates[4, q] * rates[3, p] + rates[4, p] * rates[3, q]
                value += gap * (twist - mixed - turning)
            for s in range(2):
                if q >= size:
                    value -= rates[1 + s, p] * other[1 + s, node_q] * a[j]
                if p >= size:
                    value -= rates[1 + s, q] * other[1 + s, node_p] * a[i]
                for t in range(2):
                    value -= bent[s, t] * rates[1 + s, p] * rates[1 + t, q]
            matrix[p, q] += second * rates[0, p] * rates[0, q] - first * value
    return weight * stiffness / (3.0 * reach) * excess**3


@njit(cache=True, error_model="numpy")
def assemble_contacts(  # type: ignore[no-untyped-def]
    points,
    tangents,
    weights,
    which,
    facet,
    row,
    places,
    gaps,
    powers,
    coefficients,
    polynomials,
    own_shapes,
    barrier,
    residuals,
    matrices,
):
    """The energy [mJ] of all contacts of a sample with a facet; nan where a facet got lost.

    points : (n, 3), tangents : (n, 2, 3), weights : (n,) [mm^2] of each contact's sample
    which : (n,) number of the sample in its facet; facet : (n,) the facet opposite
    row : (n,) element of the pair; places : (n, 2) in and out; gaps : (n,) out
    powers, coefficients : see `facet_powers`; polynomials : (n_facets, n_monomials, 3)
    own_shapes : (n_q, 3, n_nodes) shape functions and slopes of the samples in a facet
    barrier : (reach, stiffness)
    residuals : (n_pairs, 6 n_nodes), matrices : (n_pairs, 6 n_nodes, 6 n_nodes) out
    """
    residuals[:] = 0.0
    matrices[:] = 0.0
    n = own_shapes.shape[2]
    surface, normal = np.empty((6, 3)), np.empty(3)
    basis, shapes = np.empty((powers.shape[0], 3)), np.empty((3, n))
    rates, turns = np.empty((6, 6 * n)), np.empty((3, 6 * n))
    total = 0.0
    for contact in range(points.shape[0]):
        other = facet[contact]
        place = places[contact]
        cross(tangents[contact, 0], tangents[contact, 1], normal)
        normal /= np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        gap = gap_along(powers, polynomials[other], points[contact], normal, place, surface)
        gaps[contact] = gap
        if np.isnan(gap):
            return np.nan
        if gap >= barrier[0]:
            continue
        s, t = place
        for m in range(powers.shape[0]):
            a, b = powers[m]
            basis[m, 0] = s**a * t**b
            basis[m, 1] = a * s ** max(a - 1, 0) * t**b
            basis[m, 2] = s**a * b * t ** max(b - 1, 0)
        for k in range(3):
            for c in range(n):
                shapes[k, c] = 0.0
                for m in range(powers.shape[0]):
                    shapes[k, c] += basis[m, k] * coefficients[m, c]
        total += add_contact(
            gap,
            tangents[contact],
            surface,
            own_shapes[which[contact]],
            shapes,
            weights[contact],
            barrier,
            rates,
            turns,
            residuals[row[contact]],
            matrices[row[contact]],
        )
    return total
