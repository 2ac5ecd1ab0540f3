"""Wall thicknesses, gaps and cavity access, measured on exported meshes by casting rays, in mm.

The design says only where a ray starts; what it meets, and the direction square to a flank,
come from the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tubefoot.design.profile import Profile
from tubefoot.design.raycast import blocked, crossings
from tubefoot.design.surface import FloatArray, TriangleMesh

OFF_SURFACE_MM = 1e-4
"""How far off a face its line of sight begins."""


@dataclass(frozen=True)
class Measured:
    """One thickness measured at several places [mm]."""

    name: str
    designed: float
    least: float
    greatest: float
    places: int

    part: str = ""

    @property
    def error(self) -> float:
        """Largest difference from the designed value."""
        return max(abs(self.least - self.designed), abs(self.greatest - self.designed))

    def row(self) -> dict[str, str | float | int]:
        """The measurement as a row of a table, keys with units."""
        return {
            "part": self.part,
            "wall": self.name,
            "designed_mm": self.designed,
            "least_mm": self.least,
            "greatest_mm": self.greatest,
            "error_mm": self.error,
            "places": self.places,
        }


def wall_thicknesses(mesh: TriangleMesh, profile: Profile, y: float, growth: float = 0.0) -> list[Measured]:
    """Thickness of fold walls, crests, valleys, partition, side wall and chamber gap over all units.

    mesh : body of one module as assembled, or of the whole finger
    profile : where to look, and the designed values
    y : plane in which to cast, inside the chambers and off the lip and its groove
    growth : growth compensation of the mesh; walls are thinner by twice as much
    """
    found: dict[str, list[float]] = {}
    far = profile.crest_outside + 5.0
    for unit in range(profile.units):
        for side in (-1.0, 1.0):
            inwards = np.array([-side, 0.0, 0.0])
            start = np.array([side * far, y, (unit + 0.5) * profile.pitch])
            crest = crossings(mesh, start, inwards)[0]
            _note(found, "crest wall (T1)", crest, 0)
            for share in (-1.0, 1.0):
                _note(found, "fold wall (T1)", _through_flank(mesh, profile, start, inwards, share), 0)
    for end in range(profile.units + 1):
        z = np.clip(end * profile.pitch, 0.2, profile.bellows_length - 0.2)
        along = crossings(mesh, np.array([far, y, z]), np.array([-1.0, 0.0, 0.0]))[0]
        for name, index in (("valley wall (T2)", 0), ("chamber gap", 1), ("partition (T3)", 2)):
            _note(found, name, along, index)
        _note(found, "valley wall (T2)", along, 4)
    side_start = np.array([(profile.partition_face + profile.valley_inside) / 2, y, profile.pitch / 2])
    _note(found, "side wall", crossings(mesh, side_start, np.array([0.0, np.sign(y), 0.0]))[0], 0)
    designed = {
        "crest wall (T1)": profile.fold_wall - 2 * growth,
        "fold wall (T1)": profile.fold_wall - 2 * growth,
        "valley wall (T2)": profile.valley_wall - 2 * growth,
        "chamber gap": profile.chamber_gap + 2 * growth,
        "partition (T3)": profile.partition - 2 * growth,
        "side wall": profile.side_wall - 2 * growth,
    }
    return [
        Measured(name, designed[name], min(values), max(values), len(values))
        for name, values in found.items()
    ]


def unseen_share(mesh: TriangleMesh) -> float:
    """Share of a part's surface that no straight jet reaches along an axis or a diagonal, by area, 0 to 1.

    Support in an unseen place could not be washed out. Facets are asked at their centroids and, where they
    are large, near their corners too.

    mesh : one printed part, after splitting
    """
    corners, normals = mesh.corners, mesh.normals
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    weights = np.array([[1, 1, 1], [8, 1, 1], [1, 8, 1], [1, 1, 8]]) / np.array([[3], [10], [10], [10]])
    points = np.einsum("pc,tci->tpi", weights, corners) + OFF_SURFACE_MM * normals[:, None]
    owner_normals = np.repeat(normals, len(weights), axis=0)
    hidden = np.ones(len(owner_normals), dtype=bool)
    origins = points.reshape(-1, 3)
    for direction in _directions():
        ask = np.flatnonzero(hidden & (owner_normals @ direction > -1e-9))
        if len(ask) == 0:
            continue
        hidden[ask] = blocked(mesh, origins[ask], direction)
    share = hidden.reshape(-1, len(weights)).mean(axis=1)
    return float(share @ areas / areas.sum())


def _through_flank(
    mesh: TriangleMesh, profile: Profile, start: FloatArray, inwards: FloatArray, share: float
) -> FloatArray:
    """Crossings square to the outer flank: a first ray finds the facet, a second follows its normal."""
    # Half way up the slot, where the square line meets the flank's inner face and not a corner.
    x = (profile.valley_outside + profile.slot_end) / 2
    axial = profile.crest_flat / 2 + profile.rise - (x - profile.valley_outside) * profile.slope
    lean = profile.slope / np.hypot(1.0, profile.slope)
    outside = np.array([inwards[0] * -(x + 0.2 * lean), start[1], start[2] + share * (axial + 0.2)])
    towards = np.array([0.0, 0.0, -share])
    along, facets = crossings(mesh, outside, towards)
    normal = -mesh.normals[facets[0]]
    entry = outside + along[0] * towards
    return crossings(mesh, entry - normal, normal)[0]


def _note(found: dict[str, list[float]], name: str, along: FloatArray, index: int) -> None:
    """Keep the distance between two neighbouring crossings; a ray from inside starts at distance 0."""
    edges = along if name != "side wall" else along[:2]
    found.setdefault(name, []).append(float(edges[index + 1] - edges[index]))


def _directions() -> FloatArray:
    """The 26 directions of a cube's faces, edges and corners, the axes first."""
    grid = np.array(
        [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float
    )
    ordered = grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")]
    return ordered / np.linalg.norm(ordered, axis=1, keepdims=True)
