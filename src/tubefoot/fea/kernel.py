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

from tubefoot.fea.ogden import FLAGS, ogden_point


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def cofactor(f, out):  # type: ignore[no-untyped-def]
    """Determinant of a 3 x 3 matrix; its cofactors are written.

    f : (3, 3); out : (3, 3) out, d det(f) / d f
    """
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            out[i, m] = f[j, n] * f[k, o] - f[j, o] * f[k, n]
    return f[0, 0] * out[0, 0] + f[0, 1] * out[0, 1] + f[0, 2] * out[0, 2]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def deformation_gradient(nodal, gradient, f):  # type: ignore[no-untyped-def]
    """Write F = 1 + grad u at a point.

    nodal : (n_nodes, 3) displacements; gradient : (n_nodes, 3) shape gradients; f : (3, 3) out
    """
    for i in range(3):
        for j in range(3):
            value = 1.0 if i == j else 0.0
            for a in range(nodal.shape[0]):
                value += nodal[a, i] * gradient[a, j]
            f[i, j] = value


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def add_determinant_hessian(f, factor, tangent):  # type: ignore[no-untyped-def]
    """Add factor * d2J/dF dF to a tangent.

    f : (3, 3); factor : pressure [MPa]; tangent : (9, 9) in and out
    """
    for i in range(3):
        for k in range(3):
            if i == k:
                continue
            m = 3 - i - k
            row_sign = 1.0 if (i + 1) % 3 == k else -1.0
            for j in range(3):
                for l in range(3):  # noqa: E741
                    if j == l:
                        continue
                    column_sign = 1.0 if (j + 1) % 3 == l else -1.0
                    tangent[3 * i + j, 3 * k + l] += factor * row_sign * column_sign * f[m, 3 - j - l]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def add_stiffness(gradient, tangent, weight, blocks, half):  # type: ignore[no-untyped-def]
    """Add weight * G A G^T to the nodal blocks i <= k.

    gradient : (n_nodes, 3); tangent : (9, 9); blocks : (6, n_nodes, n_nodes) in and out
    half : (3, n_nodes) scratch
    """
    n_nodes = gradient.shape[0]
    block = 0
    for i in range(3):
        for k in range(i, 3):
            for j in range(3):
                t0 = weight * tangent[3 * i + j, 3 * k]
                t1 = weight * tangent[3 * i + j, 3 * k + 1]
                t2 = weight * tangent[3 * i + j, 3 * k + 2]
                for c in range(n_nodes):
                    half[j, c] = t0 * gradient[c, 0] + t1 * gradient[c, 1] + t2 * gradient[c, 2]
            for a in range(n_nodes):
                g0, g1, g2 = gradient[a, 0], gradient[a, 1], gradient[a, 2]
                for c in range(n_nodes):
                    blocks[block, a, c] += g0 * half[0, c] + g1 * half[1, c] + g2 * half[2, c]
            block += 1


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def eliminate_interior(matrix, residual, n_kept, factor, scaled):  # type: ignore[no-untyped-def]
    """Eliminate the last unknowns of a symmetric cell matrix.

    matrix : (n, n) in and out, the first n_kept rows hold the Schur complement afterwards
    residual : (n,) in and out; n_kept : unknowns that stay
    factor : (n - n_kept, n) out, scaled : (n - n_kept,) out; see `recover_interior`
    """
    n = matrix.shape[0]
    for k in range(n - 1, n_kept - 1, -1):
        pivot = matrix[k, k]
        scaled[k - n_kept] = residual[k] / pivot
        for i in range(k):
            factor[k - n_kept, i] = matrix[k, i] / pivot
        for i in range(k):
            x = matrix[k, i]
            if x == 0.0:
                continue
            for j in range(k):
                matrix[i, j] -= x * factor[k - n_kept, j]
            residual[i] -= x * scaled[k - n_kept]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def recover_interior(step, factor, scaled, n_kept):  # type: ignore[no-untyped-def]
    """Fill in the interior part of a Newton step.

    step : (n,) in and out, the first n_kept entries are given; factor, scaled : of `eliminate_interior`
    n_kept : unknowns that were not eliminated
    """
    for k in range(n_kept, step.shape[0]):
        value = -scaled[k - n_kept]
        for i in range(k):
            value -= factor[k - n_kept, i] * step[i]
        step[k] = value


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def add_volumetric(f, cof, jacobian, bulk, guard, field, stress, tangent):  # type: ignore[no-untyped-def]
    """Energy density k0 (J - 1 - ln J) + g / 4 (J - 1)^4 [MPa]; its stress and tangent are added.

    Those of field * J are added too.

    f : (3, 3), cof : its cofactors, jacobian : its determinant
    bulk : k0, guard : g, field : pressure [MPa]
    stress : (3, 3), tangent : (9, 9) in and out
    """
    excess = jacobian - 1.0
    pressure = field + bulk * (1.0 - 1.0 / jacobian) + guard * excess**3
    slope = bulk / (jacobian * jacobian) + 3.0 * guard * excess**2
    for i in range(3):
        for j in range(3):
            stress[i, j] += pressure * cof[i, j]
    for r in range(9):
        for s in range(9):
            tangent[r, s] += slope * cof[r // 3, r % 3] * cof[s // 3, s % 3]
    add_determinant_hessian(f, pressure, tangent)
    return bulk * (excess - np.log(jacobian)) + 0.25 * guard * excess**4


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def add_history(f, history, stress, tangent):  # type: ignore[no-untyped-def]
    """Energy density H : (C - 1) / 2 [MPa] of a constant second Piola-Kirchhoff stress H.

    Its nominal stress F H and the tangent are added.

    f : (3, 3); history : (6,) components 11, 22, 33, 12, 13, 23 of H [MPa]
    stress : (3, 3), tangent : (9, 9) in and out
    """
    energy = -0.5 * (history[0] + history[1] + history[2])
    for j in range(3):
        for k in range(3):
            h = history[j] if j == k else history[j + k + 2]
            for i in range(3):
                stress[i, j] += f[i, k] * h
                tangent[3 * i + j, 3 * i + k] += h
                energy += 0.5 * f[i, j] * f[i, k] * h
    return energy


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def place(blocks, coupling, displacement_slot, pressure_slot, matrix):  # type: ignore[no-untyped-def]
    """Write nodal blocks and pressure coupling into a cell's matrix, symmetric.

    blocks : (6, n_nodes, n_nodes), axes i <= k; coupling : (n_p, 3 n_nodes)
    displacement_slot : (3 n_nodes,), pressure_slot : (n_p,); matrix : (n_local, n_local) out
    """
    n_nodes = blocks.shape[1]
    block = 0
    for i in range(3):
        for k in range(i, 3):
            for a in range(n_nodes):
                row = displacement_slot[3 * a + i]
                for c in range(n_nodes):
                    column = displacement_slot[3 * c + k]
                    matrix[row, column] = blocks[block, a, c]
                    matrix[column, row] = blocks[block, a, c]
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
    n_nodes,
    displacement_slot,
    pressure_slot,
    n_kept,
    matrices,
    residuals,
    factors,
    scaled,
    energy,
    min_jacobian,
    magnitude,
):
    """Cell matrices and residuals, interior unknowns eliminated.

    unknowns : (n,) all unknowns; local_unknowns : (n_cells, n_local) their numbers in each cell
    gradients : (n_cells, n_q, n_nodes, 3); weights : (n_cells, n_q) [mm^3]
    pressure_shapes : (n_cells, n_q, n_p); material : (n_cells,) row of the material constants
    mu, alpha : (n_laws, n_terms); kappa : (n_laws, 3), k0, k1 and g [MPa]
    history : (n_cells, n_q, 6) stress remembered at each point, see `add_history`; (0, n_q, 6) for none
    displacement_slot : (3 n_nodes,), pressure_slot : (n_p,) places among a cell's unknowns
    n_kept : how many of a cell's unknowns stay
    matrices : (n_cells, n_kept, n_kept), residuals : (n_cells, n_kept) out
    factors : (n_cells, n_local - n_kept, n_local), scaled : (n_cells, n_local - n_kept) out
    energy, min_jacobian : (n_cells,) out; magnitude : (n_cells,) out, largest force entry [N]
    """
    n_cells, n_local = local_unknowns.shape
    n_q = weights.shape[1]
    n_p = pressure_shapes.shape[2]
    for cell in prange(n_cells):
        nodal = np.empty((n_nodes, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[local_unknowns[cell, displacement_slot[3 * a + i]]]
        f = np.empty((3, 3))
        cof = np.empty((3, 3))
        stress = np.empty((3, 3))
        tangent = np.empty((9, 9))
        work = np.empty((7, 9))
        half = np.empty((3, n_nodes))
        divergence = np.empty(3 * n_nodes)
        coupling = np.zeros((n_p, 3 * n_nodes))
        blocks = np.zeros((6, n_nodes, n_nodes))
        matrix = np.zeros((n_local, n_local))
        residual = np.zeros(n_local)
        law = material[cell]
        total = 0.0
        smallest = np.inf
        for q in range(n_q):
            gradient = gradients[cell, q]
            weight = weights[cell, q]
            deformation_gradient(nodal, gradient, f)
            jacobian = cofactor(f, cof)
            smallest = min(smallest, jacobian)
            if not jacobian > 0.0:
                continue
            total += weight * ogden_point(f, mu[law], alpha[law], stress, tangent, work)
            if history.shape[0] > 0:
                total += weight * add_history(f, history[cell, q], stress, tangent)
            field = 0.0
            for m in range(n_p):
                slot = local_unknowns[cell, pressure_slot[m]]
                field += pressure_shapes[cell, q, m] * unknowns[slot]
            field_bulk = kappa[law, 1]
            total += weight * field * (jacobian - 1.0 - 0.5 * field / field_bulk)
            bulk, guard = kappa[law, 0], kappa[law, 2]
            total += weight * add_volumetric(f, cof, jacobian, bulk, guard, field, stress, tangent)
            add_stiffness(gradient, tangent, weight, blocks, half)
            for a in range(n_nodes):
                for i in range(3):
                    force, slope = 0.0, 0.0
                    for j in range(3):
                        force += stress[i, j] * gradient[a, j]
                        slope += cof[i, j] * gradient[a, j]
                    residual[displacement_slot[3 * a + i]] += weight * force
                    divergence[3 * a + i] = slope
            for m in range(n_p):
                row = pressure_slot[m]
                share = weight * pressure_shapes[cell, q, m]
                residual[row] += share * (jacobian - 1.0 - field / field_bulk)
                for r in range(3 * n_nodes):
                    coupling[m, r] += share * divergence[r]
                for n in range(n_p):
                    matrix[row, pressure_slot[n]] -= share * pressure_shapes[cell, q, n] / field_bulk
        place(blocks, coupling, displacement_slot, pressure_slot, matrix)
        largest = 0.0
        for r in range(3 * n_nodes):
            largest = max(largest, abs(residual[displacement_slot[r]]))
        eliminate_interior(matrix, residual, n_kept, factors[cell], scaled[cell])
        for r in range(n_kept):
            residuals[cell, r] = residual[r]
            for s in range(n_kept):
                matrices[cell, r, s] = matrix[r, s]
        energy[cell] = total
        min_jacobian[cell] = smallest
        magnitude[cell] = largest


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
        f = np.empty((3, 3))
        cof = np.empty((3, 3))
        stress = np.empty((3, 3))
        tangent = np.empty((9, 9))
        work = np.empty((7, 9))
        law = material[cell]
        for q in range(n_q):
            deformation_gradient(nodal, gradients[cell, q], f)
            jacobian = cofactor(f, cof)
            ogden_point(f, mu[law], alpha[law], stress, tangent, work)
            if history.shape[0] > 0:
                add_history(f, history[cell, q], stress, tangent)
            pressure = kappa[law, 0] * (1.0 - 1.0 / jacobian) + kappa[law, 2] * (jacobian - 1.0) ** 3
            for m in range(pressure_slot.shape[0]):
                slot = local_unknowns[cell, pressure_slot[m]]
                pressure += pressure_shapes[cell, q, m] * unknowns[slot]
            for i in range(3):
                for j in range(3):
                    value = pressure if i == j else 0.0
                    for k in range(3):
                        value += stress[i, k] * f[j, k] / jacobian
                    cauchy[cell, q, i, j] = value
            jacobians[cell, q] = jacobian
