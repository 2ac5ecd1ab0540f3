"""Isochoric Ogden stress and tangent at a point, through principal stretches (compiled).

W(F) = sum_i 2 mu_i / alpha_i^2 (sum_k lbar_k^alpha_i - 3), lbar_k = J^(-1/3) l_k, with the principal
stretches l_k of F. In the principal frames n_a (spatial) and N_a (material), F = sum l_a n_a x N_a,

    P = dW/dF = sum_a T_a n_a x N_a,   T_a = dW/dl_a,
    dP/dF : diagonal block d2W/dl_a dl_b; each pair a < b adds (T_a - T_b) / (l_a - l_b) on the
    symmetric and (T_a + T_b) / (l_a + l_b) on the skew part of n_a x N_b, n_b x N_a.

For l_a -> l_b the first quotient tends to (W_aa + W_bb) / 2 - W_ab. Source: Ogden, Non-Linear Elastic
Deformations, 1984, ch. 6. Valid for J > 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

FLAGS: Any = {"contract", "reassoc", "nsz", "arcp"}
"""Fast-math options that keep NaN and infinity meaningful; with error_model="numpy" a division by zero in a
cell that has collapsed gives infinity, which Newton's method sees, instead of an exception that it cannot."""

EQUAL_STRETCH = 1e-5
"""Relative difference of two stretches below which the limit formula is used (its error is the square)."""


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def symmetric_eigen(c, vectors, values):  # type: ignore[no-untyped-def]
    """Eigenvalues and eigenvectors of a symmetric 3 x 3 matrix, by cyclic Jacobi rotations.

    c : (3, 3), destroyed; vectors : (3, 3) out, columns; values : (3,) out
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    scale = c[0, 0] + c[1, 1] + c[2, 2]
    for _ in range(12):
        if abs(c[0, 1]) + abs(c[0, 2]) + abs(c[1, 2]) < 1e-15 * scale:
            break
        for pair in range(3):
            p = 0 if pair < 2 else 1
            q = 1 if pair == 0 else 2
            if abs(c[p, q]) < 1e-300:
                continue
            ratio = (c[q, q] - c[p, p]) / (2.0 * c[p, q])
            t = 1.0 / (abs(ratio) + np.sqrt(ratio * ratio + 1.0))
            if ratio < 0.0:
                t = -t
            cosine = 1.0 / np.sqrt(t * t + 1.0)
            sine = t * cosine
            c[p, p] -= t * c[p, q]
            c[q, q] += t * c[p, q]
            c[p, q] = 0.0
            c[q, p] = 0.0
            r = 3 - p - q
            a, b = c[r, p], c[r, q]
            c[r, p] = c[p, r] = cosine * a - sine * b
            c[r, q] = c[q, r] = sine * a + cosine * b
            for i in range(3):
                a, b = vectors[i, p], vectors[i, q]
                vectors[i, p] = cosine * a - sine * b
                vectors[i, q] = sine * a + cosine * b
    for i in range(3):
        values[i] = c[i, i]


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def principal_derivatives(stretch, jacobian, mu, alpha, first, second):  # type: ignore[no-untyped-def]
    """Energy density [MPa]; `first` and `second` get its derivatives by the principal stretches.

    stretch : (3,) principal stretches; jacobian : their product; mu, alpha : (n_terms,)
    first : (3,) out, dW/dl_a; second : (3, 3) out, d2W/dl_a dl_b
    """
    energy = 0.0
    first[:] = 0.0
    second[:, :] = 0.0
    mean_log = np.log(jacobian) / 3.0
    log0, log1, log2 = np.log(stretch[0]), np.log(stretch[1]), np.log(stretch[2])
    for k in range(mu.shape[0]):
        if mu[k] == 0.0:
            continue
        a = alpha[k]
        c = 2.0 * mu[k] / a
        e0 = np.exp(a * (log0 - mean_log))
        e1 = np.exp(a * (log1 - mean_log))
        e2 = np.exp(a * (log2 - mean_log))
        mean = (e0 + e1 + e2) / 3.0
        energy += c / a * (e0 + e1 + e2 - 3.0)
        powers = (e0, e1, e2)
        for i in range(3):
            first[i] += c * (powers[i] - mean) / stretch[i]
            for j in range(3):
                same = 1.0 if i == j else 0.0
                slope = a * powers[i] * (same - 1.0 / 3.0) / stretch[j]
                slope_of_mean = a * (powers[j] - mean) / (3.0 * stretch[j])
                second[i, j] += c * (slope - slope_of_mean) / stretch[i]
            second[i, i] -= c * (powers[i] - mean) / (stretch[i] * stretch[i])
    return energy


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def ogden_point(f, mu, alpha, stiff, stress, tangent, work):  # type: ignore[no-untyped-def]
    """Energy density [MPa] at a deformation gradient; the nominal stress and its tangent are written.

    f : (3, 3) deformation gradient, det > 0; mu, alpha : (n_terms,); stiff : whether the tangent is wanted
    stress : (3, 3) out, dW/dF [MPa]; tangent : (9, 9) out, d2W/dF dF, row-major pairs [MPa]
    work : (7, 9) scratch
    """
    c = work[0].reshape(3, 3)
    vectors = work[1].reshape(3, 3)
    second = work[2].reshape(3, 3)
    spatial = work[3].reshape(3, 3)
    for i in range(3):
        for j in range(3):
            c[i, j] = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
    stretch, first = work[4, 0:3], work[4, 3:6]
    symmetric_eigen(c, vectors, stretch)
    for a in range(3):
        stretch[a] = np.sqrt(stretch[a])
    energy = principal_derivatives(stretch, stretch[0] * stretch[1] * stretch[2], mu, alpha, first, second)
    for a in range(3):
        for i in range(3):
            spatial[i, a] = (
                f[i, 0] * vectors[0, a] + f[i, 1] * vectors[1, a] + f[i, 2] * vectors[2, a]
            ) / stretch[a]
    for i in range(3):
        for j in range(3):
            stress[i, j] = 0.0
            for a in range(3):
                stress[i, j] += first[a] * spatial[i, a] * vectors[j, a]
    if not stiff:
        return energy
    tangent[:, :] = 0.0
    left, right = work[5], work[6]
    for a in range(3):
        # Row a of the diagonal block: (n_a x N_a) with sum_b W_ab (n_b x N_b).
        for i in range(3):
            for j in range(3):
                left[3 * i + j] = spatial[i, a] * vectors[j, a]
                right[3 * i + j] = 0.0
                for b in range(3):
                    right[3 * i + j] += second[a, b] * spatial[i, b] * vectors[j, b]
        for r in range(9):
            for s in range(9):
                tangent[r, s] += left[r] * right[s]
    for a in range(3):
        for b in range(a + 1, 3):
            gap = stretch[a] - stretch[b]
            total = stretch[a] + stretch[b]
            if abs(gap) > EQUAL_STRETCH * total:
                symmetric = (first[a] - first[b]) / gap
            else:
                symmetric = 0.5 * (second[a, a] + second[b, b]) - second[a, b]
            skew = (first[a] + first[b]) / total
            for i in range(3):
                for j in range(3):
                    ab, ba = spatial[i, a] * vectors[j, b], spatial[i, b] * vectors[j, a]
                    left[3 * i + j] = ab + ba
                    right[3 * i + j] = ab - ba
            for r in range(9):
                x, y = 0.5 * symmetric * left[r], 0.5 * skew * right[r]
                for s in range(9):
                    tangent[r, s] += x * left[s] + y * right[s]
    return energy
