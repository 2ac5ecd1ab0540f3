"""Strains C = F^T F at the quadrature points as unknowns of their own: sums over states (compiled)."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tubefoot.fea.material_point import deformation_gradient
from tubefoot.fea.ogden import FLAGS


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def displacements_of(unknowns, slots, nodal):  # type: ignore[no-untyped-def]
    """Write the displacements of a cell's nodes.

    unknowns : (n,); slots : (3 n_nodes,) their numbers; nodal : (n_nodes, 3) out
    """
    for a in range(nodal.shape[0]):
        for i in range(3):
            nodal[a, i] = unknowns[slots[3 * a + i]]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def strain_of(nodal, gradient, f, strain):  # type: ignore[no-untyped-def]
    """Write the strain C = F^T F of displacements at a point.

    nodal, gradient : (n_nodes, 3); f : (3, 3) out; strain : (6,) out, components 11, 22, 33, 12, 13, 23
    """
    deformation_gradient(nodal, gradient, f)
    for i in range(3):
        for j in range(i, 3):
            strain[i if i == j else i + j + 2] = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def add_strains(unknowns, slots, gradients, share, strains):  # type: ignore[no-untyped-def]
    """Add a share of the strain of some displacements to that of every quadrature point.

    unknowns : (n,); slots : (n_cells, 3 n_nodes) numbers of each cell's displacements
    gradients : (n_cells, n_q, n_nodes, 3); share : factor
    strains : (n_cells, n_q, 6) in and out, see `strain_of`
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal, f, strain = np.empty((n_nodes, 3)), np.empty((3, 3)), np.empty(6)
        displacements_of(unknowns, slots[cell], nodal)
        for q in range(n_q):
            strain_of(nodal, gradients[cell, q], f, strain)
            for k in range(6):
                strains[cell, q, k] += share * strain[k]


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def replace_wild_strains(unknowns, slots, gradients, least, most, strains):  # type: ignore[no-untyped-def]
    """Take the strain of the displacements where a point's own has no J, or none within bounds.

    unknowns, slots, gradients, strains : see `add_strains`; least, most : bounds of J
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal, f = np.empty((n_nodes, 3)), np.empty((3, 3))
        displacements_of(unknowns, slots[cell], nodal)
        for q in range(n_q):
            c = strains[cell, q]
            minor = c[0] * c[1] - c[3] * c[3]
            square = minor * c[2] - c[0] * c[5] * c[5] - c[1] * c[4] * c[4] + 2.0 * c[3] * c[4] * c[5]
            if c[0] > 0.0 and minor > 0.0 and least * least < square < most * most:
                continue
            strain_of(nodal, gradients[cell, q], f, c)
