"""The barrier between two walls, w(g) = k / (3 d) max(0, d - g)^3 per undeformed area, summed (compiled).

What one sample and the facet opposite add is `contact_point`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.fea.contact_point import add_contact
from tubefoot.fea.fading import cross, placed
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
    stiffness: float = 12.0
    depth: float = 0.6
    ahead: float = 1.2

    def pressure(self, gap: FloatArray) -> FloatArray:
        """Contact pressure [MPa] at some gaps.

        gap : [mm]
        """
        return self.stiffness / self.reach * np.maximum(0.0, self.reach - gap) ** 2


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
    edges,
    zones,
    fade,
    stiff,
    residuals,
    matrices,
):
    """The energy [mJ] of all contacts, and the smallest gap of those that count; nan where a facet got lost.

    points : (n, 3), tangents : (n, 2, 3), weights : (n,) [mm^2] of each contact's sample
    which : (n,) number of the sample in its facet; facet : (n,) the facet opposite
    row : (n,) element of the pair; places : (n, 2) in and out; gaps : (n,) out
    powers, coefficients : see `facet_powers`; polynomials : (n_facets, n_monomials, 3)
    own_shapes : (n_q, 3, n_nodes) shape functions and slopes of the samples in a facet
    barrier : (reach, stiffness); edges : see `placed`, and zones : (n_facets, n_edges, 2)
    fade : see `add_contact`
    stiff : whether the matrices are wanted
    residuals : (n_pairs, 6 n_nodes), matrices : (n_pairs, 6 n_nodes, 6 n_nodes) out
    """
    residuals[:] = 0.0
    if stiff:
        matrices[:] = 0.0
    n = own_shapes.shape[2]
    # X and its derivatives by s, t, ss, st, tt, sst, stt at the places opposite.
    surface, normal = np.empty((8, 3)), np.empty(3)
    placing = np.empty(6)
    basis, shapes = np.empty((powers.shape[0], 6)), np.empty((6, n))
    rates, turns, tilts = np.empty((8, 6 * n)), np.empty((3, 6 * n)), np.empty((3, 6 * n))
    total, deepest = 0.0, np.inf
    to_plane = fade[1] > -1.0  # not UNFADED
    for contact in range(points.shape[0]):
        other = facet[contact]
        place = places[contact]
        cross(tangents[contact, 0], tangents[contact, 1], normal)
        normal /= np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        gap = gap_along(powers, polynomials[other], points[contact], normal, to_plane, place, surface[:6])
        gaps[contact] = gap
        if np.isnan(gap):
            return np.nan, np.nan
        if gap >= barrier[0]:
            deepest = min(deepest, gap)
            continue
        s, t = place
        placed(s, t, edges, zones[other], placing)
        if placing[0] == 0.0:
            continue
        surface[6:] = 0.0
        for m in range(powers.shape[0]):
            a, b = powers[m]
            basis[m, 0] = s**a * t**b
            basis[m, 1] = a * s ** max(a - 1, 0) * t**b
            basis[m, 2] = s**a * b * t ** max(b - 1, 0)
            basis[m, 3] = a * (a - 1) * s ** max(a - 2, 0) * t**b
            basis[m, 4] = a * s ** max(a - 1, 0) * b * t ** max(b - 1, 0)
            basis[m, 5] = s**a * b * (b - 1) * t ** max(b - 2, 0)
            for i in range(3):
                p = polynomials[other, m, i]
                surface[6, i] += a * (a - 1) * s ** max(a - 2, 0) * b * t ** max(b - 1, 0) * p
                surface[7, i] += a * s ** max(a - 1, 0) * b * (b - 1) * t ** max(b - 2, 0) * p
        for k in range(6):
            for c in range(n):
                shapes[k, c] = 0.0
                for m in range(powers.shape[0]):
                    shapes[k, c] += basis[m, k] * coefficients[m, c]
        energy, share = add_contact(
            gap,
            tangents[contact],
            surface,
            own_shapes[which[contact]],
            shapes,
            placing,
            weights[contact],
            barrier,
            fade,
            stiff,
            rates,
            turns,
            tilts,
            residuals[row[contact]],
            matrices[row[contact]],
        )
        total += energy
        if share > 0.5 and placing[0] >= 0.25:
            deepest = min(deepest, gap)
    return total, deepest
