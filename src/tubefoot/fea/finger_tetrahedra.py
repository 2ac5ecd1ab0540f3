"""The half finger as quadratic tetrahedra: a quarter meshed by Netgen and its mirror image at x = 0.

So the mesh is symmetric in x, has points on the centre line, and bears the regions and facet sets of the
swept mesh (`finger_mesh`), with ports also the region `tubes`. Unlike the swept mesh it can have the ports.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.finger import FingerDesign
from tubefoot.design.profile import Profile
from tubefoot.errors import ConfigError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.finger_mesh import REGIONS
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh
from tubefoot.fea.named_mesh import named_mesh, require_upright
from tubefoot.fea.tetrahedra import step_mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TUBES = "tubes"
"""Region of the rigid tubes."""
ON_PLANE = 1e-7
"""Distance from a plane of symmetry within which a point lies in it [mm]."""
TWO_SIDED = ("base", "tip", "mid_plane", "side", "cap_outside", "tube_outside")
"""Facet sets that reach over both sides of the finger; the others are split into right and left."""
CAVITY = ("partition", "valley", "flank", "crest", "cap", "bore")
OUTSIDE = ("flank_outside", "crest_outside", "valley_outside")


def finger_tetrahedra(design: FingerDesign, element_size: float, ports: bool = False) -> Mesh:
    """The mesh of the half finger y >= 0, ten-node tetrahedra.

    design : the finger; element_size : longest edge of a cell, about [mm]
    ports : whether tubes and bores are part of it

    Raises ConfigError when CAD or mesher are missing, GeometryError when the solid cannot be meshed.
    """
    try:
        from tubefoot.design.analysis_solids import write_quarter
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"tetrahedra of a design need {error.name}, which is not installed; install tubefoot with its "
            "`cad` and `tetrahedra` extras: pip install 'tubefoot[cad,tetrahedra]'"
        ) from error
    with tempfile.TemporaryDirectory() as directory:
        path = write_quarter(Path(directory) / f"{design.name}.step", design, ports)
        found = step_mesh(path, element_size)
    quarter = named_mesh(found, {name: name for name in found.facet_sets})
    mesh = _mirrored(quarter)
    regions = (*REGIONS, TUBES) if ports else REGIONS
    mesh = Mesh(mesh.points, _with_regions(mesh, design.profile, regions), regions, _named_sets(mesh))
    require_upright(mesh, design.name)
    return mesh


def _mirrored(quarter: Mesh) -> Mesh:
    """The quarter and its image under x -> -x, sharing the points of the plane x = 0."""
    block = quarter.blocks[0]
    points = np.where(np.abs(quarter.points) < ON_PLANE, 0.0, quarter.points)
    n = len(points)
    image = np.arange(n)
    off_plane = np.flatnonzero(points[:, 0] > 0.0)
    image[off_plane] = n + np.arange(len(off_plane))
    all_points = np.vstack([points, points[off_plane] * [-1.0, 1.0, 1.0]])
    cells = np.vstack([block.nodes, image[block.nodes][:, _reversal("tetra10")]])
    facets = {}
    for name, facet_set in quarter.facets.items():
        mirrored = image[facet_set.nodes][:, _reversal(facet_set.kind)]
        if name in TWO_SIDED:
            facets[name] = FacetSet(facet_set.kind, np.vstack([facet_set.nodes, mirrored]))
        elif name != "centre_plane":
            facets[f"{name}_right"] = facet_set
            facets[f"{name}_left"] = FacetSet(facet_set.kind, mirrored)
    return Mesh(all_points, (CellBlock("tetra10", cells, np.tile(block.region, 2)),), quarter.regions, facets)


def _reversal(kind: str) -> IntArray:
    """Order of a cell's nodes that turns its mirror image the right way: its first two axes exchanged."""
    nodes = element_kind(kind).nodes
    swapped = nodes.copy()
    swapped[:, [0, 1]] = nodes[:, [1, 0]]
    distance = np.abs(swapped[:, None] - nodes[None]).sum(axis=2)
    return np.argmin(distance, axis=1)


def _with_regions(mesh: Mesh, profile: Profile, regions: tuple[str, ...]) -> tuple[CellBlock, ...]:
    """The cells in the regions of the swept mesh, by where their centres lie."""
    block = mesh.blocks[0]
    centre_x, y, z = mesh.points[block.nodes[:, :4]].mean(axis=1).T
    x, side = np.abs(centre_x), np.where(centre_x > 0, "_right", "_left")
    name = np.char.add(np.where(x < profile.valley_outside, "valley", "fold"), side)
    name = np.where(x < profile.partition_face, "partition", name)
    name = np.where(y > profile.height / 2 - profile.side_wall, "side_wall", name)
    name = np.where((z < 0.0) | (z > profile.bellows_length), "cap", name)
    name = np.where(np.array(mesh.regions)[block.region] == TUBES, TUBES, name)
    numbers = {region: number for number, region in enumerate(regions)}
    return (CellBlock(block.kind, block.nodes, np.array([numbers[str(key)] for key in name])),)


def _named_sets(mesh: Mesh) -> dict[str, FacetSet]:
    """The facet sets with the unions that loads need."""
    sets = dict(mesh.facets)

    def union(names: list[str]) -> FacetSet:
        return FacetSet("triangle6", np.vstack([sets[name].nodes for name in names if name in sets]))

    hands = ("right", "left")
    for hand in hands:
        sets[f"cavity_{hand}"] = union([*(f"{part}_inside_{hand}" for part in CAVITY), f"lid_{hand}"])
    sets["outside"] = union(
        ["side", "cap_outside", *(f"{part}_{hand}" for part in OUTSIDE for hand in hands)]
    )
    return sets
