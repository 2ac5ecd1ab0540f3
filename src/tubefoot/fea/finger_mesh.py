"""The hexahedral mesh of a finger: its profile's quadrilaterals swept along y, with named regions and facets.

The half y >= 0 is meshed; y = 0 is a symmetry plane of the ideal finger and of the bonded one. Points and
facets carry the names that loads and reports use.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.profile import Profile
from tubefoot.fea.end_mesh import RigidEnds
from tubefoot.fea.measures import RIGID_REGIONS
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh, require_quality
from tubefoot.fea.patches import line_nodes
from tubefoot.fea.profile_mesh import Divisions, ProfileMesh, mesh_profile

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REGIONS = ("fold_right", "fold_left", "valley_right", "valley_left", "partition", "side_wall", "cap")
"""Regions of the soft body; rigid ends add those of `RIGID_REGIONS`."""

DEFAULT_ELEMENT_SIZE = 2.0
"""[mm]; the convergence study in docs/verification.md says what it is worth."""


def finger_mesh(
    profile: Profile,
    element_size: float = DEFAULT_ELEMENT_SIZE,
    divisions: Divisions | None = None,
    rigid: RigidEnds | None = None,
) -> Mesh:
    """The mesh of the half finger y >= 0, 27-node hexahedra.

    profile : the finger's profile
    element_size : longest edge that a cell may have [mm]; thin walls get at least one cell, flanks two
    divisions : cells along each line, in place of those that follow from the element size
    rigid : mount and tubes, if they are modelled

    Raises GeometryError when a cell is too distorted.
    """
    counts = divisions or Divisions.of(profile, element_size, rigid)
    flat = mesh_profile(profile, counts, rigid)
    lid, side = profile.height / 2 - profile.side_wall, profile.height / 2
    stretches = [(0.0, lid, counts.chamber_height), (lid, side, counts.side_wall)]
    if rigid is not None:
        stretches.append((side, side + rigid.wall, counts.socket))
    heights = [low + (high - low) * line_nodes(cells) for low, high, cells in stretches]
    layers = np.repeat(np.arange(len(stretches)), [cells for *_, cells in stretches])
    mesh = _sweep(flat, np.r_[0.0, *(line[1:] for line in heights)], layers, rigid)
    require_quality(mesh)
    return mesh


OPEN, CLOSED, SOCKET = 0, 1, 2
"""What a layer of cells along y lies in: the chambers' height, the side wall, the socket's wall beside it."""


def _sweep(flat: ProfileMesh, heights: FloatArray, layers: IntArray, rigid: RigidEnds | None) -> Mesh:
    """Cells between node planes at the heights; layers : (n_layers,) what each lies in."""
    n_flat = len(flat.points)
    x, z = flat.points.T
    points = np.stack(
        [np.tile(x, len(heights)), np.repeat(heights, n_flat), np.tile(z, len(heights))], axis=1
    )
    filled = {
        OPEN: flat.part != "chamber",
        CLOSED: np.ones(len(flat.cells), dtype=bool),
        SOCKET: np.isin(flat.part, ["mount", "cap_gripped"]),
    }
    cells, source, layer = [], [], []
    for k, kind in enumerate(layers):
        chosen = np.flatnonzero(filled[int(kind)])
        cells.append(_hexahedra(flat.cells[chosen], 2 * k, n_flat))
        source.append(chosen)
        layer.append(np.full(len(chosen), kind))
    nodes, from_cell, of_layer = np.vstack(cells), np.concatenate(source), np.concatenate(layer)
    used, compact = np.unique(nodes, return_inverse=True)
    nodes, points = compact.reshape(nodes.shape), points[used]
    part = np.where(of_layer == SOCKET, "mount", flat.part[from_cell])
    centre = points[nodes[:, -1]]
    regions = REGIONS if rigid is None else (*REGIONS, *RIGID_REGIONS)
    names = _regions(part, flat.side[from_cell], of_layer == CLOSED)
    if rigid is not None:
        names = np.where((names == "cap") & rigid.in_tube(centre[:, 0], centre[:, 1]), "tubes", names)
    block = CellBlock("hexahedron27", nodes, np.array([regions.index(name) for name in names]))
    side = heights[2 * int((layers < SOCKET).sum())]
    facets = _facets(points, block, _faces_chamber(flat), part, of_layer == CLOSED, side)
    return Mesh(points, (block,), regions, facets)


def _hexahedra(quads: IntArray, plane: int, n_flat: int) -> IntArray:
    """27-node cells between node planes `plane` and `plane + 2`.

    The swept axis y points away from (x, z) seen with x right and z up, so the bottom of a cell is its
    face of larger y.
    """
    bottom, middle, top = (quads + n_flat * (plane + k) for k in (2, 1, 0))
    return np.hstack(
        [
            bottom[:, :4],
            top[:, :4],
            bottom[:, 4:8],
            top[:, 4:8],
            middle[:, :4],
            middle[:, [7, 5, 4, 6]],  # faces: first axis low and high, second axis low and high
            bottom[:, 8:],
            top[:, 8:],
            middle[:, 8:],
        ]
    )


def _regions(part: NDArray[np.str_], side: IntArray, in_side_wall: NDArray[np.bool_]) -> NDArray[np.str_]:
    """(n_cells,) names of the regions."""
    names = np.where(np.isin(part, ["flank", "crest"]), "fold", part)
    names = np.where(np.isin(names, ["fold", "valley"]), np.char.add(names, _side_suffix(side)), names)
    names = np.where(np.char.startswith(names, "cap"), "cap", names)
    return np.where(in_side_wall & ~np.isin(names, ["cap", "mount"]), "side_wall", names)


def _side_suffix(side: IntArray) -> NDArray[np.str_]:
    return np.where(side > 0, "_right", "_left")


def _facets(
    points: FloatArray,
    block: CellBlock,
    over_chamber: Callable[[FloatArray], NDArray[np.bool_]],
    cell_part: NDArray[np.str_],
    in_side_wall: NDArray[np.bool_],
    side: float,
) -> dict[str, FacetSet]:
    """Named facet sets: each outer face once under what it is, and the unions that loads need.

    over_chamber : whether faces with given centres lie at the edge of a chamber of the profile
    cell_part, in_side_wall : (n_cells,) of each cell; side : y of the finger's side [mm]
    """
    cell, nodes = _outer_faces(block)
    centre = points[nodes[:, 8]]
    normal = np.cross(points[nodes[:, 1]] - points[nodes[:, 0]], points[nodes[:, 3]] - points[nodes[:, 0]])
    along_y = np.abs(normal[:, 1]) > 0.999 * np.linalg.norm(normal, axis=1)
    z, part = points[:, 2], cell_part[cell]
    suffix = np.where(centre[:, 0] > 0, "_right", "_left")
    chamber_sided = over_chamber(centre) & ~in_side_wall[cell] & ~along_y
    name = np.where(np.char.startswith(part, "cap"), "cap_outside", np.char.add(part, "_outside"))
    inside = np.char.add(np.where(np.char.startswith(part, "cap"), "cap", part), "_inside")
    name = np.where(chamber_sided, inside, name)
    name = np.where(along_y & (centre[:, 1] > 1e-9), "lid", name)
    name = np.where(part == "mount", "mount_outside", name)
    one_sided = ~np.isin(name, ["cap_outside", "mount_outside"])
    name = np.where(one_sided, np.char.add(name, suffix), name)
    at_side = along_y & (np.abs(centre[:, 1] - side) < 1e-9) & (part != "mount")
    name = np.where(at_side, "side", name)
    name = np.where(along_y & (np.abs(centre[:, 1]) < 1e-9), "mid_plane", name)
    name = np.where(np.abs(centre[:, 2] - z.min()) < 1e-9, "base", name)
    name = np.where(np.abs(centre[:, 2] - z.max()) < 1e-9, "tip", name)
    sets = {str(key): nodes[name == key] for key in np.unique(name)}
    for hand in ("right", "left"):
        walls = [f"{part}_inside_{hand}" for part in ("partition", "valley", "flank", "crest", "cap")]
        sets[f"cavity_{hand}"] = np.vstack([sets[wall] for wall in [*walls, f"lid_{hand}"]])
    outer = ("flank_outside", "crest_outside", "valley_outside")
    sets["outside"] = np.vstack(
        [sets["side"], sets["cap_outside"], *(sets[f"{k}_{h}"] for k in outer for h in ("right", "left"))]
    )
    return {key: FacetSet("quad9", value) for key, value in sets.items()}


def _outer_faces(block: CellBlock) -> tuple[IntArray, IntArray]:
    """Faces that belong to one cell only: (n,) cell numbers and (n, 9) nodes."""
    faces = np.array(block.element.faces)
    nodes = block.nodes[:, faces].reshape(-1, faces.shape[1])
    cell = np.repeat(np.arange(len(block.nodes)), len(faces))
    _, first, count = np.unique(nodes[:, 8], return_index=True, return_counts=True)
    single = first[count == 1]
    return cell[single], nodes[single]


def _faces_chamber(flat: ProfileMesh) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """Tells whether faces with centres (n, 3) lie over an edge of a chamber cell of the profile."""
    chamber = flat.cells[flat.part == "chamber"]
    middles = np.round(flat.points[np.unique(chamber[:, 4:8])], 6) + 0.0
    keys = {tuple(middle) for middle in middles}

    def over_chamber(centre: FloatArray) -> NDArray[np.bool_]:
        return np.array([tuple(point) in keys for point in np.round(centre[:, [0, 2]], 6) + 0.0])

    return over_chamber


def clamp_half_finger(mesh: Mesh) -> dict[int, IntArray]:
    """Held points of a half finger: the base along all axes, the mid-plane along y.

    mesh : of `finger_mesh`
    """
    base, middle = mesh.facet_set("base").points, mesh.facet_set("mid_plane").points
    return {0: base, 1: np.union1d(base, middle), 2: base}


def mirror_points(mesh: Mesh) -> IntArray:
    """Number of each point's mirror image under x -> -x.

    mesh : of `finger_mesh`
    """
    from scipy.spatial import cKDTree

    return cKDTree(mesh.points).query(mesh.points * [-1.0, 1.0, 1.0])[1]
