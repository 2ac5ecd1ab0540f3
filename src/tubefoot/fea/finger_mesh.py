"""The hexahedral mesh of a finger: its profile's quadrilaterals swept along y, with named regions and facets.

The half y >= 0 is meshed; y = 0 is a symmetry plane of the ideal finger and of the bonded one. Points and
facets carry the names that loads and reports use.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.profile import Profile
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh, require_quality
from tubefoot.fea.profile_mesh import Divisions, ProfileMesh, line_nodes, mesh_profile

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REGIONS = ("fold_right", "fold_left", "valley_right", "valley_left", "partition", "side_wall", "cap")

DEFAULT_ELEMENT_SIZE = 2.0
"""[mm]; the convergence study in docs/verification.md says what it is worth."""


def finger_mesh(
    profile: Profile, element_size: float = DEFAULT_ELEMENT_SIZE, divisions: Divisions | None = None
) -> Mesh:
    """The mesh of the half finger y >= 0, 27-node hexahedra.

    profile : the finger's profile
    element_size : longest edge that a cell may have [mm]; thin walls get at least one cell, flanks two
    divisions : cells along each line, in place of those that follow from the element size

    Raises GeometryError when a cell is too distorted.
    """
    counts = divisions or Divisions.of(profile, element_size)
    flat = mesh_profile(profile, counts)
    lid = profile.height / 2 - profile.side_wall
    chamber = lid * line_nodes(counts.chamber_height)
    wall = lid + profile.side_wall * line_nodes(counts.side_wall)
    mesh = _sweep(flat, np.r_[chamber, wall[1:]], counts.chamber_height)
    require_quality(mesh)
    return mesh


def _sweep(flat: ProfileMesh, heights: FloatArray, n_open: int) -> Mesh:
    n_flat, n_layers = len(flat.points), (len(heights) - 1) // 2
    x, z = flat.points.T
    points = np.stack(
        [np.tile(x, len(heights)), np.repeat(heights, n_flat), np.tile(z, len(heights))], axis=1
    )
    solid = flat.part != "chamber"
    cells, source, layer = [], [], []
    for k in range(n_layers):
        chosen = np.flatnonzero(solid) if k < n_open else np.arange(len(flat.cells))
        cells.append(_hexahedra(flat.cells[chosen], 2 * k, n_flat))
        source.append(chosen)
        layer.append(np.full(len(chosen), k))
    nodes, from_cell, of_layer = np.vstack(cells), np.concatenate(source), np.concatenate(layer)
    region = _regions(flat, from_cell, of_layer >= n_open)
    used, compact = np.unique(nodes, return_inverse=True)
    nodes = compact.reshape(nodes.shape)
    block = CellBlock("hexahedron27", nodes, region)
    facets = _facets(points[used], block, flat, from_cell, of_layer >= n_open)
    return Mesh(points[used], (block,), REGIONS, facets)


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


def _regions(flat: ProfileMesh, source: IntArray, in_side_wall: NDArray[np.bool_]) -> IntArray:
    part, side = flat.part[source], flat.side[source]
    names = np.where(np.isin(part, ["flank", "crest"]), "fold", part)
    names = np.where(np.isin(names, ["fold", "valley"]), np.char.add(names, _side_suffix(side)), names)
    names = np.where(np.char.startswith(names, "cap"), "cap", names)
    names = np.where(in_side_wall & (names != "cap"), "side_wall", names)
    return np.array([REGIONS.index(name) for name in names])


def _side_suffix(side: IntArray) -> NDArray[np.str_]:
    return np.where(side > 0, "_right", "_left")


def _facets(
    points: FloatArray,
    block: CellBlock,
    flat: ProfileMesh,
    source: IntArray,
    in_side_wall: NDArray[np.bool_],
) -> dict[str, FacetSet]:
    """Named facet sets: each outer face once under what it is, and the unions that loads need."""
    cell, nodes = _outer_faces(block)
    centre = points[nodes[:, 8]]
    normal = np.cross(points[nodes[:, 1]] - points[nodes[:, 0]], points[nodes[:, 3]] - points[nodes[:, 0]])
    along_y = np.abs(normal[:, 1]) > 0.999 * np.linalg.norm(normal, axis=1)
    y_max, z = points[:, 1].max(), points[:, 2]
    part = flat.part[source[cell]]
    suffix = np.where(centre[:, 0] > 0, "_right", "_left")
    chamber_sided = _faces_chamber(flat, centre) & ~in_side_wall[cell] & ~along_y
    name = np.where(np.char.startswith(part, "cap"), "cap_outside", np.char.add(part, "_outside"))
    inside = np.char.add(np.where(np.char.startswith(part, "cap"), "cap", part), "_inside")
    name = np.where(chamber_sided, inside, name)
    name = np.where(along_y & (centre[:, 1] > 1e-9), "lid", name)
    name = np.where(np.isin(name, ["cap_outside"]), name, np.char.add(name, suffix))
    name = np.where(along_y & (np.abs(centre[:, 1] - y_max) < 1e-9), "side", name)
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


def _faces_chamber(flat: ProfileMesh, centre: FloatArray) -> NDArray[np.bool_]:
    """Whether each face, given by its centre (n, 3), lies over an edge of a chamber cell of the profile."""
    chamber = flat.cells[flat.part == "chamber"]
    middles = np.round(flat.points[np.unique(chamber[:, 4:8])], 6) + 0.0
    keys = {tuple(middle) for middle in middles}
    return np.array([tuple(point) in keys for point in np.round(centre[:, [0, 2]], 6) + 0.0])


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
