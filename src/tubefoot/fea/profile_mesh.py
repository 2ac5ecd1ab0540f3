"""Quadrilaterals over the profile of a finger, in the x-z plane: wall, partition, caps and chambers.

The wall is meshed as a strip that follows valley, flank and crest, with mitre lines at the corners; a lining
of one layer runs along its inside through each slot. So every corner, sharp or filleted, sits between cells
of good shape. Cells are biquadratic, with their mid-nodes on the curves.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.profile import Profile
from tubefoot.fea.end_mesh import RigidEnds, base_rows, end_patches, tip_rows
from tubefoot.fea.patches import Curve, Patch, line, line_nodes, polyline_with_fillets, ruled

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LINING = 1.0 / 3.0
"""Share of the slot's half width that the lining leaves to the inner rows."""


@dataclass(frozen=True)
class ProfileMesh:
    """Nine-node quadrilaterals over one profile.

    points : (n_points, 2) as (x, z) [mm]
    cells : (n_cells, 9) point numbers in VTK order, seen with x to the right and z up
    part : (n_cells,) what each cell belongs to: partition, valley, flank, crest, cap_base, cap_gripped,
        cap_tip, mount, chamber
    side : (n_cells,) +1 for the right half, -1 for the left, 0 for neither
    """

    points: FloatArray
    cells: IntArray
    part: NDArray[np.str_]
    side: IntArray


@dataclass(frozen=True)
class Divisions:
    """How many cells along each line of the profile, and across the chamber and the side wall along y."""

    wall: int
    flank: int
    valley: int
    crest: int
    gap: int
    partition: int
    cap: int
    chamber_height: int
    side_wall: int
    lining: int = 1
    plate: int = 1
    socket: int = 1
    rim: int = 1

    @classmethod
    def of(cls, profile: Profile, size: float, rigid: RigidEnds | None = None) -> Divisions:
        """Divisions whose cells are no longer than a size; flanks, which bend, get at least two.

        profile : the finger's profile; size : element size [mm]; rigid : the mount, if it is modelled
        """

        def count(length: float, least: int = 1) -> int:
            return max(least, ceil(length / size - 1e-9))

        flank = np.hypot(profile.crest_outside - profile.valley_outside, profile.rise)
        return cls(
            wall=count(max(profile.fold_wall, profile.valley_wall)),
            flank=count(flank, 2),
            valley=count(profile.inner_valley_flat / 2),
            crest=count(max(profile.crest_flat, 2 * profile.slot_half_width(profile.slot_end))),
            gap=count(profile.chamber_gap),
            partition=count(profile.partition),
            cap=count(profile.cap),
            chamber_height=count(profile.height / 2 - profile.side_wall),
            side_wall=count(profile.side_wall),
            **({} if rigid is None else {"plate": count(rigid.plate), "socket": count(rigid.wall)}),
        )

    def refined(self, factor: int) -> Divisions:
        """Every cell cut into `factor` along each line.

        factor : 1 or more
        """
        return Divisions(*(factor * getattr(self, entry.name) for entry in fields(self)))


def mesh_profile(profile: Profile, divisions: Divisions, rigid: RigidEnds | None = None) -> ProfileMesh:
    """The quadrilaterals of a whole profile.

    profile : the finger's profile; divisions : cells along each line
    rigid : the mount under it, if it is modelled
    """
    patches: list[Patch] = []
    for unit in range(profile.units):
        patches += _unit_patches(profile, divisions, unit * profile.pitch)
    patches += end_patches(profile, divisions, rigid)
    patches += [patch.mirrored() for patch in patches]
    patches += _partition_patches(profile, divisions, rigid)
    return _join(patches)


def _unit_patches(profile: Profile, n: Divisions, z: float) -> list[Patch]:
    """Patches of one unit of the right half; across runs along +x or away from the chamber."""
    shift = np.array([0.0, z])
    outer, inner = profile.outer_corners() + shift, profile.chamber_corners() + shift
    bottom, top = z, z + profile.pitch

    def ends(x: float) -> tuple[FloatArray, FloatArray]:
        return np.array([x, bottom]), np.array([x, top])

    def wall_line(x: float, corners: FloatArray, radius: float) -> list[Curve]:
        first, last = ends(x)
        return polyline_with_fillets(np.vstack([first, corners, last]), [radius] * 4)

    inside = wall_line(profile.valley_inside, inner, profile.fillet_chamber)
    outside = wall_line(profile.valley_outside, outer, profile.fillet_outside)
    along = _along_wall(n)
    across = line_nodes(n.wall)
    parts = ("valley", "flank", "crest", "flank", "valley")
    patches = [
        Patch(ruled(a, b, t, across), part, 1)
        for a, b, t, part in zip(inside, outside, along, parts, strict=True)
    ]
    lining = _lining_corners(profile, z)
    linings = [line(lining[k], lining[k + 1]) for k in range(3)]
    for curve, wall, t in zip(linings, inside[1:4], along[1:4], strict=True):
        patches.append(Patch(ruled(curve, wall, t, line_nodes(n.lining)), "chamber", 1))
    up = ruled(linings[0], lambda t: linings[2](1.0 - np.asarray(t)), along[1], along[2])
    patches.append(Patch(np.swapaxes(up, 0, 1), "chamber", 1))
    return patches + _core_patches(profile, n, inside, lining)


def _along_wall(n: Divisions) -> tuple[FloatArray, ...]:
    """Parameters along valley, flank, crest, flank, valley of one unit."""
    return (
        line_nodes(n.valley),
        line_nodes(n.flank),
        line_nodes(n.crest),
        line_nodes(n.flank),
        line_nodes(n.valley),
    )


def _lining_corners(profile: Profile, z: float) -> FloatArray:
    """Corners of the inner block of a slot, (4, 2), from its lower mouth round its end to its upper mouth."""
    middle = z + profile.pitch / 2
    root, end = (profile.slot_half_width(x) for x in (profile.valley_inside, profile.slot_end))
    depth = profile.slot_end - profile.valley_inside
    back = min(0.25 * depth, (1 - LINING) * end + 0.5 * profile.fillet_chamber)
    x = np.array([profile.valley_inside, profile.slot_end - back])
    x = np.r_[x, x[::-1]]
    return np.column_stack([x, middle + LINING * np.array([-root, -end, end, root])])


def _core_patches(profile: Profile, n: Divisions, inside: list[Curve], lining: FloatArray) -> list[Patch]:
    """The chamber between partition and valleys: a row for each valley, lining and slot."""
    mouth = [inside[1](np.zeros(1))[0], lining[0], lining[3], inside[4](np.zeros(1))[0]]
    rights = [inside[0], *(line(a, b) for a, b in pairwise(mouth)), inside[4]]
    patches = []
    along, lined = _along_wall(n), line_nodes(n.lining)
    for right, t in zip(rights, (along[0], lined, along[2], lined, along[4]), strict=True):
        left = _onto(right, profile.partition_face)
        patches.append(Patch(ruled(left, right, t, line_nodes(n.gap)), "chamber", 1))
    return patches


def _onto(curve: Curve, x: float) -> Curve:
    """The curve's projection onto a line of constant x, with its heights kept."""
    return lambda t: np.column_stack([np.full(len(t), x), curve(t)[:, 1]])


def _partition_patches(profile: Profile, n: Divisions, rigid: RigidEnds | None) -> list[Patch]:
    """Both halves of the partition and of the caps over it; the rows are those of the chamber's core."""
    face = profile.partition_face
    edges = [(row.heights, row.part) for row in base_rows(profile, n, rigid)]
    for unit in range(profile.units):
        for patch in _unit_patches(profile, n, unit * profile.pitch)[-5:]:
            edges.append((patch.grid[:, 0, 1], "partition"))
    edges += [(row.heights, row.part) for row in tip_rows(profile, n)]
    x = face * (2 * line_nodes(n.partition) - 1)
    return [
        Patch(np.stack(np.broadcast_arrays(x[None, :], z[:, None]), axis=-1), part, 0) for z, part in edges
    ]


def _join(patches: list[Patch]) -> ProfileMesh:
    """One mesh from patches that meet node by node."""
    points, cells, part, side = [], [], [], []
    start = 0
    for patch in patches:
        rows, columns = patch.grid.shape[:2]
        number = start + np.arange(rows * columns).reshape(rows, columns)
        points.append(patch.grid.reshape(-1, 2))
        start += rows * columns
        for i in range(0, rows - 1, 2):
            for j in range(0, columns - 1, 2):
                corner = [number[i + a, j + b] for a, b in _VTK_QUAD9]
                cells.append(corner)
                part.append(patch.part)
                side.append(patch.side)
    stacked = np.vstack(points)
    _, first, merged = np.unique(np.round(stacked, 6) + 0.0, axis=0, return_index=True, return_inverse=True)
    numbers = merged.ravel()[np.array(cells)]
    joined = stacked[first]
    return ProfileMesh(joined, _upright(joined, numbers), np.array(part), np.array(side))


_VTK_QUAD9 = ((0, 0), (0, 2), (2, 2), (2, 0), (0, 1), (1, 2), (2, 1), (1, 0), (1, 1))
_MIRROR_QUAD9 = [1, 0, 3, 2, 4, 7, 6, 5, 8]


def _upright(points: FloatArray, cells: IntArray) -> IntArray:
    """The cells, those of negative area turned over."""
    a, b, c, d = (points[cells[:, k]] for k in range(4))
    diagonals = (c - a, d - b)
    area = diagonals[0][:, 0] * diagonals[1][:, 1] - diagonals[0][:, 1] * diagonals[1][:, 0]
    turned = cells.copy()
    turned[area < 0] = cells[area < 0][:, _MIRROR_QUAD9]
    return turned
