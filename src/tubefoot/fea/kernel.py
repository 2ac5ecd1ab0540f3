"""The solid element: energy, residual and tangent of one block of cells (compiled, parallel over cells).

Two-field energy with the pressure p as an independent field,

    Pi = int W(F) + k0 (J - 1 - ln J) + g / 4 (J - 1)^4 + p (J - 1) - p^2 / (2 k1) dV,   k0 + k1 = kappa,

stationary in displacement and pressure; k0 is a small share of the bulk modulus and g guards J where the
pressure space is blind (see `solid`). A displacement element has k0 = kappa, g = 0. Unknowns of the cell that
no neighbour shares (the interior node, a discontinuous pressure) are eliminated by symmetric elimination
without pivoting: the pressure block is -M / k1, never singular.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tubefoot.fea.material_point import cofactor, deformation_gradient, material_point
from tubefoot.fea.mixed_point import mixed_point
from tubefoot.fea.ogden import FLAGS


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def apply_tangent(slopes, tangent, weight, applied):  # type: ignore[no-untyped-def]
    """Write weight * A G^T for the axes i <= k of A, so that G times it is a point's part of the stiffness.

    slopes : (3, n_nodes), G^T; tangent : (9, 9), A; applied : (3, 6 n_nodes) out
    """
    n_nodes = slopes.shape[1]
    block = 0
    for i in range(3):
        for k in range(i, 3):
            for j in range(3):
                t0 = weight * tangent[3 * i + j, 3 * k]
                t1 = weight * tangent[3 * i + j, 3 * k + 1]
                t2 = weight * tangent[3 * i + j, 3 * k + 2]
                row = applied[j, block * n_nodes : (block + 1) * n_nodes]
                for c in range(n_nodes):
                    row[c] = t0 * slopes[0, c] + t1 * slopes[1, c] + t2 * slopes[2, c]
            block += 1


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def eliminate_interior(matrix, n_kept, factor, pivots):  # type: ignore[no-untyped-def]
    """Eliminate the last unknowns of a symmetric cell matrix.

    matrix : (n, n) in and out, the first n_kept rows hold the Schur complement afterwards
    n_kept : unknowns that stay
    factor : (n - n_kept, n) out, pivots : (n - n_kept,) out; see `condense` and `recover_interior`
    """
    n = matrix.shape[0]
    for k in range(n - 1, n_kept - 1, -1):
        pivot = matrix[k, k]
        pivots[k - n_kept] = pivot
        for i in range(k):
            factor[k - n_kept, i] = matrix[k, i] / pivot
        for i in range(k):
            x = matrix[k, i]
            if x == 0.0:
                continue
            for j in range(k):
                matrix[i, j] -= x * factor[k - n_kept, j]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def condense(residual, n_kept, factor, pivots, scaled):  # type: ignore[no-untyped-def]
    """Eliminate the last entries of a cell's residual with the factors of `eliminate_interior`.

    residual : (n,) in and out; n_kept : unknowns that stay; factor, pivots : of the cell's matrix
    scaled : (n - n_kept,) out, see `recover_interior`
    """
    for k in range(residual.shape[0] - 1, n_kept - 1, -1):
        x = residual[k]
        scaled[k - n_kept] = x / pivots[k - n_kept]
        for i in range(k):
            residual[i] -= x * factor[k - n_kept, i]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def recover_interior(step, factor, scaled, n_kept):  # type: ignore[no-untyped-def]
    """Fill in the interior part of a Newton step.

    step : (n,) in and out, the first n_kept entries are given
    factor : of `eliminate_interior`; scaled : of `condense`; n_kept : unknowns that were not eliminated
    """
    for k in range(n_kept, step.shape[0]):
        value = -scaled[k - n_kept]
        for i in range(k):
            value -= factor[k - n_kept, i] * step[i]
        step[k] = value


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def place(stiffness, coupling, displacement_slot, pressure_slot, matrix):  # type: ignore[no-untyped-def]
    """Write nodal blocks and pressure coupling into a cell's matrix, symmetric.

    stiffness : (n_nodes, 6 n_nodes), blocks of the axes i <= k side by side; coupling : (n_p, 3 n_nodes)
    displacement_slot : (3 n_nodes,), pressure_slot : (n_p,); matrix : (n_local, n_local) out
    """
    n_nodes = stiffness.shape[0]
    block = 0
    for i in range(3):
        for k in range(i, 3):
            for a in range(n_nodes):
                row = displacement_slot[3 * a + i]
                for c in range(n_nodes):
                    column = displacement_slot[3 * c + k]
                    matrix[row, column] = stiffness[a, block * n_nodes + c]
                    matrix[column, row] = stiffness[a, block * n_nodes + c]
            block += 1
    for m in range(coupling.shape[0]):
        for r in range(3 * n_nodes):
            matrix[displacement_slot[r], pressure_slot[m]] = coupling[m, r]
            matrix[pressure_slot[m], displacement_slot[r]] = coupling[m, r]


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def assemble_cells(  # type: ignore[no-untyped-def]
    unknowns,
    local_unknowns,
    gradients,
    weights,
    pressure_shapes,
    material,
    mu,
    alpha,
    kappa,
    history,
    strains,
    displacement_slot,
    pressure_slot,
    n_kept,
    stiff,
    matrices,
    residuals,
    factors,
    pivots,
    scaled,
    energy,
    min_jacobian,
    magnitude,
    interior,
):
    """Cell matrices and residuals, interior unknowns eliminated.

    Without `stiff` only residuals, condensed with the factors of the last matrices.

    unknowns : (n,) all unknowns; local_unknowns : (n_cells, n_local) their numbers in each cell
    gradients : (n_cells, n_q, n_nodes, 3); weights : (n_cells, n_q) [mm^3]
    pressure_shapes : (n_cells, n_q, n_p); material : (n_cells,) row of the material constants
    mu, alpha : (n_laws, n_terms); kappa : (n_laws, 3), k0, k1 and g [MPa]
    history : (n_cells, n_q, 6) stress remembered at each point, see `add_history`; (n_cells, n_q, 0) for none
    strains : (n_cells, n_q, 6) C that each point has by itself, see `mixed_point`; (n_cells, n_q, 0) for none
    displacement_slot : (3 n_nodes,), pressure_slot : (n_p,) places among a cell's unknowns
    n_kept : how many of a cell's unknowns stay; stiff : whether the matrices are wanted
    matrices : (n_cells, n_kept, n_kept), residuals : (n_cells, n_kept) out
    factors : (n_cells, n_local - n_kept, n_local), pivots, scaled : (n_cells, n_local - n_kept) out
    energy, min_jacobian : (n_cells,) out; magnitude : (n_cells,) out, largest force entry [N]
    interior : (n_cells,) out, largest residual of an eliminated displacement [N]
    """
    n_cells, n_local = local_unknowns.shape
    n_q, n_nodes = gradients.shape[1:3]
    n_p = pressure_shapes.shape[2]
    for cell in prange(n_cells):
        nodal = np.empty((n_nodes, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[local_unknowns[cell, displacement_slot[3 * a + i]]]
        f, cof, stress = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        tangent, work = np.empty((9, 9)), np.empty((7, 9))
        mixed = np.empty((7, 3, 3))
        rows = 3 * n_q if stiff else 0
        slopes, applied = np.zeros((rows, n_nodes)), np.zeros((rows, 6 * n_nodes))
        divergences, shares = np.zeros((n_q, 3 * n_nodes)), np.zeros((n_q, n_p))
        matrix = np.zeros((n_local, n_local)) if stiff else np.zeros((0, 0))
        residual = np.zeros(n_local)
        law = material[cell]
        field_bulk = kappa[law, 1]
        total = 0.0
        smallest = np.inf
        for q in range(n_q):
            gradient = gradients[cell, q]
            weight = weights[cell, q]
            field = 0.0
            for m in range(n_p):
                slot = local_unknowns[cell, pressure_slot[m]]
                field += pressure_shapes[cell, q, m] * unknowns[slot]
            deformation_gradient(nodal, gradient, f)
            if strains.shape[2] > 0:
                density, jacobian = mixed_point(
                    f,
                    strains[cell, q],
                    mu[law],
                    alpha[law],
                    kappa[law, 0],
                    kappa[law, 2],
                    field,
                    history[cell, q],
                    cof,
                    stress,
                    tangent,
                    work,
                    mixed,
                )
            else:
                jacobian = cofactor(f, cof)
                density = material_point(
                    f,
                    cof,
                    jacobian,
                    mu[law],
                    alpha[law],
                    kappa[law, 0],
                    kappa[law, 2],
                    field,
                    history[cell, q],
                    stiff,
                    stress,
                    tangent,
                    work,
                )
                smallest = min(smallest, jacobian)
                if not jacobian > 0.0:
                    continue
            total += weight * (density + field * (jacobian - 1.0 - 0.5 * field / field_bulk))
            for a in range(n_nodes):
                for i in range(3):
                    force = 0.0
                    for j in range(3):
                        force += stress[i, j] * gradient[a, j]
                    residual[displacement_slot[3 * a + i]] += weight * force
            for m in range(n_p):
                share = weight * pressure_shapes[cell, q, m]
                residual[pressure_slot[m]] += share * (jacobian - 1.0 - field / field_bulk)
            if not stiff:
                continue
            for a in range(n_nodes):
                for j in range(3):
                    slopes[3 * q + j, a] = gradient[a, j]
            apply_tangent(slopes[3 * q : 3 * q + 3], tangent, weight, applied[3 * q : 3 * q + 3])
            for a in range(n_nodes):
                for i in range(3):
                    divergences[q, 3 * a + i] = 0.0
                    for j in range(3):
                        divergences[q, 3 * a + i] += cof[i, j] * gradient[a, j]
            for m in range(n_p):
                share = weight * pressure_shapes[cell, q, m]
                shares[q, m] = share
                for n in range(n_p):
                    matrix[pressure_slot[m], pressure_slot[n]] -= (
                        share * pressure_shapes[cell, q, n] / field_bulk
                    )
        largest, inner = 0.0, 0.0
        for r in range(3 * n_nodes):
            size = abs(residual[displacement_slot[r]])
            largest = max(largest, size)
            if displacement_slot[r] >= n_kept:
                inner = max(inner, size)
        if stiff:
            coupling = np.dot(shares.T, divergences)
            place(np.dot(slopes.T, applied), coupling, displacement_slot, pressure_slot, matrix)
            eliminate_interior(matrix, n_kept, factors[cell], pivots[cell])
            matrices[cell] = matrix[:n_kept, :n_kept]
        condense(residual, n_kept, factors[cell], pivots[cell], scaled[cell])
        residuals[cell] = residual[:n_kept]
        energy[cell] = total
        min_jacobian[cell] = smallest
        magnitude[cell] = largest
        interior[cell] = inner


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def recover_cells(step, local_unknowns, n_kept, factors, scaled):  # type: ignore[no-untyped-def]
    """Fill in a Newton step for the interior unknowns of all cells.

    step : (n,) in and out; local_unknowns : (n_cells, n_local)
    n_kept, factors, scaled : see `assemble_cells`
    """
    n_cells, n_local = local_unknowns.shape
    for cell in prange(n_cells):
        local = np.empty(n_local)
        for i in range(n_kept):
            local[i] = step[local_unknowns[cell, i]]
        recover_interior(local, factors[cell], scaled[cell], n_kept)
        for i in range(n_kept, n_local):
            step[local_unknowns[cell, i]] = local[i]


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def point_stresses(  # type: ignore[no-untyped-def]
    unknowns,
    local_unknowns,
    gradients,
    pressure_shapes,
    material,
    mu,
    alpha,
    kappa,
    history,
    displacement_slot,
    pressure_slot,
    cauchy,
    jacobians,
):
    """Write the Cauchy stress and J at every quadrature point.

    unknowns, local_unknowns, gradients, pressure_shapes, material, mu, alpha, kappa, history,
    displacement_slot, pressure_slot : as in `assemble_cells`
    cauchy : (n_cells, n_q, 3, 3) out [MPa]; jacobians : (n_cells, n_q) out
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal = np.empty((n_nodes, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[local_unknowns[cell, displacement_slot[3 * a + i]]]
        f, cof, stress = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        tangent, work = np.empty((9, 9)), np.empty((7, 9))
        law = material[cell]
        for q in range(n_q):
            field = 0.0
            for m in range(pressure_slot.shape[0]):
                slot = local_unknowns[cell, pressure_slot[m]]
                field += pressure_shapes[cell, q, m] * unknowns[slot]
            deformation_gradient(nodal, gradients[cell, q], f)
            jacobian = cofactor(f, cof)
            material_point(
                f,
                cof,
                jacobian,
                mu[law],
                alpha[law],
                kappa[law, 0],
                kappa[law, 2],
                field,
                history[cell, q],
                False,
                stress,
                tangent,
                work,
            )
            for i in range(3):
                for j in range(3):
                    value = 0.0
                    for k in range(3):
                        value += stress[i, k] * f[j, k] / jacobian
                    cauchy[cell, q, i, j] = value
            jacobians[cell, q] = jacobian
