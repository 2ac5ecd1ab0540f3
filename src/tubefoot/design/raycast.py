"""Rays through a triangle mesh: where they enter and leave it, by Moeller and Trumbore's test (1997)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.surface import FloatArray, IntArray, TriangleMesh

GRAZING = 1e-9
"""Determinant, over the product of edge lengths, below which a ray runs in a triangle's plane."""
CELL_RAYS = 64
"""Rays looked at together, about."""


def crossings(mesh: TriangleMesh, origin: FloatArray, direction: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distances [mm] along one ray at which it crosses the surface, sorted, and the triangles crossed.

    Crossings at one place (a ray through a shared edge) count once.

    mesh : closed surface
    origin : (3,) start of the ray [mm]
    direction : (3,) unit vector
    """
    distance, hit = _crossed(mesh.corners, origin, direction)
    along, facet = distance[hit], np.flatnonzero(hit)
    order = np.argsort(along)
    along, facet = along[order], facet[order]
    new = np.concatenate([[True], np.diff(along) > 1e-6]) if len(along) else np.zeros(0, dtype=bool)
    return along[new], facet[new]


def blocked(mesh: TriangleMesh, origins: FloatArray, direction: FloatArray) -> NDArray[np.bool_]:
    """Whether each of many parallel rays meets the surface ahead of its origin, (n,).

    Rays are gathered in cells across the direction, so that each meets only the triangles near it.

    mesh : surface
    origins : (n, 3) starts [mm], a little off the surface
    direction : (3,) unit vector, the same for all
    """
    frame = _frame(direction)
    corners, starts = mesh.corners @ frame.T, origins @ frame.T
    low, high = corners.min(axis=1), corners.max(axis=1)
    span = np.ptp(starts[:, :2], axis=0) + 1e-9
    cell_size = np.sqrt(span[0] * span[1] * CELL_RAYS / max(1, len(starts))) + 1e-9
    cells = np.floor((starts[:, :2] - starts[:, :2].min(axis=0)) / cell_size).astype(np.int64)
    _, owner = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(owner.reshape(-1), kind="stable")
    result = np.zeros(len(starts), dtype=bool)
    for group in np.split(order, np.flatnonzero(np.diff(owner.reshape(-1)[order])) + 1):
        rays = starts[group]
        near = np.all(
            (low[:, :2] <= rays[:, :2].max(axis=0)) & (high[:, :2] >= rays[:, :2].min(axis=0)), axis=1
        )
        near &= high[:, 2] > rays[:, 2].min()
        if near.any():
            result[group] = _covered(corners[near], rays).any(axis=1)
    return result


def _frame(direction: FloatArray) -> FloatArray:
    """Rotation that turns the direction into the third axis, (3, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(helper, direction)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(direction, first), direction])


def _covered(corners: FloatArray, rays: FloatArray) -> NDArray[np.bool_]:
    """Whether a triangle lies ahead of a ray along the third axis, (rays, triangles)."""
    a = corners[:, 0]
    ab, ac = corners[:, 1] - a, corners[:, 2] - a
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    scale = np.linalg.norm(ab, axis=1) * np.linalg.norm(ac, axis=1) + 1e-30
    flat = np.abs(area) < GRAZING * scale
    inverse = 1.0 / np.where(flat, 1.0, area)
    off = rays[:, None] - a[None]
    u = (off[..., 0] * ac[:, 1] - off[..., 1] * ac[:, 0]) * inverse
    v = (ab[:, 0] * off[..., 1] - ab[:, 1] * off[..., 0]) * inverse
    ahead = u * ab[:, 2] + v * ac[:, 2] - off[..., 2]
    return (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & ~flat & (ahead > 1e-9)


def _crossed(
    corners: FloatArray, origin: FloatArray, direction: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Distance along a ray to each triangle's plane, whether it crosses the triangle: (triangles,) each."""
    a = corners[:, 0]
    ab, ac = corners[:, 1] - a, corners[:, 2] - a
    scale = np.linalg.norm(ab, axis=1) * np.linalg.norm(ac, axis=1) + 1e-30
    across = np.cross(direction, ac)
    determinant = np.einsum("ti,ti->t", across, ab)
    flat = np.abs(determinant) < GRAZING * scale
    inverse = 1.0 / np.where(flat, 1.0, determinant)
    offset = origin - a
    u = np.einsum("ti,ti->t", offset, across) * inverse
    turned = np.cross(offset, ab)
    v = turned @ direction * inverse
    distance = np.einsum("ti,ti->t", ac, turned) * inverse
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
    return distance, inside & ~flat & (distance > 1e-9)
