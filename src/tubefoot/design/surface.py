"""Triangle meshes as they go to a printer: closed, oriented, measured by their own facets, in mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SAME_POINT_MM = 1e-6
"""Corners closer than this are one."""


@dataclass(frozen=True)
class TriangleMesh:
    """points (n, 3) [mm]; triangles (m, 3) corner indices, normals pointing out of the solid."""

    points: FloatArray
    triangles: IntArray

    @classmethod
    def merged(cls, points: FloatArray, triangles: IntArray) -> TriangleMesh:
        """The mesh with coinciding corners made one and triangles without area left out.

        points : (n, 3), may repeat
        triangles : (m, 3)
        """
        keys = np.round(points / SAME_POINT_MM).astype(np.int64)
        _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        facets = index.reshape(-1)[triangles]
        i, j, k = facets.T
        return cls(points[first], facets[(i != j) & (j != k) & (k != i)])

    @classmethod
    def together(cls, meshes: list[TriangleMesh]) -> TriangleMesh:
        """Several meshes as one, corners kept apart.

        meshes : at least one
        """
        offsets = np.cumsum([0] + [len(mesh.points) for mesh in meshes[:-1]])
        return cls(
            np.concatenate([mesh.points for mesh in meshes]),
            np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, offsets, strict=True)]),
        )

    @property
    def corners(self) -> FloatArray:
        """(m, 3, 3): triangle, corner, coordinate [mm]."""
        return self.points[self.triangles]

    @property
    def normals(self) -> FloatArray:
        """Unit normals, (m, 3)."""
        a, b, c = self.corners.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)

    @property
    def volume(self) -> float:
        """Enclosed volume [mm^3], by the divergence theorem; negative where the mesh is inside out."""
        a, b, c = self.corners.transpose(1, 0, 2)
        return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the bounding box [mm]."""
        return self.points.min(axis=0), self.points.max(axis=0)

    @property
    def size(self) -> FloatArray:
        """Extent along x, y, z [mm]."""
        low, high = self.bounds
        return high - low

    def open_edges(self) -> int:
        """Number of directed edges without exactly one opposite partner: 0 for a closed, oriented mesh."""
        edges = np.concatenate(
            [self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]
        )
        n = len(self.points)
        ahead, counts = np.unique(edges[:, 0] * n + edges[:, 1], return_counts=True)
        back = edges[:, 1] * n + edges[:, 0]
        lonely = int(np.sum(~np.isin(back, ahead)))
        return lonely + int(np.sum(counts[counts > 1]))

    def moved(self, rotation: FloatArray, shift: FloatArray) -> TriangleMesh:
        """The mesh rotated, then shifted.

        rotation : (3, 3) proper rotation
        shift : (3,) [mm]
        """
        return TriangleMesh(self.points @ rotation.T + shift, self.triangles)
