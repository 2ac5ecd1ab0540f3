"""The load case that all programs solve: the reference finger, clamped, with a pressure in either chamber.

The finger's mesh of 27-node hexahedra is recast for elements that other programs have: nodes are dropped
(20 or 8 nodes), or each cell is cut into six ten-node tetrahedra.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured import Usage
from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.fea.elements import element_kind
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.measures import SectionRotation
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh
from tubefoot.fea.profile_mesh import Divisions
from tubefoot.units import DEG, KPA

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FACETS = {"hexahedron27": "quad9", "hexahedron20": "quad8", "hexahedron8": "quad", "tetra10": "triangle6"}
"""Facet kind of each cell kind."""
HANDS = ("right", "left")


@dataclass(frozen=True)
class FingerLoad:
    """A meshed finger with its chamber pressures.

    mesh : half of it; pressures : right, left [MPa]; design : for the material
    """

    design: FingerDesign
    mesh: Mesh
    pressures: tuple[float, float]

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n_points, 3) mask of the displacement components that are zero."""
        held = np.zeros(self.mesh.points.shape, dtype=bool)
        for axis, points in clamp_half_finger(self.mesh).items():
            held[points, axis] = True
        return held

    @property
    def tip(self) -> IntArray:
        """Numbers of the points of the tip face."""
        return self.mesh.facet_set("tip").points

    def bend_deg(self, displacements: FloatArray) -> float:
        """Turn of the tip face.

        displacements : (n_points, 3) [mm]; only those of the tip are looked at
        """
        angle, _ = SectionRotation(self.mesh, self.tip)(displacements.ravel())
        return angle / DEG

    def save(self, path: Path) -> Path:
        """Write points, cells, held components, walls, pressures and material for another program."""
        body, block = self.design.body, self.mesh.blocks[0]
        walls = {f"wall_{hand}": self.mesh.facet_set(f"cavity_{hand}").nodes for hand in HANDS}
        np.savez(
            path,
            points=self.mesh.points,
            cells=block.nodes,
            kind=block.kind,
            held=self.held,
            pressures=self.pressures,
            mu=body.scale * np.array(body.mu_mpa),
            alpha=body.alpha,
            bulk=body.bulk_modulus_mpa,
            **walls,
        )
        return path


@dataclass(frozen=True)
class PeerRun:
    """What another program made of the load case.

    iterations : of Newton's method, those of increments that were given up included
    displacements : (n_points, 3) [mm], correct on the tip at least; None when it did not reach the full load
    message : why not
    """

    usage: Usage
    iterations: int
    displacements: FloatArray | None
    message: str = ""


def divisions_named(design: FingerDesign, name: str) -> Divisions:
    """Divisions by a short name: an element size as "2", or "3/2" for size 3 with every cell halved."""
    size, _, factor = name.partition("/")
    divisions = Divisions.of(design.profile, float(size))
    return divisions.refined(int(factor)) if factor else divisions


def load_case(design_path: Path, mesh_name: str, kind: str, pressures_kpa: tuple[float, float]) -> FingerLoad:
    """The load case on a mesh of the given fineness, see `divisions_named`, and cell kind."""
    design = load_design(design_path)
    mesh = finger_mesh(design.profile, divisions=divisions_named(design, mesh_name))
    right, left = pressures_kpa
    return FingerLoad(design, recast(mesh, kind), (right * KPA, left * KPA))


def recast(mesh: Mesh, kind: str) -> Mesh:
    """A mesh of 27-node hexahedra as one of another kind, corners numbered first."""
    block, element, facet = mesh.blocks[0], element_kind(kind), element_kind(FACETS[kind])
    if kind == "tetra10":
        cells, facets, per_cell = _tetrahedra(mesh.points, block), _triangles, 6
    else:
        cells, facets, per_cell = block.nodes[:, : element.n_nodes], _first(facet.n_nodes), 1
    corners = np.unique(cells[:, : element.n_corners])
    order = np.r_[corners, np.setdiff1d(np.unique(cells), corners)]
    number = np.full(len(mesh.points), -1)
    number[order] = np.arange(len(order))
    sets = {
        name: FacetSet(FACETS[kind], number[facets(facet_set.nodes)])
        for name, facet_set in mesh.facets.items()
    }
    recast_block = CellBlock(kind, number[cells], np.repeat(block.region, per_cell))
    return Mesh(mesh.points[order], (recast_block,), mesh.regions, sets)


def _first(n: int) -> Callable[[IntArray], IntArray]:
    return lambda nodes: nodes[:, :n]


def _tetrahedra(points: FloatArray, block: CellBlock) -> IntArray:
    """Six tetrahedra a cell, (6 n_cells, 10).

    The smallest corner of a cell is joined to the two triangles of each face that does not hold it; each face
    is cut at its smallest corner, so that neighbours agree (Dompierre et al., 1999).
    """
    kind = block.element
    place = {tuple(node): k for k, node in enumerate(kind.nodes)}
    middle = {(a, b): place[tuple((kind.nodes[a] + kind.nodes[b]) / 2)] for a, b in permutations(range(8), 2)}
    found = []
    for nodes in block.nodes:
        apex = int(np.argmin(nodes[:8]))
        for face in kind.faces:
            ring = list(face[:4])
            if apex in ring:
                continue
            k = int(np.argmin(nodes[ring]))
            for second, third in ((k + 1, k + 2), (k + 2, k + 3)):
                corners = [ring[k], ring[third % 4], ring[second % 4], apex]
                edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
                mids = [middle[corners[a], corners[b]] for a, b in edges]
                found.append(nodes[corners + mids])
    cells = np.array(found)
    a, b, c, d = points[cells[:, :4]].transpose(1, 0, 2)
    volumes = np.einsum("ci,ci->c", np.cross(b - a, c - a), d - a)
    if not (volumes > 0).all():
        raise AssertionError("a tetrahedron is inside out")
    return cells


def _triangles(facets: IntArray) -> IntArray:
    """Two six-node triangles a nine-node facet, cut at its smallest corner."""
    found = []
    for nodes in facets:
        k = int(np.argmin(nodes[:4]))
        a, b, c, d = (nodes[(k + i) % 4] for i in range(4))
        ab, bc, cd, da = (nodes[4 + (k + i) % 4] for i in range(4))
        found += [(a, b, c, ab, bc, nodes[8]), (a, c, d, nodes[8], cd, da)]
    return np.array(found)


def corner_faces(
    cells: IntArray, faces: tuple[tuple[int, ...], ...]
) -> dict[tuple[int, ...], tuple[int, int]]:
    """Sorted corner numbers of each cell face to (cell, face), counted from 0."""
    found = {}
    for cell, nodes in enumerate(cells):
        for number, face in enumerate(faces):
            found[tuple(sorted(nodes[list(face)].tolist()))] = (cell, number)
    return found


def corner_sets(facets: FacetSet) -> list[tuple[int, ...]]:
    """Sorted corner numbers of each facet."""
    n = 3 if facets.kind.startswith("triangle") else 4
    return [tuple(sorted(nodes[:n].tolist())) for nodes in facets.nodes]
