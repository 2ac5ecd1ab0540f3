"""From a file's mesh to one that can be solved: lengths in mm, quadratic cells, facets under their roles.

Each facet is a face of the one cell that it lies on, so its normal points out of the solid whatever the file
says. What cannot be solved is refused with the place: linear cells, cells that are folded over, facets inside
the solid, sizes that look like another unit of length.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.file_mesh import FileMesh, cell_faces, face_numbers
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh, jacobian_at

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

RAISED = {"tetra4": "tetra10", "hexahedron8": "hexahedron27"}
"""Linear kinds and the quadratic ones that they can be raised to."""
SMALLEST_MM, LARGEST_MM = 1.0, 1000.0
"""A soft actuator's largest dimension lies between these; outside, the unit of length is wrong."""


def named_mesh(
    found: FileMesh, roles: Mapping[str, str], scale: float = 1.0, raise_to_quadratic: bool = False
) -> Mesh:
    """The mesh that is solved, its facet sets called by their roles.

    found : what the file holds; roles : role to the name of the file's set
    scale : millimetres in the file's unit of length
    raise_to_quadratic : give linear cells mid-nodes on their straight edges

    Raises GeometryError for cells or sizes that cannot be solved, ConfigError for a set that is missing.
    """
    points, kind, cells = scale * found.points, found.kind, found.cells
    require_size(points[np.unique(cells)], found.source)
    if kind in RAISED:
        if not raise_to_quadratic:
            raise GeometryError(
                f"{found.source}: linear cells ({kind}) lock in a nearly incompressible solid; mesh with "
                "quadratic cells (gmsh: Mesh.ElementOrder = 2), or set raise_to_quadratic = true"
            )
        points, cells = raised(points, cells, kind)
        kind = RAISED[kind]
    used, compact = np.unique(cells, return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    names, region = regions_of(found)
    block = CellBlock(kind, compact.reshape(cells.shape), region)
    mesh = Mesh(points[used], (block,), names)
    require_upright(mesh, found.source)
    outer = outer_faces(block)
    sets = {
        role: FacetSet(block.element.face_kind, _facets(found, name, role, number, block, outer))
        for role, name in roles.items()
    }
    return Mesh(mesh.points, mesh.blocks, names, sets)


def require_size(points: FloatArray, source: str) -> None:
    """Raise GeometryError where the extent looks like another unit of length.

    points : (n, 3) [mm]; source : what to call the file
    """
    extent = float(np.ptp(points, axis=0).max())
    if SMALLEST_MM <= extent <= LARGEST_MM:
        return
    unit = "metres" if extent < SMALLEST_MM else "micrometres"
    raise GeometryError(
        f"{source}: the part is {extent:.3g} mm large (allowed: {SMALLEST_MM:g} to {LARGEST_MM:g} mm); if "
        f'the file is in {unit} or another unit, say so with length_unit = "m", "cm", "mm", "um" or "inch"'
    )


def require_upright(mesh: Mesh, source: str) -> None:
    """Raise GeometryError naming the worst cell where one is folded over or inside out.

    mesh : to look at, one block; source : what to call the file
    """
    smallest = smallest_determinants(mesh.points, mesh.blocks[0])
    bad = np.flatnonzero(smallest <= 0.0)
    if bad.size:
        x, y, z = mesh.points[mesh.blocks[0].nodes[bad[np.argmin(smallest[bad])]]].mean(axis=0)
        raise GeometryError(
            f"{source}: {bad.size} of {len(smallest)} cells are folded over or inside out, the worst near "
            f"x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm; mesh finer where it is curved, or with straight "
            "edges (gmsh: Mesh.SecondOrderLinear = 1, or Mesh.HighOrderOptimize = 2)"
        )


def smallest_determinants(points: FloatArray, block: CellBlock) -> FloatArray:
    """Smallest Jacobian determinant of each cell over its quadrature points and nodes, (n_cells,) [mm^3].

    points : (n_points, 3) [mm]; block : the cells
    """
    kind = block.element
    reference = np.vstack([kind.nodes, kind.quadrature_points])
    return np.asarray(np.linalg.det(jacobian_at(points, block, reference)).min(axis=1), float)


def raised(points: FloatArray, cells: IntArray, kind: str) -> tuple[FloatArray, IntArray]:
    """Points and quadratic cells of linear ones, new nodes where the linear map has them.

    points : (n_points, 3); cells : (n_cells, 4 or 8); kind : tetra4 or hexahedron8
    """
    linear, quadratic = element_kind(kind), element_kind(RAISED[kind])
    shape = linear.shape(quadratic.nodes)
    # A new node belongs to the corners that weigh in it: an edge, a face, or the cell.
    owners = np.full((len(cells), quadratic.n_nodes, linear.n_nodes), -1)
    for node in range(quadratic.n_nodes):
        corners = np.flatnonzero(shape[node] > 1e-9)
        owners[:, node, : len(corners)] = np.sort(cells[:, corners], axis=1)
    flat = owners.reshape(-1, linear.n_nodes)
    unique, first, nodes = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    all_points = np.einsum("na,cai->cni", shape, points[cells]).reshape(-1, 3)[first]
    # Corners keep their numbers, so that the file's sets still hold; new nodes come after them.
    is_corner = unique[:, 1] < 0
    number = np.empty(len(unique), dtype=np.int64)
    number[is_corner] = unique[is_corner, 0]
    number[~is_corner] = len(points) + np.arange(int((~is_corner).sum()))
    return np.vstack([points, all_points[~is_corner]]), number[nodes].reshape(len(cells), -1)


def regions_of(found: FileMesh) -> tuple[tuple[str, ...], IntArray]:
    """Region names and the number of each cell's region: the smallest set that holds the cell, else `body`.

    found : what the file holds
    """
    region = np.full(len(found.cells), -1)
    names: list[str] = []
    for name, mask in sorted(found.cell_sets.items(), key=lambda item: -int(item[1].sum())):
        names.append(name)
        region[mask] = len(names) - 1
    if (region < 0).any():
        names.append("body")
        region[region < 0] = len(names) - 1
    kept = np.unique(region)
    return tuple(names[k] for k in kept), np.searchsorted(kept, region)


def outer_faces(block: CellBlock) -> IntArray:
    """Faces that belong to one cell only, (n, n_face_nodes) point numbers, normals out of the solid.

    block : the cells
    """
    _, _, nodes = cell_faces(block.nodes, block.kind)
    n_corners = element_kind(block.element.face_kind).n_corners
    keys = np.sort(nodes[:, :n_corners], axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return nodes[np.sort(first[count == 1])]


def set_named(found: FileMesh, name: str, role: str) -> str:
    """The name of a set as the file spells it, upper and lower case being the same.

    found : what the file holds; name : of the wanted set; role : what it is for

    Raises ConfigError naming the sets that there are.
    """
    spelled = {known.lower(): known for known in found.surface_names}
    try:
        return spelled[name.lower()]
    except KeyError:
        near = difflib.get_close_matches(name.lower(), list(spelled), n=1)
        hint = f"; did you mean `{spelled[near[0]]}`?" if near else "."
        known = ", ".join(found.surface_names) or "none"
        raise ConfigError(
            f"{found.source} has no surface set `{name}` for {role}{hint} Its surface sets: {known}. "
            f'In a settings file (--solid): [sets] {role} = "NAME"'
        ) from None


def _facets(
    found: FileMesh, name: str, role: str, number: IntArray, block: CellBlock, outer: IntArray
) -> IntArray:
    """Outer faces of a named set, as the cells have them."""
    name = set_named(found, name, role)
    n_corners = element_kind(block.element.face_kind).n_corners
    corners = outer[:, :n_corners]
    if name in found.facet_sets:
        sought = number[found.facet_sets[name]]
        rows = np.array(list(face_numbers(sought, corners)), dtype=np.int64)
        if (rows < 0).any():
            raise GeometryError(
                f"{found.source}: {int((rows < 0).sum())} of the {len(rows)} facets of `{name}` ({role}) are "
                "no outer faces of the solid: they lie inside it, or belong to another mesh"
            )
        return outer[np.unique(rows)]
    inside = np.zeros(len(number), dtype=bool)
    members = number[found.point_sets[name]]
    inside[members[members >= 0]] = True
    chosen = inside[corners].all(axis=1)
    if not chosen.any():
        raise GeometryError(
            f"{found.source}: no outer face has all its corners in the point set `{name}` ({role}); "
            "let the set hold every point of the surface"
        )
    return outer[chosen]
