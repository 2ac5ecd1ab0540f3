"""A mesh as a file holds it: cells of one kind, and named sets of cells, of facets and of points.

Conventions, by format:

    gmsh 4 .msh     physical groups of volumes, surfaces and points
    Abaqus .inp     *ELSET of solid or of shell elements, *SURFACE of element faces, *NSET
    .vtu            an array of zeros and ones that bears the set's name: cell data for volumes and for facets
                    that are cells of the file, point data for points; or integers `region` in the cell data

A facet set is given by cells of two dimensions, by element faces, or by its points: then every outer face
belongs whose corners are all in the set.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import element_kind

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SOLID_KINDS = {
    "tetra": "tetra4",
    "tetra10": "tetra10",
    "hexahedron": "hexahedron8",
    "hexahedron20": "hexahedron20",
    "hexahedron27": "hexahedron27",
}
"""Cell types of files that can be solved, or raised to such, and what they are called here."""
FACET_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
IGNORED = ("vertex", "line", "line3")


@dataclass
class FileMesh:
    """What was read from a mesh file; lengths in the file's unit.

    points : (n_points, 3); kind : cell kind; cells : (n_cells, n_nodes) point numbers, VTK order
    cell_sets : name to (n_cells,) mask
    facet_sets : name to (n, 3 or 4) corner numbers
    point_sets : name to point numbers
    source : what to call the file in an error
    """

    points: FloatArray
    kind: str
    cells: IntArray
    cell_sets: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    facet_sets: dict[str, IntArray] = field(default_factory=dict)
    point_sets: dict[str, IntArray] = field(default_factory=dict)
    source: str = "mesh"

    @property
    def surface_names(self) -> list[str]:
        """Names that can stand for a facet set, sorted."""
        return sorted({*self.facet_sets, *self.point_sets})


def read_mesh_file(path: Path) -> FileMesh:
    """The mesh in a file, with its named sets.

    path : gmsh 4 .msh, Abaqus .inp or .vtu file

    Raises ConfigError for a file that cannot be read, GeometryError for cells that cannot be solved.
    """
    if not path.is_file():
        raise ConfigError(f"{path}: no such file")
    suffix = path.suffix.lower()
    if suffix == ".inp":
        from tubefoot.fea.abaqus_mesh import read_abaqus

        return read_abaqus(path)
    if suffix not in (".msh", ".vtu"):
        raise ConfigError(
            f"{path}: `{suffix}` is not a mesh format that can be read; give .msh (gmsh 4), .inp (Abaqus), "
            ".vtu, or .step to be meshed here"
        )
    import meshio

    try:
        found = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio raises whatever its parsers meet, and exits
        raise ConfigError(
            f"{path}: cannot be read as {suffix}: {error or 'broken file'}; save it anew "
            "(gmsh: version 4.1, Mesh.MshFileVersion = 4.1)"
        ) from error
    parts = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in found.cells]
    sets = _gmsh_sets(found) if suffix == ".msh" else _vtu_sets(found)
    mesh = assembled(np.asarray(found.points, float), parts, sets, str(path))
    if suffix == ".vtu":
        for name, values in found.point_data.items():
            if _is_flag(values):
                mesh.point_sets[name] = np.flatnonzero(values)
    return mesh


def assembled(
    points: FloatArray, parts: list[tuple[str, IntArray]], sets: dict[str, list[IntArray]], source: str
) -> FileMesh:
    """One mesh of the parts of a file, unused points left in.

    points : (n_points, 2 or 3); parts : cell type and point numbers of each part of the file
    sets : name to the members within each part; source : what to call the file in an error

    Raises GeometryError when there is no volume cell, or cells of several or unknown kinds.
    """
    solid = [k for k, (kind, _) in enumerate(parts) if kind in SOLID_KINDS]
    kinds = {kind for kind, _ in parts}
    unknown = kinds - {*SOLID_KINDS, *FACET_CORNERS, *IGNORED}
    found = {parts[k][0] for k in solid}
    allowed = "tetrahedra of 4 or 10 nodes or hexahedra of 8, 20 or 27"
    if unknown:
        raise GeometryError(
            f"{source}: cells of type {', '.join(sorted(unknown))}; only {allowed} can be solved"
        )
    if len(found) != 1:
        what = f"cells of several kinds ({', '.join(sorted(found))})" if found else "no volume cells"
        raise GeometryError(f"{source}: {what}; mesh the solid with one kind: {allowed}")
    starts = np.cumsum([0, *(len(parts[k][1]) for k in solid)])
    mesh = FileMesh(
        points, SOLID_KINDS[found.pop()], np.concatenate([parts[k][1] for k in solid]), source=source
    )
    for name, members in sets.items():
        mask = np.zeros(len(mesh.cells), dtype=bool)
        for start, k in zip(starts[:-1], solid, strict=True):
            mask[start + members[k]] = True
        if mask.any():
            mesh.cell_sets[name] = mask
        for kind_corners in (3, 4):
            facets = [
                cells[chosen, :kind_corners]
                for (kind, cells), chosen in zip(parts, members, strict=True)
                if FACET_CORNERS.get(kind) == kind_corners and len(chosen)
            ]
            if facets:
                mesh.facet_sets[name] = np.concatenate(facets)
        points_of = [
            cells[chosen].ravel()
            for (kind, cells), chosen in zip(parts, members, strict=True)
            if kind in IGNORED and len(chosen)
        ]
        if points_of:
            mesh.point_sets[name] = np.unique(np.concatenate(points_of))
    return mesh


def _gmsh_sets(found: Any) -> dict[str, list[IntArray]]:
    return {
        name: [np.asarray([] if part is None else part, dtype=np.int64) for part in members]
        for name, members in found.cell_sets.items()
        if not name.startswith("gmsh:")
    }


def _vtu_sets(found: Any) -> dict[str, list[IntArray]]:
    sets = {}
    for name, parts in found.cell_data.items():
        if name == "region":
            for value in np.unique(np.concatenate([np.ravel(part) for part in parts])):
                sets[f"region_{value:g}"] = [np.flatnonzero(np.ravel(part) == value) for part in parts]
        elif all(_is_flag(part) for part in parts):
            sets[name] = [np.flatnonzero(part) for part in parts]
    return sets


def _is_flag(values: Any) -> bool:
    """Whether an array holds zeros and ones only, one a point or cell."""
    values = np.asarray(values)
    return values.ndim == 1 and bool(np.isin(values, (0, 1)).all())


def cell_faces(cells: IntArray, kind: str) -> tuple[IntArray, IntArray, IntArray]:
    """Every face of every cell: (n,) its cell, (n,) its number in the cell, (n, n_face_nodes) its nodes.

    cells : (n_cells, n_nodes); kind : their kind
    """
    faces = np.array(element_kind(kind).faces)
    nodes = cells[:, faces].reshape(-1, faces.shape[1])
    cell = np.repeat(np.arange(len(cells)), len(faces))
    return cell, np.tile(np.arange(len(faces)), len(cells)), nodes


def face_keys(corners: IntArray) -> list[tuple[int, ...]]:
    """Corner numbers of each face in ascending order: equal for the two cells that share it.

    corners : (n, 3 or 4)
    """
    return [tuple(row) for row in np.sort(corners, axis=1).tolist()]


def face_numbers(sought: IntArray, corners: IntArray) -> Iterator[int]:
    """For each sought face its row in `corners`, -1 where there is none; whatever the order of the corners.

    sought : (m, 3 or 4); corners : (n, 3 or 4)
    """
    rows = {key: row for row, key in enumerate(face_keys(corners))}
    return (rows.get(key, -1) for key in face_keys(sought))
