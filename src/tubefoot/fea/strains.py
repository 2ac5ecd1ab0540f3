"""Strains C = F^T F at the quadrature points as unknowns of their own: sums over states (compiled)."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tubefoot.fea.material_point import deformation_gradient
from tubefoot.fea.ogden import FLAGS


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def add_strains(unknowns, slots, gradients, share, strains):  # type: ignore[no-untyped-def]
    """Add a share of the strain C = F^T F of some displacements to that of every quadrature point.

    unknowns : (n,); slots : (n_cells, 3 n_nodes) numbers of each cell's displacements
    gradients : (n_cells, n_q, n_nodes, 3); share : factor
    strains : (n_cells, n_q, 6) in and out, components 11, 22, 33, 12, 13, 23
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal, f = np.empty((n_nodes, 3)), np.empty((3, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[slots[cell, 3 * a + i]]
        for q in range(n_q):
            deformation_gradient(nodal, gradients[cell, q], f)
            for i in range(3):
                for j in range(i, 3):
                    value = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
                    strains[cell, q, i if i == j else i + j + 2] += share * value


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def replace_wild_strains(unknowns, slots, gradients, least, most, strains):  # type: ignore[no-untyped-def]
    """Take the strain of the displacements where a point's own has no J, or none within bounds.

    unknowns, slots, gradients, strains : see `add_strains`; least, most : bounds of J
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal, f = np.empty((n_nodes, 3)), np.empty((3, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[slots[cell, 3 * a + i]]
        for q in range(n_q):
            c = strains[cell, q]
            minor = c[0] * c[1] - c[3] * c[3]
            square = minor * c[2] - c[0] * c[5] * c[5] - c[1] * c[4] * c[4] + 2.0 * c[3] * c[4] * c[5]
            if c[0] > 0.0 and minor > 0.0 and least * least < square < most * most:
                continue
            deformation_gradient(nodal, gradients[cell, q], f)
            for i in range(3):
                for j in range(i, 3):
                    c[i if i == j else i + j + 2] = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
