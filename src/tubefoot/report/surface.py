"""The deformed surface of a solved state, read from its VTU file and split into flat triangles.

A file holds the whole finger or its half y >= 0. The other half follows by mirroring: under y -> -y the shear
components S13 and S23 (3 = y) change their sign, every other quantity keeps it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SUBDIVISIONS = 2
"""How often VTK halves a curved cell face before it calls it flat."""
ODD_IN_Y = ("s13_kpa", "s23_kpa")
ON_PLANE_MM = 1e-6


@dataclass(frozen=True)
class Surface:
    """Triangles of the solid's surface at rest and deformed, with the values at their corners.

    rest, deformed : (n_points, 3) [mm]; triangles : (n, 3) point numbers, normals outwards
    values : field name to (n_points,)
    """

    rest: FloatArray
    deformed: FloatArray
    triangles: IntArray
    values: dict[str, FloatArray]

    @property
    def is_half(self) -> bool:
        """Whether this is the half y >= 0 with a cut face at y = 0."""
        return bool(self.rest[:, 1].min() >= -ON_PLANE_MM and self.cut_triangles.any())

    @property
    def cut_triangles(self) -> NDArray[np.bool_]:
        """(n,) which triangles lie in the mid-plane y = 0."""
        on_plane = np.abs(self.rest[:, 1]) < ON_PLANE_MM
        return np.asarray(on_plane[self.triangles].all(axis=1))

    @property
    def point_areas(self) -> FloatArray:
        """(n_points,) area that each point stands for, at rest [mm^2]."""
        a, b, c = self.rest[self.triangles].transpose(1, 0, 2)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        sums = np.bincount(self.triangles.ravel(), np.repeat(area, 3), minlength=len(self.rest))
        return sums.astype(float)

    def value(self, field: str) -> FloatArray:
        """(n_points,) values of a field.

        field : name of the point data, unit at its end

        Raises ConfigError when the file does not hold it.
        """
        try:
            return self.values[field]
        except KeyError:
            known = ", ".join(sorted(self.values))
            raise ConfigError(f"the field file holds no `{field}` at its points; it has: {known}") from None

    def whole(self) -> Surface:
        """The surface of the whole finger: a half with its mirror image, without the cut between them."""
        if not self.is_half:
            return self
        kept = self.triangles[~self.cut_triangles]
        flip = np.array([1.0, -1.0, 1.0])
        n = len(self.rest)
        return Surface(
            np.vstack([self.rest, self.rest * flip]),
            np.vstack([self.deformed, self.deformed * flip]),
            np.vstack([kept, kept[:, ::-1] + n]),
            {
                field: np.r_[value, -value if field in ODD_IN_Y else value]
                for field, value in self.values.items()
            },
        )

    def outside(self) -> Surface:
        """The shell that is seen from outside: without walls of closed chambers."""
        shell = _shells(self.triangles, len(self.rest))
        half_shells = {shell[np.argmax(sign * self.rest[:, 1])] for sign in (1, -1)}
        return replace(
            self, triangles=self.triangles[np.isin(shell[self.triangles[:, 0]], list(half_shells))]
        )

    def shell_of_largest_y(self, among: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of some triangles belong to the shell that reaches furthest across, (n chosen,).

        among : (n,) the triangles to look at; leave out the cut, which joins outside and chambers
        """
        triangles = self.triangles[among]
        shell = _shells(triangles, len(self.rest))
        used = np.unique(triangles)
        outer = shell[used[np.argmax(self.rest[used, 1])]]
        return np.asarray(shell[triangles[:, 0]] == outer)

    def cut(self) -> Surface:
        """The mid-plane face alone.

        Raises ConfigError when the file holds no half finger.
        """
        if not self.is_half:
            raise ConfigError("the field file holds no half finger y >= 0, so it has no cut at the mid-plane")
        return replace(self, triangles=self.triangles[self.cut_triangles])

    def outlines(self) -> list[IntArray]:
        """Closed loops of point numbers around the triangles, longest first; a face with holes has many."""
        edges = np.vstack([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
        following = dict(edges[first[count == 1]].tolist())
        loops = []
        while following:
            start, point = following.popitem()
            loop = [start]
            while point != start:
                loop.append(point)
                point = following.pop(point)
            loops.append(np.array(loop))
        return sorted(loops, key=len, reverse=True)


def _shells(triangles: IntArray, n_points: int) -> IntArray:
    """(n_points,) number of the connected shell that each point belongs to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rows, columns = triangles.ravel(), np.roll(triangles, 1, axis=1).ravel()
    graph = coo_array((np.ones(rows.size), (rows, columns)), shape=(n_points, n_points))
    return np.asarray(connected_components(graph, directed=False)[1])


def read_surface(path: Path, subdivisions: int = SUBDIVISIONS) -> Surface:
    """The surface of a solved state.

    path : VTU file with point data `displacement_mm` and stresses in kPa
    subdivisions : how often a curved cell face is halved

    Raises ConfigError when it cannot be read or holds no displacement.
    """
    import pyvista

    try:
        grid = pyvista.read(path)
    except (OSError, ValueError, RuntimeError) as error:
        raise ConfigError(f"{path}: cannot be read as a VTU file: {error}") from error
    if "displacement_mm" not in grid.point_data:
        raise ConfigError(f"{path} has no point data `displacement_mm`; `tubefoot solve` writes it")
    shell = grid.extract_surface(
        nonlinear_subdivision=subdivisions, algorithm="dataset_surface"
    ).triangulate()
    values = {
        name: np.asarray(shell.point_data[name], dtype=float)
        for name in shell.point_data
        if shell.point_data[name].ndim == 1 and name.endswith("_kpa")
    }
    rest = np.asarray(shell.points, dtype=float)
    displacement = np.asarray(shell.point_data["displacement_mm"], dtype=float)
    triangles = shell.faces.reshape(-1, 4)[:, 1:].astype(np.int64)
    return Surface(rest, rest + displacement, triangles, values)
