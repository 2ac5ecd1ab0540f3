"""Quadratic tetrahedra of a STEP file by Netgen, its named faces and solids kept as sets.

Mid-nodes lie on the curved surface where the cells stay upright with it; where one would not, its edges are
straightened as far as needed. Solids that touch share their nodes. Netgen stays behind this module.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.file_mesh import FileMesh
from tubefoot.fea.mesh import CellBlock
from tubefoot.fea.named_mesh import smallest_determinants

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

NODES = (0, 2, 1, 3, 5, 7, 4, 6, 9, 8)
"""Netgen's nodes of a ten-node tetrahedron in VTK's order; its corners turn the other way."""
CURVED_SHARE = 0.02
"""Smallest determinant over that of the straight cell that a curved one may have."""
HALVINGS = 40
"""How often the curvature of a folded cell's edges is halved at most; less than roundoff is left then."""
GRADING = 0.5
"""How quickly cells may grow away from small features, 0 to 1."""
CURVATURE = 1.5
"""Cells a radius of curvature, about: below that, curved cells fold; 2, Netgen's own, is twice as costly."""
UNNAMED = ("", "default")


def step_mesh(path: Path, size: float) -> FileMesh:
    """The mesh of the solids in a STEP file [mm]; its sets bear the names of faces and solids.

    path : STEP file; size : longest edge of a cell, about [mm]

    Raises ConfigError when Netgen is missing or the file cannot be read, GeometryError when it cannot be
    meshed.
    """
    try:
        from netgen import occ
        from netgen.meshing import MeshingParameters
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"meshing {path} needs {error.name}, which is not installed; install tubefoot with its "
            "`tetrahedra` extra: pip install 'tubefoot[tetrahedra]'"
        ) from error
    if not path.is_file():
        raise ConfigError(f"{path}: no such file")
    try:
        shape = occ.OCCGeometry(str(path)).shape
        solids = list(shape.solids)
    except Exception as error:  # Netgen raises its own kinds and plain ones
        raise ConfigError(f"{path}: cannot be read as STEP: {error}") from error
    if not solids:
        raise GeometryError(f"{path}: holds no solid, only surfaces or curves; export it as a solid body")
    shape = occ.Glue(solids) if len(solids) > 1 else solids[0]
    parameters = MeshingParameters(maxh=size, grading=GRADING, curvaturesafety=CURVATURE)
    try:
        mesh = occ.OCCGeometry(shape).GenerateMesh(parameters)
        mesh.SecondOrder()
    except Exception as error:
        raise GeometryError(
            f"{path}: Netgen cannot mesh it with cells of {size:g} mm ({error}); try another "
            "--element-size-mm, or heal the solid in the CAD program"
        ) from error
    return _file_mesh(mesh, str(path))


def _file_mesh(mesh: Any, source: str) -> FileMesh:
    points = np.array(mesh.Coordinates(), float)
    cells_read, facets_read = mesh.Elements3D().NumPy(), mesh.Elements2D().NumPy()
    if len(cells_read) == 0:
        raise GeometryError(f"{source}: Netgen found no volume in it; is the solid closed?")
    cells = cells_read["nodes"][:, :10].astype(np.int64)[:, NODES] - 1
    points = straightened(points, cells)
    found = FileMesh(points, "tetra10", cells, source=source)
    materials = np.array([mesh.GetMaterial(int(k)) for k in range(1, int(cells_read["index"].max()) + 1)])
    for name in np.unique(materials):
        if name not in UNNAMED:
            found.cell_sets[str(name)] = materials[cells_read["index"] - 1] == name
    faces = [mesh.FaceDescriptor(k) for k in range(1, int(facets_read["index"].max()) + 1)]
    outer = np.array([face.domin == 0 or face.domout == 0 for face in faces])
    names = np.array([face.bcname for face in faces])
    of_facet = facets_read["index"] - 1
    corners = facets_read["nodes"][:, :3].astype(np.int64) - 1
    for name in np.unique(names[outer]):
        if name not in UNNAMED:
            found.facet_sets[str(name)] = corners[(outer & (names == name))[of_facet]]
    return found


def straightened(points: FloatArray, cells: IntArray) -> FloatArray:
    """Points whose mid-nodes were moved towards the straight edge as far as a cell else were (nearly) folded.

    points : (n_points, 3); cells : (n_cells, 10)
    """
    points = points.copy()
    kind = element_kind("tetra10")
    ends = np.array([np.flatnonzero(kind.corner_shape(kind.nodes[k : k + 1])[0] > 0) for k in range(4, 10)])
    a, b, c, d = points[cells[:, :4]].transpose(1, 0, 2)
    straight = np.einsum("ci,ci->c", np.cross(b - a, c - a), d - a)
    block = CellBlock("tetra10", cells, np.zeros(len(cells), dtype=np.int64))
    for _ in range(HALVINGS):
        bad = smallest_determinants(points, block) < CURVED_SHARE * straight
        if not bad.any():
            break
        middles = points[cells[bad][:, ends]].mean(axis=2)
        points[cells[bad, 4:]] = (points[cells[bad, 4:]] + middles) / 2
    return points
