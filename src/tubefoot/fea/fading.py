"""How a contact fades: its weight by the place on the facet, and by the angle between the walls (compiled).

Facets meet at a kink where a curved wall deforms, and a sample that slides from one to the next would feel a
jump of force there. So its energy w(g) goes over smoothly: around an edge both facets act, each continued as
the same polynomial, with weights p(s, t) that fall across the edge and add up to one.

The length l along a wall's normal n to the other wall, with unit normal e, grows when the wall turns away,
as 1 / c with c = -n . e: a wall under pressure would turn by itself. So the gap is the distance from the
plane that touches the other wall where n meets it, g = c l. And where the other wall stands across, nothing
is opposite any more: a weight f(c) is 0 at some angle and 1 from another on. Both weights have two continuous
derivatives, and the energy is

    E(l, s, t, c) = p(s, t) f(c) w(c l).

With the area vector m = X_s x X_t, e = m / |m|, the derivatives of c are those by n and by m, and m changes
with the nodes of its facet and with the place (s, t) that the gap's line meets.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def faded(cosine, fade):  # type: ignore[no-untyped-def]
    """Weight of a contact by the cosine between the walls, and its first and second derivative.

    cosine : 1 where they face each other; fade : the cosines at which the weight is 0 and 1
    """
    width = fade[1] - fade[0]
    x = min(max((cosine - fade[0]) / width, 0.0), 1.0)
    weight = x * x * x * (10.0 + x * (6.0 * x - 15.0))
    return weight, 30.0 * (x * (1.0 - x)) ** 2 / width, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / width**2


@njit(cache=True, error_model="numpy")
def placed(s, t, edges, zones, weight):  # type: ignore[no-untyped-def]
    """Write the weight of a contact by its place on a facet, and its derivatives.

    s, t : reference coordinates; edges : (n, 3) each edge's a, b, c: a s + b t + c is negative inside
    zones : (n, 2) how far outside each edge it begins to fall, and ends; weight : (6,) out p, p_s, p_t, p_ss,
    p_st, p_tt
    """
    weight[:] = 0.0
    weight[0] = 1.0
    for k in range(edges.shape[0]):
        a, b, c = edges[k]
        share, slope, bend = faded(-(a * s + b * t + c), (-zones[k, 1], -zones[k, 0]))
        slope = -slope
        p, p_s, p_t = weight[0], weight[1], weight[2]
        weight[3] = weight[3] * share + 2.0 * a * slope * p_s + a * a * bend * p
        weight[4] = weight[4] * share + slope * (a * p_t + b * p_s) + a * b * bend * p
        weight[5] = weight[5] * share + 2.0 * b * slope * p_t + b * b * bend * p
        weight[1] = p_s * share + a * slope * p
        weight[2] = p_t * share + b * slope * p
        weight[0] = p * share


@njit(cache=True, error_model="numpy")
def cross(a, b, out):  # type: ignore[no-untyped-def]
    """Write the vector product of two vectors.

    a, b : (3,); out : (3,) out
    """
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = a[j] * b[k] - a[k] * b[j]


@njit(cache=True, error_model="numpy")
def dot(a, b):  # type: ignore[no-untyped-def]
    """Scalar product of two vectors.

    a, b : (3,)
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def times_axis(i, vector, out):  # type: ignore[no-untyped-def]
    """Write e_i x a vector.

    i : number of the axis; vector : (3,); out : (3,) out
    """
    j, k = (i + 1) % 3, (i + 2) % 3
    out[i], out[j], out[k] = 0.0, -vector[k], vector[j]


@njit(cache=True, error_model="numpy")
def turn_of_area(surface, along_s, along_t):  # type: ignore[no-untyped-def]
    """Write how the area vector X_s x X_t changes with s and with t.

    surface : (8, 3), see `assemble_contacts`; along_s, along_t : (3,) out
    """
    a, b = np.empty(3), np.empty(3)
    cross(surface[3], surface[2], a)
    cross(surface[1], surface[4], b)
    along_s[:] = a + b
    cross(surface[4], surface[2], a)
    cross(surface[1], surface[5], b)
    along_t[:] = a + b


@njit(cache=True, error_model="numpy")
def add_tilts(surface, other, along_s, along_t, rates, tilts):  # type: ignore[no-untyped-def]
    """Add the rates of the other facet's area vector by each unknown.

    surface, other, rates : see `add_contact`; along_s, along_t : of `turn_of_area`
    tilts : (3, 6 n) in and out
    """
    size = tilts.shape[1] // 2
    unit, change = np.empty(3), np.empty(3)
    for p in range(2 * size):
        if p >= size:
            node = (p - size) // 3
            for m in range(3):
                unit[m] = other[1, node] * surface[2, m] - other[2, node] * surface[1, m]
            times_axis(p % 3, unit, change)
            for m in range(3):
                tilts[m, p] = change[m]
        for m in range(3):
            tilts[m, p] += along_s[m] * rates[1, p] + along_t[m] * rates[2, p]


@njit(cache=True, error_model="numpy")
def add_fading(  # type: ignore[no-untyped-def]
    surface, other, normal, facing, area, cosine, by_area, by_cosine, rates, turns, tilts, matrix
):
    """Add what the cosine's second derivative contributes to the stiffness, beside that by s and t's.

    surface, other, rates, turns, tilts, matrix : see `add_contact`; normal, facing : of both facets
    area : length of the other's area vector; cosine : between them; by_area : its derivative by that vector
    by_cosine : dE/dc
    """
    size = matrix.shape[0] // 2
    vector, change = np.empty(3), np.empty(3)
    # Second derivatives of the area vector by s and t, along by_area.
    of = np.zeros((2, 2))
    for a, b, k, l, factor in (  # noqa: E741
        (3, 4, 0, 0, 2.0),
        (1, 6, 0, 0, 1.0),
        (4, 5, 1, 1, 2.0),
        (7, 2, 1, 1, 1.0),
        (6, 2, 0, 1, 1.0),
        (3, 5, 0, 1, 1.0),
        (1, 7, 0, 1, 1.0),
    ):
        cross(surface[a], surface[b], vector)
        of[k, l] += factor * dot(by_area, vector)
    of[1, 0] = of[0, 1]
    # Explicit rates of the area vector's changes with s and t, along by_area.
    slid = np.zeros((2, 2 * size))
    for p in range(size, 2 * size):
        node = (p - size) // 3
        for z in range(2):
            for m in range(3):
                vector[m] = (
                    other[3 + z, node] * surface[2, m]
                    + other[1, node] * surface[4 + z, m]
                    - other[4 + z, node] * surface[1, m]
                    - other[2, node] * surface[3 + z, m]
                )
            times_axis(p % 3, vector, change)
            slid[z, p] = dot(by_area, change)
    for p in range(2 * size):
        for q in range(2 * size):
            value = 0.0
            if p >= size and q >= size:
                i, j = p % 3, q % 3
                if i != j:
                    node_p, node_q = (p - size) // 3, (q - size) // 3
                    sign = 1.0 if (i + 1) % 3 == j else -1.0
                    slopes = other[1, node_p] * other[2, node_q] - other[1, node_q] * other[2, node_p]
                    value += sign * slopes * by_area[3 - i - j]
            n_p = n_q = e_p = e_q = both = turned = 0.0
            e_np = e_nq = 0.0
            for m in range(3):
                n_p += normal[m] * tilts[m, p]
                n_q += normal[m] * tilts[m, q]
                e_p += facing[m] * tilts[m, p]
                e_q += facing[m] * tilts[m, q]
                e_np += facing[m] * turns[m, p]
                e_nq += facing[m] * turns[m, q]
                both += tilts[m, p] * tilts[m, q]
                turned += turns[m, p] * tilts[m, q] + turns[m, q] * tilts[m, p]
            value += (n_p * e_q + e_p * n_q - cosine * both + 3.0 * cosine * e_p * e_q) / (area * area)
            value -= (turned - e_np * e_q - e_nq * e_p) / area
            for z in range(2):
                value += slid[z, p] * rates[1 + z, q] + slid[z, q] * rates[1 + z, p]
                for y in range(2):
                    value += of[z, y] * rates[1 + z, p] * rates[1 + y, q]
            matrix[p, q] += by_cosine * value
