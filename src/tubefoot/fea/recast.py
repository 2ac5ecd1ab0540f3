"""A mesh of 27-node hexahedra as cells that other programs have: 20 or 8 nodes, or ten-node tetrahedra."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FACETS = {"hexahedron27": "quad9", "hexahedron20": "quad8", "hexahedron8": "quad", "tetra10": "triangle6"}
"""Facet kind of each cell kind."""


def recast(mesh: Mesh, kind: str) -> Mesh:
    """A mesh of 27-node hexahedra as one of another kind, corners numbered first.

    mesh : one block of hexahedron27, or of `kind` already; kind : one of `FACETS`

    Raises GeometryError for other cells, or when a cell is too distorted to be cut into tetrahedra.
    """
    block, element, facet = mesh.blocks[0], element_kind(kind), element_kind(FACETS[kind])
    if block.kind == kind:
        return mesh
    if block.kind != "hexahedron27":
        raise GeometryError(f"cells of kind {block.kind} cannot be recast as {kind}; mesh with hexahedra")
    split: Callable[[IntArray], IntArray]
    if kind == "tetra10":
        cells, split, per_cell = _tetrahedra(mesh.points, block), _triangles, 6
    else:
        cells, split, per_cell = block.nodes[:, : element.n_nodes], _first(facet.n_nodes), 1
    corners = np.unique(cells[:, : element.n_corners])
    order = np.r_[corners, np.setdiff1d(np.unique(cells), corners)]
    number = np.full(len(mesh.points), -1)
    number[order] = np.arange(len(order))
    sets = {
        name: FacetSet(FACETS[kind], number[split(facet_set.nodes)])
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
        raise GeometryError("a cell is too distorted to be cut into tetrahedra; use a smaller element size")
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
