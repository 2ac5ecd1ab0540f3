"""Octant of a thick-walled sphere and quarter of a thick-walled cylinder, closed by symmetry planes."""

from __future__ import annotations

import numpy as np

from mapped_box import joined, mapped_box, plane
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh


def at_radius(radius: float, axes: tuple[int, ...] = (0, 1, 2)):
    """Test of points that lie on a sphere, or on a cylinder when two axes are given."""
    return lambda points: np.abs(np.linalg.norm(points[:, axes], axis=1) - radius) < 1e-7


def sphere_octant(kind: str, inner: float, outer: float, radial: int, around: int) -> Mesh:
    """Facet sets: inside, outside, x_min, y_min, z_min."""

    def patch(axis: int) -> Mesh:
        def mapping(points: np.ndarray) -> np.ndarray:
            radius = inner + (outer - inner) * points[:, 0]
            s, t = np.tan(points[:, 1] * np.pi / 4), np.tan(points[:, 2] * np.pi / 4)
            direction = np.column_stack([np.ones(len(points)), s, t])
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            return np.roll(radius[:, None] * direction, axis, axis=1)

        return mapped_box(kind, (radial, around, around), mapping)

    places = {f"{name}_min": plane(axis, 0.0) for axis, name in enumerate("xyz")}
    places |= {"inside": at_radius(inner), "outside": at_radius(outer)}
    return joined([patch(axis) for axis in range(3)], places)


def cylinder_quarter(kind: str, inner: float, outer: float, radial: int, around: int, height: float) -> Mesh:
    """Facet sets: inside, x_min, y_min, z_min, z_max, and cavity: the inside with a lid at z = height.

    The lid's triangles, quadrilaterals with two corners at the axis, use points `lid` that belong to no cell.
    """

    def mapping(points: np.ndarray) -> np.ndarray:
        radius, angle = inner + (outer - inner) * points[:, 0], np.pi / 2 * points[:, 1]
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height * points[:, 2]])

    places = {"x_min": plane(0, 0.0), "y_min": plane(1, 0.0), "z_min": plane(2, 0.0)}
    places |= {"z_max": plane(2, height), "inside": at_radius(inner, (0, 1))}
    mesh = mapped_box(kind, (radial, around, 1), mapping, places)
    return _with_lid(mesh, inner, around, height)


def _with_lid(mesh: Mesh, inner: float, around: int, height: float) -> Mesh:
    ring = np.flatnonzero(at_radius(inner, (0, 1))(mesh.points) & plane(2, height)(mesh.points))
    ring = ring[np.argsort(np.arctan2(mesh.points[ring, 1], mesh.points[ring, 0]))]
    assert len(ring) == 2 * around + 1
    start = len(mesh.points)
    axis, halves = start, start + 1 + np.arange(len(ring))
    lid = np.vstack([[0.0, 0.0, height], (mesh.points[ring] + [0.0, 0.0, height]) / 2])
    quads = [
        # Corners ring, ring, axis, axis, then mid-sides and middle; the normal points down, into the fluid.
        [ring[k + 2], ring[k], axis, axis, ring[k + 1], halves[k], axis, halves[k + 2], halves[k + 1]]
        for k in range(0, len(ring) - 1, 2)
    ]
    facets = dict(mesh.facets)
    facets["lid"] = FacetSet("quad9", np.array(quads))
    facets["cavity"] = FacetSet("quad9", np.vstack([mesh.facets["inside"].nodes, quads]))
    blocks = tuple(CellBlock(block.kind, block.nodes, block.region) for block in mesh.blocks)
    return Mesh(np.vstack([mesh.points, lid]), blocks, mesh.regions, facets)
