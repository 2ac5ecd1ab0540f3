"""Structured meshes of mapped unit cubes, of every cell kind, with facets named by place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import permutations, product

import numpy as np

from tubefoot.fea.elements import element_kind
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh

Places = Mapping[str, Callable[[np.ndarray], np.ndarray]]
"""Facet set name to a test of points (n, 3): a facet belongs when all its points pass."""


def plane(axis: int, value: float, tolerance: float = 1e-9):
    """Test of points that lie in a coordinate plane."""
    return lambda points: np.abs(points[:, axis] - value) < tolerance


BOX_PLACES: Places = {
    f"{name}_{end}": plane(axis, value)
    for axis, name in enumerate("xyz")
    for end, value in (("min", 0.0), ("max", 1.0))
}


def mapped_box(
    kind: str,
    divisions: tuple[int, int, int],
    mapping: Callable[[np.ndarray], np.ndarray] = lambda points: points,
    places: Places | None = None,
) -> Mesh:
    """Mesh of the unit cube under a mapping of points (n, 3).

    Without `places`, facets are named x_min ... z_max by the faces of the cube.
    """
    reference, cells = _unit_cells(kind)
    shape = 2 * np.array(divisions) + 1
    corners = np.array(list(product(*(range(n) for n in divisions)))) * 2
    lattice = (corners[:, None, None] + reference[cells][None]).reshape(-1, len(reference[cells][0]), 3)
    numbers = np.ravel_multi_index(np.round(lattice).astype(int).transpose(2, 0, 1), shape)
    used, nodes = np.unique(numbers, return_inverse=True)
    flat = np.stack(np.unravel_index(used, shape), axis=1) / (shape - 1.0)
    block = CellBlock(kind, nodes.reshape(numbers.shape), np.zeros(len(numbers), dtype=np.int64))
    if places is None:
        facets = place_facets(flat, block, BOX_PLACES)
        return Mesh(mapping(flat), (block,), ("body",), facets)
    points = mapping(flat)
    return Mesh(points, (block,), ("body",), place_facets(points, block, places))


def joined(meshes: list[Mesh], places: Places) -> Mesh:
    """One mesh of several of the same kind that meet point by point."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    stacked = np.vstack([mesh.points for mesh in meshes])
    _, first, merged = np.unique(np.round(stacked, 8) + 0.0, axis=0, return_index=True, return_inverse=True)
    nodes = np.vstack(
        [
            merged.ravel()[mesh.blocks[0].nodes + start]
            for mesh, start in zip(meshes, starts[:-1], strict=True)
        ]
    )
    points = stacked[first]
    block = CellBlock(meshes[0].blocks[0].kind, nodes, np.zeros(len(nodes), dtype=np.int64))
    return Mesh(points, (block,), ("body",), place_facets(points, block, places))


def outer_faces(block: CellBlock) -> np.ndarray:
    """Faces that belong to one cell only, (n, n_face_nodes)."""
    faces = np.array(block.element.faces)
    nodes = block.nodes[:, faces].reshape(-1, faces.shape[1])
    _, index, count = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True, return_counts=True)
    return nodes[index[count == 1]]


def place_facets(points: np.ndarray, block: CellBlock, places: Places) -> dict[str, FacetSet]:
    """Outer facets by place."""
    outer = outer_faces(block)
    kind = block.element.face_kind
    return {
        name: FacetSet(kind, outer[test(points)[outer].all(axis=1)])
        for name, test in places.items()
        if test(points)[outer].all(axis=1).any()
    }


def _unit_cells(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on the lattice 0, 1, 2 of one cube, and the cells that fill it."""
    element = element_kind(kind)
    if kind.startswith("hexahedron"):
        return element.nodes + 1.0, np.arange(element.n_nodes)[None]
    nodes = []
    for order in permutations(range(3)):
        steps = np.cumsum(np.eye(3)[list(order)], axis=0)
        if np.linalg.det(np.eye(3)[list(order)]) < 0:
            steps = steps[[1, 0, 2]]
        nodes.append(2.0 * element.nodes @ steps)
    return np.vstack(nodes), np.arange(6 * element.n_nodes).reshape(6, -1)


def symmetry(mesh: Mesh, **planes: str) -> dict[int, np.ndarray]:
    """Held points: `symmetry(mesh, x="x_min")` holds the x displacement on the set x_min.

    Several set names may be given, separated by blanks.
    """
    held = {}
    for axis, names in planes.items():
        sets = [mesh.facet_set(name).points for name in names.split()]
        held["xyz".index(axis)] = np.unique(np.concatenate(sets))
    return held
