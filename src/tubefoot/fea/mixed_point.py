"""A point whose strain is an unknown of its own: what Newton's method sees far from equilibrium (compiled).

Where a thin wall turns, a step of the displacements, which is straight, stretches it by the square of the
turn. The stiff stretch rather than the soft bending then decides how far Newton's method may go. With the
strain C_g of each point as an unknown of its own, bound to the displacements by C_g = F^T F, Newton's method
on both (the strain eliminated at once) is

    P = F (S_g + D : (F^T F - C_g) / 2),      dP/dF = S_g (x) 1 + F D F,

with S_g = 2 dW/dC and D = 4 d2W/dC2 at C_g. After a step du the new C_g is F^T F as it changes to first
order in du. (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech. Engrg. 313, 2017, for stresses as
unknowns; with strains any energy will do.) With C_g = F^T F it is the usual stress and tangent, so a state of
equilibrium is the same.

W depends on C alone: G with G^T G = C_g, upper triangular, stands for F where S_g and D are evaluated.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tubefoot.fea.material_point import cofactor, material_point
from tubefoot.fea.ogden import FLAGS


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def triangular_root(strain, g, inverse):  # type: ignore[no-untyped-def]
    """Write the upper triangular G with G^T G = C, and its inverse.

    strain : (6,) components 11, 22, 33, 12, 13, 23 of C, positive definite; g, inverse : (3, 3) out
    """
    g[:, :] = 0.0
    g[0, 0] = np.sqrt(strain[0])
    g[0, 1], g[0, 2] = strain[3] / g[0, 0], strain[4] / g[0, 0]
    g[1, 1] = np.sqrt(strain[1] - g[0, 1] ** 2)
    g[1, 2] = (strain[5] - g[0, 1] * g[0, 2]) / g[1, 1]
    g[2, 2] = np.sqrt(strain[2] - g[0, 2] ** 2 - g[1, 2] ** 2)
    inverse[:, :] = 0.0
    inverse[0, 0], inverse[1, 1], inverse[2, 2] = 1.0 / g[0, 0], 1.0 / g[1, 1], 1.0 / g[2, 2]
    inverse[0, 1] = -g[0, 1] * inverse[0, 0] * inverse[1, 1]
    inverse[1, 2] = -g[1, 2] * inverse[1, 1] * inverse[2, 2]
    inverse[0, 2] = (g[0, 1] * g[1, 2] - g[0, 2] * g[1, 1]) * inverse[0, 0] * inverse[1, 1] * inverse[2, 2]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def turn_tangent(turn, tangent):  # type: ignore[no-untyped-def]
    """Multiply the first index of both pairs of a tangent by a matrix.

    turn : (3, 3), Q; tangent : (9, 9) in and out, T_ijkl becomes the sum of Q_ip Q_kq T_pjql
    """
    column = np.empty(3)
    for r in range(9):
        for j in range(3):
            for p in range(3):
                column[p] = tangent[3 * p + j, r]
            for i in range(3):
                tangent[3 * i + j, r] = (
                    turn[i, 0] * column[0] + turn[i, 1] * column[1] + turn[i, 2] * column[2]
                )
    for r in range(9):
        for j in range(3):
            for p in range(3):
                column[p] = tangent[r, 3 * p + j]
            for i in range(3):
                tangent[r, 3 * i + j] = (
                    turn[i, 0] * column[0] + turn[i, 1] * column[1] + turn[i, 2] * column[2]
                )


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def mixed_point(  # type: ignore[no-untyped-def]
    f, strain, mu, alpha, bulk, guard, field, history, cof, stress, tangent, work, mixed
):
    """Energy density at the point's own strain without that of the pressure field [MPa], and J.

    J is that of the own strain with the linear change towards F^T F.

    f : (3, 3) of the displacements; strain : (6,) of its own
    mu, alpha, bulk, guard, field, history : see `material_point`
    cof : (3, 3) out, dJ/dF; stress : (3, 3) out, P; tangent : (9, 9) out, dP/dF
    work : (7, 9), mixed : (7, 3, 3) scratch
    """
    g, inverse, turn, second = mixed[0], mixed[1], mixed[2], mixed[3]
    miss, pulled, own = mixed[4], mixed[5], mixed[6]
    triangular_root(strain, g, inverse)
    jacobian = cofactor(g, own)
    energy = material_point(
        g, own, jacobian, mu, alpha, bulk, guard, field, history, True, stress, tangent, work
    )
    for i in range(3):
        for j in range(3):
            turn[i, j] = second[i, j] = 0.0
            for k in range(3):
                turn[i, j] += f[i, k] * inverse[k, j]
                second[i, j] += inverse[i, k] * stress[k, j]
            strained = strain[i] if i == j else strain[i + j + 2]
            miss[i, j] = 0.5 * (f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j] - strained)
    for i in range(3):
        for j in range(3):
            pulled[i, j] = 0.0
            for k in range(3):
                pulled[i, j] += inverse[k, i] * miss[k, j]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                tangent[3 * k + i, 3 * k + j] -= second[i, j]
    # The stress that goes with the miss, still in the frame of G.
    for i in range(3):
        for j in range(3):
            value = 0.0
            for k in range(3):
                for m in range(3):
                    value += tangent[3 * i + j, 3 * k + m] * pulled[k, m]
            miss[i, j] = stress[i, j] + value
            jacobian += own[i, j] * pulled[i, j]
    for i in range(3):
        for j in range(3):
            stress[i, j] = cof[i, j] = 0.0
            for k in range(3):
                stress[i, j] += turn[i, k] * miss[k, j]
                cof[i, j] += turn[i, k] * own[k, j]
    turn_tangent(turn, tangent)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                tangent[3 * k + i, 3 * k + j] += second[i, j]
    return energy, jacobian
