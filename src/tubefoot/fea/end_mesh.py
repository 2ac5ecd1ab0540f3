"""The ends of a finger in its profile's plane: both caps and, where they are modelled, the rigid parts there.

The mount is a plate under the base cap and the wall of the socket that the cap sits in; the real one is
clamped at the plate's underside, as here. Tubes are prisms of those cells of the caps whose middle lies
within the tube: about as thick, without the bore, and without the length that stands out and bears nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.finger import FingerDesign
from tubefoot.design.layout import tube_axis
from tubefoot.design.profile import Profile
from tubefoot.fea.patches import FloatArray, Patch, line, line_nodes, ruled

if TYPE_CHECKING:
    from tubefoot.fea.profile_mesh import Divisions

SLIVER_MM = 0.15
"""Soft cap above the socket's rim that is thinner than this counts as gripped."""


@dataclass(frozen=True)
class RigidEnds:
    """Rigid parts at the ends of a finger [mm].

    plate : thickness under the base cap; grip : how deep the cap sits in the socket; wall : of the socket
    tube_axis : from the centre line; tube_radius : outside
    """

    plate: float
    grip: float
    wall: float
    tube_axis: float
    tube_radius: float

    @classmethod
    def of(cls, design: FingerDesign) -> RigidEnds:
        """Those of a design.

        design : its base, ports and cap say how large they are
        """
        profile, base = design.profile, design.base
        grip = min(base.socket_depth_mm, profile.cap)
        if profile.cap - grip < SLIVER_MM:
            grip = profile.cap
        axis = tube_axis(profile, design.ports)
        return cls(base.plate_mm, grip, base.socket_wall_mm, axis, design.ports.outer_diameter_mm / 2)

    def in_tube(self, x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
        """Which places lie in a tube.

        x, y : (n,) [mm]
        """
        return np.hypot(np.abs(x) - self.tube_axis, y) < self.tube_radius


@dataclass(frozen=True)
class Row:
    """A row of cells across an end: its heights [mm], what it belongs to, and its number of cells along z."""

    low: float
    high: float
    part: str
    cells: int

    @property
    def heights(self) -> FloatArray:
        """z of the nodes."""
        return self.low + (self.high - self.low) * line_nodes(self.cells)


def base_rows(profile: Profile, n: Divisions, rigid: RigidEnds | None) -> list[Row]:
    """Rows under the first unit, from below.

    profile : derived lengths; n : cells along each line; rigid : the mount, if it is modelled
    """
    if rigid is None:
        return [Row(-profile.cap, 0.0, "cap_base", n.cap)]
    rim = -profile.cap + rigid.grip
    rows = [Row(-profile.cap - rigid.plate, -profile.cap, "mount", n.plate)]
    rows.append(Row(-profile.cap, rim, "cap_gripped", n.cap))
    return rows if rim > -SLIVER_MM else [*rows, Row(rim, 0.0, "cap_base", n.rim)]


def tip_rows(profile: Profile, n: Divisions) -> list[Row]:
    """The row above the last unit.

    profile : derived lengths; n : cells along each line
    """
    length = profile.bellows_length
    return [Row(length, length + profile.cap, "cap_tip", n.cap)]


def end_patches(profile: Profile, n: Divisions, rigid: RigidEnds | None) -> list[Patch]:
    """Right half of both ends, without the part over the partition.

    profile : derived lengths; n : cells along each line; rigid : the mount, if it is modelled
    """
    return [
        Patch(ruled(line(*near), line(*far), line_nodes(row.cells), across), part, 1)
        for row in (*base_rows(profile, n, rigid), *tip_rows(profile, n))
        for near, far, across, part in _columns(profile, n, rigid, row)
    ]


def _columns(
    profile: Profile, n: Divisions, rigid: RigidEnds | None, row: Row
) -> Iterator[tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray], FloatArray, str]]:
    """Inner and outer edge of each column of a row, parameters across it, and what it belongs to."""
    columns = [
        (profile.partition_face, profile.valley_inside, n.gap, row.part),
        (profile.valley_inside, profile.valley_outside, n.wall, row.part),
    ]
    if rigid is not None and row.part in ("mount", "cap_gripped"):
        columns.append((profile.valley_outside, profile.valley_outside + rigid.wall, n.socket, "mount"))
    for left, right, cells, part in columns:
        near, far = ((np.array([x, row.low]), np.array([x, row.high])) for x in (left, right))
        yield near, far, line_nodes(cells), part
