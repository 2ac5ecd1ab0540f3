"""Which facet lies opposite a point of a wall, and how far, along the wall's own normal (compiled).

A facet of quadratic shape functions is a polynomial surface X(s, t) = sum_m s^a_m t^b_m P_m. From a point
x with unit normal n out of its solid, X(s, t) = x + l n gives the place on the facet and the length l. The
gap is l or the distance of x from the plane that touches the facet there, negative where the walls overlap.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tubefoot.fea.elements import ElementKind

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ALONG_NORMAL, TO_PLANE = False, True
"""What a gap is: see `gap_along`."""
OPPOSED = -0.2
"""Largest cosine between the normals of two walls that face each other."""
BEYOND = 1e-9
"""How far outside a facet's edge, in reference units, a place still belongs to it."""
ZONE = 0.125
"""Half the width of the zone around an edge in which two facets act, over the width of the narrower one."""
NEIGHBOUR = 0.7
"""How far outside it may lie for the facet to be one that the point may soon slide onto."""


@njit(cache=True, error_model="numpy")
def surface_at(powers, polynomial, s, t, out):  # type: ignore[no-untyped-def]
    """Write X and its derivatives at (s, t).

    powers : (n_monomials, 2), at most 2 each; polynomial : (n_monomials, 3); s, t : reference coordinates
    out : (6, 3) out, X, X_,s, X_,t, X_,ss, X_,st, X_,tt
    """
    out[:] = 0.0
    for m in range(powers.shape[0]):
        a, b = powers[m, 0], powers[m, 1]
        sa = 1.0 if a == 0 else (s if a == 1 else s * s)
        tb = 1.0 if b == 0 else (t if b == 1 else t * t)
        ds = 0.0 if a == 0 else (1.0 if a == 1 else 2.0 * s)
        dt = 0.0 if b == 0 else (1.0 if b == 1 else 2.0 * t)
        dss = 2.0 if a == 2 else 0.0
        dtt = 2.0 if b == 2 else 0.0
        for i in range(3):
            p = polynomial[m, i]
            out[0, i] += sa * tb * p
            out[1, i] += ds * tb * p
            out[2, i] += sa * dt * p
            out[3, i] += dss * tb * p
            out[4, i] += ds * dt * p
            out[5, i] += sa * dtt * p


@njit(cache=True, error_model="numpy")
def facing_cosine(surface, normal):  # type: ignore[no-untyped-def]
    """Cosine between a facet's normal and another one.

    surface : (6, 3) of `surface_at`; normal : (3,) of unit length
    """
    product, length = 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        across = surface[1, j] * surface[2, k] - surface[1, k] * surface[2, j]
        product += across * normal[i]
        length += across * across
    return product / np.sqrt(length)


@njit(cache=True, error_model="numpy")
def gap_along(powers, polynomial, x, normal, to_plane, place, surface):  # type: ignore[no-untyped-def]
    """The gap from a point along its normal to a facet, nan where the line misses it or the search fails.

    powers, polynomial : of the facet; x, normal : (3,) the point and its unit normal
    to_plane : TO_PLANE for the distance from the plane that touches the facet there, ALONG_NORMAL for the
        length along the normal
    place : (2,) in and out, reference coordinates of where the line meets the facet
    surface : (6, 3) out, see `surface_at`
    """
    axis = 0
    for i in range(1, 3):
        if abs(normal[i]) < abs(normal[axis]):
            axis = i
    j, k = (axis + 1) % 3, (axis + 2) % 3
    # Two directions across the normal: e_axis x n, and that times n.
    first, second = np.zeros(3), np.empty(3)
    first[j], first[k] = -normal[k], normal[j]
    for i in range(3):
        m, o = (i + 1) % 3, (i + 2) % 3
        second[i] = normal[m] * first[o] - normal[o] * first[m]
    for _ in range(20):
        surface_at(powers, polynomial, place[0], place[1], surface)
        r1 = r2 = a11 = a12 = a21 = a22 = 0.0
        for i in range(3):
            d = x[i] - surface[0, i]
            r1 += first[i] * d
            r2 += second[i] * d
            a11 += first[i] * surface[1, i]
            a12 += first[i] * surface[2, i]
            a21 += second[i] * surface[1, i]
            a22 += second[i] * surface[2, i]
        determinant = a11 * a22 - a12 * a21
        if determinant == 0.0:
            return np.nan
        step_s = (a22 * r1 - a12 * r2) / determinant
        step_t = (a11 * r2 - a21 * r1) / determinant
        size = max(abs(step_s), abs(step_t))
        shorten = 1.0 if size < 0.7 else 0.7 / size
        place[0] += shorten * step_s
        place[1] += shorten * step_t
        if max(abs(place[0]), abs(place[1])) > 3.0:
            return np.nan
        if size < 1e-11:
            surface_at(powers, polynomial, place[0], place[1], surface)
            gap = 0.0
            for i in range(3):
                gap += normal[i] * (surface[0, i] - x[i])
            return gap * max(0.0, -facing_cosine(surface, normal)) if to_plane else gap
    return np.nan


@njit(cache=True)
def outside_facet(place, edges):  # type: ignore[no-untyped-def]
    """How far reference coordinates lie outside a facet, 0 or less within it.

    place : (2,); edges : see `facet_edges`
    """
    outside = -np.inf
    for k in range(edges.shape[0]):
        outside = max(outside, edges[k, 0] * place[0] + edges[k, 1] * place[1] + edges[k, 2])
    return outside


@njit(cache=True, error_model="numpy")
def gaps_along(points, normals, facet, places, powers, polynomials):  # type: ignore[no-untyped-def]
    """The gaps from samples to the planes of given facets, or of their continuations; nan where missed.

    points, normals : (n, 3) of the samples; facet : (n,) that each looks for; places : (n, 2) where to begin
    powers, polynomials : of all facets
    """
    gaps, surface = np.empty(points.shape[0]), np.empty((6, 3))
    for k in range(points.shape[0]):
        place = places[k].copy()
        gaps[k] = gap_along(powers, polynomials[facet[k]], points[k], normals[k], TO_PLANE, place, surface)
    return gaps


@njit(cache=True)
def _touch(nodes, first, second):  # type: ignore[no-untyped-def]
    for a in nodes[first]:
        for b in nodes[second]:
            if a == b:
                return True
    return False


@njit(cache=True)
def _belongs(place, edges, extents):  # type: ignore[no-untyped-def]
    for k in range(edges.shape[0]):
        if edges[k, 0] * place[0] + edges[k, 1] * place[1] + edges[k, 2] > extents[k]:
            return False
    return True


@njit(cache=True, parallel=True)
def find_opposite(  # type: ignore[no-untyped-def]
    points,
    normals,
    own,
    nodes,
    powers,
    polynomials,
    spheres,
    facing,
    order,
    axis,
    edges,
    extents,
    to_plane,
    reach,
    depth,
    hits,
    places,
    gaps,
    others,
):
    """For each sample of a wall every facet of the same surface that its normal meets, and the gaps.

    points, normals : (n_samples, 3) of the samples; own : (n_samples,) facet that bears each
    nodes : (n_facets, n_nodes); powers, polynomials : (n_facets, n_monomials, 3) of the facets
    spheres : (n_facets, 4) centre and radius; facing : (n_facets, 3) mean unit normals
    order : facets sorted by centre along `axis`
    edges : see `facet_edges`; extents : (n_facets, n_edges) how far outside of each edge a place still
        belongs to the facet; to_plane : see `gap_along`
    reach, depth : largest gap and largest penetration looked for [mm]
    hits : (n_samples, m) out, facets, -1 padded; places : (n_samples, m, 2) out; gaps : (n_samples, m) out
    others : (n_samples, k) out, every facet opposite that it may slide onto, -1 padded; with k = 0 facets
        farther off than one already found are left out
    """
    widest = spheres[:, 3].max() + max(reach, depth)
    ordered = spheres[order, axis]
    for sample in prange(points.shape[0]):
        place, surface = np.empty(2), np.empty((6, 3))
        hits[sample] = -1
        gaps[sample] = np.inf
        others[sample] = -1
        nearest = np.inf
        met = 0
        x = points[sample]
        count = 0
        low = np.searchsorted(ordered, x[axis] - widest)
        high = np.searchsorted(ordered, x[axis] + widest)
        for k in range(low, high):
            candidate = order[k]
            if candidate == own[sample]:
                continue
            distance = 0.0
            for i in range(3):
                distance += (x[i] - spheres[candidate, i]) ** 2
            if distance > (spheres[candidate, 3] + max(reach, depth)) ** 2:
                continue
            if others.shape[1] == 0 and np.sqrt(distance) - spheres[candidate, 3] > nearest:
                continue
            cosine = 0.0
            for i in range(3):
                cosine += facing[candidate, i] * normals[sample, i]
            if cosine > 0.5 + OPPOSED:  # the facet may curve by 30 degrees
                continue
            if _touch(nodes, own[sample], candidate):
                continue
            place[:] = 1.0 / 3.0 if edges.shape[0] == 3 else 0.0
            gap = gap_along(powers, polynomials[candidate], x, normals[sample], to_plane, place, surface)
            outside = outside_facet(place, edges)
            if not (-depth < gap < reach) or outside > NEIGHBOUR:
                continue
            if facing_cosine(surface, normals[sample]) > OPPOSED:
                continue
            if count < others.shape[1]:
                others[sample, count] = candidate
                count += 1
            if met < hits.shape[1] and _belongs(place, edges, extents[candidate]):
                hits[sample, met] = candidate
                places[sample, met] = place
                gaps[sample, met] = gap
                nearest = min(nearest, abs(gap))
                met += 1


def facet_powers(kind: ElementKind) -> tuple[IntArray, FloatArray]:
    """Powers (n_monomials, 2) of a facet kind and the matrix from nodal values to coefficients.

    kind : of the facets, at most quadratic in each coordinate
    """
    powers = np.ascontiguousarray(kind.monomials[:, :2])
    values = np.prod(kind.nodes[:, None, :] ** powers[None], axis=2)
    return powers, np.ascontiguousarray(np.linalg.inv(values))


def facet_edges(kind: ElementKind) -> FloatArray:
    """The edges of a facet kind, (n_edges, 3): a, b, c of each; a s + b t + c is 0 there, negative inside.

    kind : of the facets
    """
    if kind.n_corners == 3:
        return np.array([[0.0, -1.0, 0.0], [1.0, 1.0, -1.0], [-1.0, 0.0, 0.0]])
    return np.array([[0.0, -1.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.0]])


def edge_zones(kind: ElementKind, nodes: IntArray, points: FloatArray) -> FloatArray:
    """How far outside each edge of a facet its contacts begin to fade, and where they end, (n, n_edges, 2).

    Two facets share their edge's zone, as wide on both sides, so that their weights add up to one; where a
    facet has no neighbour, as at a plane of symmetry, the zone lies outside.

    kind : of the facets; nodes : (n, n_nodes); points : (n_points, 3) at rest
    """
    edges, n_corners = facet_edges(kind), kind.n_corners
    size = 1.0 if n_corners == 3 else 2.0
    ends = np.array([[k, (k + 1) % n_corners] for k in range(n_corners)])
    slopes = np.einsum("ead,fai->fedi", kind.shape_gradient(kind.nodes[ends].mean(axis=1)), points[nodes])
    along = edges[:, 0, None] * slopes[:, :, 1] - edges[:, 1, None] * slopes[:, :, 0]
    areas = np.linalg.norm(np.cross(slopes[:, :, 0], slopes[:, :, 1]), axis=2)
    across = areas / np.linalg.norm(along, axis=2)
    # The same edge has the same two corners.
    corners = np.sort(nodes[:, ends], axis=2).reshape(-1, 2)
    _, edge, shared = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    narrowest = np.full(len(shared), np.inf)
    np.minimum.at(narrowest, edge.ravel(), across.ravel())
    zone = ZONE * size * narrowest[edge.ravel()].reshape(across.shape) / across
    alone = (shared == 1)[edge.ravel()].reshape(across.shape)
    return np.stack([np.where(alone, 0.0, -zone), np.where(alone, 0.5 * zone, zone)], axis=2)
