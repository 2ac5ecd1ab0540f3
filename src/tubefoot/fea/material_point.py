"""The material at one point of a cell: energy density, nominal stress and tangent by F (compiled).

W(F) of the Ogden law, k0 (J - 1 - ln J) + g / 4 (J - 1)^4 on the volume, p J of the pressure field,
H : (C - 1) / 2 of a remembered stress.
"""

from __future__ import annotations

import numpy as np
from numba import njit

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
def add_volumetric(f, cof, jacobian, bulk, guard, field, stiff, stress, tangent):  # type: ignore[no-untyped-def]
    """Energy density k0 (J - 1 - ln J) + g / 4 (J - 1)^4 [MPa]; its stress and tangent are added.

    Those of field * J are added too.

    f : (3, 3), cof : its cofactors, jacobian : its determinant
    bulk : k0, guard : g, field : pressure [MPa]; stiff : whether the tangent is wanted
    stress : (3, 3), tangent : (9, 9) in and out
    """
    excess = jacobian - 1.0
    pressure = field + bulk * (1.0 - 1.0 / jacobian) + guard * excess**3
    slope = bulk / (jacobian * jacobian) + 3.0 * guard * excess**2
    for i in range(3):
        for j in range(3):
            stress[i, j] += pressure * cof[i, j]
    if stiff:
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
def material_point(  # type: ignore[no-untyped-def]
    f, cof, jacobian, mu, alpha, bulk, guard, field, history, stiff, stress, tangent, work
):
    """Energy density without that of the pressure field [MPa]; the nominal stress is written.

    f : (3, 3), cof : its cofactors, jacobian : its determinant; where that is not positive nothing is done
    mu, alpha : (n_terms,); bulk, guard, field : see `add_volumetric`
    history : (6,) of `add_history`, or (0,) for none; stiff : whether the tangent is wanted
    stress : (3, 3) out [MPa]; tangent : (9, 9) out; work : (7, 9) scratch
    """
    if not jacobian > 0.0:
        return 0.0
    energy = ogden_point(f, mu, alpha, stiff, stress, tangent, work)
    if history.shape[0] > 0:
        energy += add_history(f, history, stress, tangent)
    energy += add_volumetric(f, cof, jacobian, bulk, guard, field, stiff, stress, tangent)
    return energy
