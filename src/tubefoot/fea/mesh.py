"""A mesh: points, one block of cells per element kind, named regions of cells and named sets of facets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import ElementKind, element_kind

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class CellBlock:
    """Cells of one kind.

    kind : meshio cell type, e.g. hexahedron27
    nodes : (n_cells, n_nodes) point numbers, VTK order
    region : (n_cells,) number of the region each cell lies in
    """

    kind: str
    nodes: IntArray
    region: IntArray

    @property
    def element(self) -> ElementKind:
        """Shape functions and quadrature of these cells."""
        return element_kind(self.kind)


@dataclass(frozen=True)
class FacetSet:
    """Facets of one kind, normals pointing out of the solid.

    kind : meshio cell type, e.g. quad9
    nodes : (n_facets, n_nodes) point numbers
    """

    kind: str
    nodes: IntArray

    @property
    def points(self) -> IntArray:
        """Numbers of the points that lie on the facets, sorted."""
        return np.unique(self.nodes)


@dataclass(frozen=True)
class Mesh:
    """Points, cells in named regions, named facet sets.

    points : (n_points, 3) [mm]
    """

    points: FloatArray
    blocks: tuple[CellBlock, ...]
    regions: tuple[str, ...]
    facets: dict[str, FacetSet] = field(default_factory=dict)

    @property
    def n_cells(self) -> int:
        """Number of cells of all kinds."""
        return sum(len(block.nodes) for block in self.blocks)

    def facet_set(self, name: str) -> FacetSet:
        """A named facet set.

        name : one of the names in `facets`

        Raises ConfigError when there is none of that name.
        """
        try:
            return self.facets[name]
        except KeyError:
            known = ", ".join(sorted(self.facets))
            raise ConfigError(f"mesh has no facet set `{name}`; it has: {known}") from None


def jacobian_at(points: FloatArray, block: CellBlock, reference: FloatArray) -> FloatArray:
    """Jacobian matrices of the map from the reference cell, (n_cells, n_reference, 3, 3).

    points : (n_points, 3) [mm]
    block : cells
    reference : (n_reference, 3) reference coordinates
    """
    gradient = block.element.shape_gradient(reference)
    return np.einsum("cai,qaj->cqij", points[block.nodes], gradient, optimize=True)


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Smallest scaled Jacobian of each cell, over its corners and quadrature points, (n_cells,).

    1 is a right-angled cell, 0 or less one that is folded over. For simplices the value of an
    equilateral cell is scaled to 1.

    mesh : the mesh to look at
    """
    found = []
    for block in mesh.blocks:
        kind = block.element
        reference = np.vstack([kind.nodes[: kind.n_corners], kind.quadrature_points])
        matrices = jacobian_at(mesh.points, block, reference)
        columns = np.linalg.norm(matrices, axis=2).prod(axis=-1)
        ratio = np.linalg.det(matrices) / np.maximum(columns, 1e-300)
        found.append(ratio.min(axis=1) * (np.sqrt(2.0) if kind.name.startswith("tetra") else 1.0))
    return np.concatenate(found)


def require_quality(mesh: Mesh, limit: float = 0.05) -> float:
    """Smallest scaled Jacobian of the mesh.

    mesh : the mesh to look at
    limit : smallest value that is accepted

    Raises GeometryError naming the worst cell when it lies under the limit.
    """
    quality = scaled_jacobian(mesh)
    worst = int(np.argmin(quality))
    if quality[worst] < limit:
        nodes = np.concatenate([block.nodes[:, 0] for block in mesh.blocks])
        x, y, z = mesh.points[nodes[worst]]
        raise GeometryError(
            f"mesh cell {worst} near x = {x:.2f}, y = {y:.2f}, z = {z:.2f} mm has scaled Jacobian "
            f"{quality[worst]:.3f}, must be at least {limit:g}; use a smaller element size or smaller fillets"
        )
    return float(quality[worst])
