"""Fields of a solved state as VTU files with a PVD index, for ParaView and the pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import State
from tubefoot.fea.measures import PAPER_AXES, Stresses
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import Solid
from tubefoot.records import write_whole
from tubefoot.units import KPA

FloatArray = NDArray[np.float64]


def write_fields(
    path: Path,
    mesh: Mesh,
    solid: Solid,
    state: State,
    stresses: Stresses | None = None,
    extra: Mapping[str, FloatArray] | None = None,
) -> Path:
    """The path of a VTU file: displacement, von Mises and stress components at points and cells, region.

    path : file to write; mesh, solid : what was solved; state : which state
    stresses : of that state, where they are known
    extra : further values at the points by name, each (n_points,), unit in the name
    """
    stresses = stresses or Stresses.of(mesh, solid, state)
    values = {"von_mises_kpa": stresses.von_mises, "max_principal_kpa": stresses.max_principal}
    values |= {f"{name}_kpa": stresses.component(name) for name in PAPER_AXES}
    displacement = state.unknowns[: mesh.points.size].reshape(-1, 3)
    point_data: dict[str, FloatArray] = {"displacement_mm": displacement, **(extra or {})}
    cell_data: dict[str, list[FloatArray]] = {"region": [solid.block.region.astype(np.int32)]}
    total = stresses.weights.sum(axis=1)
    for name, value in values.items():
        point_data[name] = (at_points(mesh, solid, value) / KPA).astype(np.float32)
        mean = (value * stresses.weights).sum(axis=1) / total / KPA
        cell_data[name] = [mean.astype(np.float32)]
    grid = meshio.Mesh(
        mesh.points, [(solid.block.kind, solid.block.nodes)], point_data=point_data, cell_data=cell_data
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.stem}.part.vtu")
    grid.write(beside, file_format="vtu")
    beside.replace(path)
    return path


def at_points(mesh: Mesh, solid: Solid, values: FloatArray) -> FloatArray:
    """Values at the mesh's points, extrapolated from the quadrature points and averaged over cells.

    mesh, solid : what was solved; values : (n_cells, n_q)
    """
    kind = solid.kind
    inverse = np.linalg.pinv(kind.shape(kind.quadrature_points))
    at_nodes = values @ inverse.T
    # Extrapolation may not exceed what was computed.
    at_nodes = np.clip(at_nodes, values.min(axis=1)[:, None], values.max(axis=1)[:, None])
    nodes = solid.block.nodes.ravel()
    total = np.bincount(nodes, at_nodes.ravel(), minlength=len(mesh.points))
    count = np.bincount(nodes, minlength=len(mesh.points))
    return total / np.maximum(count, 1)


def write_index(path: Path, files: list[tuple[float, Path]]) -> Path:
    """The path of a PVD file that lists VTU files with their path parameter as time.

    path : file to write; files : (parameter, VTU file) for each state
    """
    rows = [
        f'    <DataSet timestep="{at:.9g}" group="" part="0" file="{file.relative_to(path.parent)}"/>'
        for at, file in files
    ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    body = "\n".join(["  <Collection>", *rows, "  </Collection>"])
    return write_whole(path, f"{head}\n{body}\n</VTKFile>\n")
