"""Distances between walls of a finger that face each other, across a chamber or between folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import State
from tubefoot.fea.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Samples:
    """Points on a wall, at the quadrature points of its facets.

    nodes : (n, n_nodes) points of each sample's facet
    shape : (n, n_nodes), slopes : (n, 2, n_nodes) shape functions and their derivatives there
    """

    nodes: IntArray
    shape: FloatArray
    slopes: FloatArray

    @classmethod
    def on(cls, mesh: Mesh, walls: tuple[str, ...]) -> Samples:
        """Samples on some facet sets of one facet kind.

        mesh : the mesh; walls : names of the facet sets
        """
        sets = [mesh.facet_set(wall) for wall in walls]
        kind = element_kind(sets[0].kind)
        nodes = np.vstack([facets.nodes for facets in sets])
        n_q = len(kind.quadrature_points)
        shape = kind.shape(kind.quadrature_points)
        slopes = np.moveaxis(kind.shape_gradient(kind.quadrature_points), -1, 1)
        repeats = (len(nodes), 1)
        return cls(np.repeat(nodes, n_q, axis=0), np.tile(shape, repeats), np.tile(slopes, (*repeats, 1)))

    def points(self, positions: FloatArray) -> FloatArray:
        """Positions of the samples, (n, 3) [mm].

        positions : (n_points, 3) of the mesh's points
        """
        return np.einsum("na,nai->ni", self.shape, positions[self.nodes])

    def normals(self, positions: FloatArray) -> FloatArray:
        """Unit normals out of the solid, (n, 3).

        positions : (n_points, 3) of the mesh's points
        """
        tangents = np.einsum("nda,nai->ndi", self.slopes, positions[self.nodes])
        cross = np.cross(tangents[:, 0], tangents[:, 1])
        return cross / np.linalg.norm(cross, axis=1)[:, None]

    def chosen(self, mask: NDArray[np.bool_]) -> Samples:
        """Some of the samples.

        mask : (n,) which
        """
        return Samples(self.nodes[mask], self.shape[mask], self.slopes[mask])


@dataclass(frozen=True)
class FacingWalls:
    """Two walls that face each other at rest: samples of the one, samples of the other, and a name."""

    name: str
    here: Samples
    there: Samples

    def gaps(self, positions: FloatArray) -> FloatArray:
        """Distance of each sample to the nearest one opposite, along its own normal, (n,) [mm].

        Negative where the walls overlap.

        positions : (n_points, 3) of the mesh's points
        """
        points, others = self.here.points(positions), self.there.points(positions)
        _, nearest = cKDTree(others).query(points)
        return np.einsum("ni,ni->n", others[nearest] - points, self.here.normals(positions))


def facing_walls(mesh: Mesh, pitch: float, units: int) -> list[FacingWalls]:
    """The walls of a finger that can touch: partition and valleys, flanks in a slot, folds outside.

    mesh : of a finger; pitch : length of a unit [mm]; units : how many
    """
    found = []
    for hand in ("right", "left"):
        partition = Samples.on(mesh, (f"partition_inside_{hand}",))
        valley = Samples.on(mesh, (f"valley_inside_{hand}",))
        found.append(FacingWalls(f"partition and {hand} chamber wall", partition, valley))
        # Inside, the flanks of one unit face each other; outside, those of neighbouring units.
        for where, first in (("inside", 0.0), ("outside", 0.5)):
            flanks = Samples.on(mesh, (f"flank_{where}_{hand}",))
            upward = flanks.normals(mesh.points)[:, 2] > 0
            group = np.floor(flanks.points(mesh.points)[:, 2] / pitch - first).astype(int)
            for number in range(units if where == "inside" else units - 1):
                lower, upper = (flanks.chosen((group == number) & side) for side in (upward, ~upward))
                found.append(FacingWalls(f"{hand} flanks {where}, unit {number + 1}", lower, upper))
    return found


def smallest_gap(mesh: Mesh, walls: list[FacingWalls], state: State) -> tuple[float, str]:
    """The smallest gap [mm], negative for an overlap, and which walls it is between.

    mesh : the mesh; walls : of `facing_walls`; state : where to measure
    """
    positions = mesh.points + state.unknowns[: mesh.points.size].reshape(-1, 3)
    found = [(float(pair.gaps(positions).min()), pair.name) for pair in walls]
    return min(found, default=(float("inf"), ""))
