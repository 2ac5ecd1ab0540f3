"""Where everything on a finger sits: tubes, pins, lip, marker seats, base and gripper base, in mm.

The front module lies at y < 0 and faces the camera (x to the right, z up); the back module lies at y > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from typing import TYPE_CHECKING

from tubefoot.design.profile import Profile

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign
    from tubefoot.design.hardware import Ports

TUBE_COVER_MM = 1.0
"""Soft material kept between a tube and the cap's flank, where the chamber allows."""
LIP_SHARE = 0.4
"""Width of the lip over the partition's."""
MIN_LIP_MM = 0.6
MARKER_CLEAR_SHARE = 1.5
"""Distance between seats over the size of their plates, so that bent plates keep clear."""
ABOVE_RIM_MM = 0.5
"""Between a marker plate and the socket's wall."""
BESIDE_HEAD_MM = 0.5
"""Between a screw head and the socket's wall."""


def tube_axis(profile: Profile, ports: Ports) -> float:
    """Distance of a tube's axis from the finger's centre line [mm].

    profile : derived lengths of the finger
    ports : its tubes
    """
    if ports.axis_mm is not None:
        return ports.axis_mm
    covered = profile.valley_outside - TUBE_COVER_MM - ports.outer_diameter_mm / 2
    inmost = profile.partition_face + ports.bore_mm / 2
    return max(inmost, min(covered, profile.valley_inside - ports.bore_mm / 2))


def stretched_hose_outer(ports: Ports) -> float:
    """Outside of a hose slid over a tube [mm]: its section keeps its area.

    ports : tubes and hose
    """
    return sqrt(ports.hose_outer_mm**2 - ports.hose_bore_mm**2 + ports.outer_diameter_mm**2)


@dataclass(frozen=True)
class Lip:
    """Lip on the partition of the back module [mm]."""

    width: float
    height: float
    bottom: float
    top: float


@dataclass(frozen=True)
class MarkerPlate:
    """Size of a marker plate and where its seats are [mm]."""

    side: float
    """Side of the square plate."""
    heights: tuple[float, ...]
    """z of the seats' centres, from the base."""
    units: tuple[int, ...]
    """The units that carry them, counted from 1."""


@dataclass(frozen=True)
class Mount:
    """Base plate with sockets [mm]: half sizes along x and y, z of its faces, screws as (x, y)."""

    cap_half_x: float
    cap_half_y: float
    socket_half_x: float
    socket_half_y: float
    plate_half_x: float
    plate_half_y: float
    bottom: float
    seat: float
    """Where the cap's bottom rests."""
    rim: float
    """Upper end of the socket's wall."""
    finger_x: tuple[float, ...]
    """Centre lines of the fingers that it carries."""
    screws: tuple[tuple[float, float], ...]


def pin_places(design: FingerDesign) -> tuple[tuple[float, float], ...]:
    """Axes of the registration pins as (x, z), in the middle of both caps [mm].

    design : the finger
    """
    if design.registration.pin_diameter_mm == 0:
        return ()
    profile = design.profile
    return ((0.0, -profile.cap / 2), (0.0, profile.bellows_length + profile.cap / 2))


def lip_of(design: FingerDesign) -> Lip | None:
    """The lip along the partition, None where the design has none.

    design : the finger
    """
    registration = design.registration
    width = registration.lip_width_mm
    if width is None:
        share = LIP_SHARE * design.profile.partition
        width = share if share >= MIN_LIP_MM else 0.0
    if width == 0:
        return None
    return Lip(width, registration.lip_height_mm, 0.0, design.profile.bellows_length)


def marker_plate_of(design: FingerDesign) -> MarkerPlate:
    """The marker plates of a finger and their seats.

    design : the finger
    """
    seats, profile = design.marker_seats, design.profile
    side = seats.marker_mm + 2 * seats.quiet_zone_mm
    units = seats.units
    if units is None:
        step = max(1, ceil(MARKER_CLEAR_SHARE * side / profile.pitch - 1e-9))
        lowest = design.base.socket_depth_mm - profile.cap + ABOVE_RIM_MM + side / 2
        first = max((step + 1) // 2, ceil(lowest / profile.pitch + 0.5 - 1e-9))
        units = tuple(range(first, profile.units + 1, step))
    units = tuple(sorted(units))
    return MarkerPlate(side, tuple((unit - 0.5) * profile.pitch for unit in units), units)


def base_of(design: FingerDesign) -> Mount:
    """The base of one finger.

    design : the finger
    """
    return _mount(design, (0.0,))


def gripper_base_of(design: FingerDesign) -> Mount:
    """The base of two fingers that face each other along x.

    design : the finger, both alike
    """
    reach = design.profile.crest_outside + design.gripper.finger_gap_mm / 2
    return _mount(design, (-reach, reach))


def _mount(design: FingerDesign, finger_x: tuple[float, ...]) -> Mount:
    base, profile = design.base, design.profile
    cap_x = profile.valley_outside + base.clearance_mm
    cap_y = profile.height / 2 + base.clearance_mm
    socket_x, socket_y = cap_x + base.socket_wall_mm, cap_y + base.socket_wall_mm
    screw_y = socket_y + BESIDE_HEAD_MM + base.screw_head_mm / 2
    seat = -profile.cap
    return Mount(
        cap_half_x=cap_x,
        cap_half_y=cap_y,
        socket_half_x=socket_x,
        socket_half_y=socket_y,
        plate_half_x=max(finger_x) + max(socket_x, base.screw_head_mm / 2 + BESIDE_HEAD_MM),
        plate_half_y=screw_y + base.screw_head_mm / 2 + BESIDE_HEAD_MM,
        bottom=seat - base.plate_mm,
        seat=seat,
        rim=seat + base.socket_depth_mm,
        finger_x=finger_x,
        screws=tuple((x, y) for x in finger_x for y in (-screw_y, screw_y)),
    )
