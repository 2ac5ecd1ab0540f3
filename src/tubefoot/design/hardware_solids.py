"""Solids of what goes with a finger: base, gripper base, connector, plug and marker plate, in mm."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tubefoot.design import cad
from tubefoot.design.cad import Solid
from tubefoot.design.layout import Mount, marker_plate_of, tube_axis

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign


def mount_solid(design: FingerDesign, mount: Mount, growth: float = 0.0) -> Solid:
    """A base plate with a socket for each finger, holes for their tubes, and screw holes.

    design : the finger
    mount : base of one finger or of the gripper
    growth : how far every face is moved inwards
    """
    g = growth
    plate_x, plate_y = mount.plate_half_x - g, mount.plate_half_y - g
    solids = [cad.box((-plate_x, plate_x), (-plate_y, plate_y), (mount.bottom + g, mount.seat - g))]
    tools = []
    tube_hole = design.ports.outer_diameter_mm / 2 + design.base.tube_clearance_mm + g
    axis = tube_axis(design.profile, design.ports)
    thick = mount.seat - mount.bottom
    for x in mount.finger_x:
        wall_x, wall_y = mount.socket_half_x - g, mount.socket_half_y - g
        cap_x, cap_y = mount.cap_half_x + g, mount.cap_half_y + g
        solids.append(cad.box((x - wall_x, x + wall_x), (-wall_y, wall_y), (mount.bottom + g, mount.rim - g)))
        tools.append(cad.box((x - cap_x, x + cap_x), (-cap_y, cap_y), (mount.seat - g, mount.rim + 1.0)))
        tools += [
            cad.cylinder((x + side * axis, 0.0, mount.bottom - 1.0), (0, 0, 1), tube_hole, thick + 2.0)
            for side in (-1.0, 1.0)
        ]
    tools += [
        cad.cylinder((x, y, mount.bottom - 1.0), (0, 0, 1), design.base.screw_hole_mm / 2 + g, thick + 2.0)
        for x, y in mount.screws
    ]
    solid = cad.cut(cad.joined(solids), tools)
    cad.require_valid(solid, "base")
    return solid


def connector_solid(design: FingerDesign, growth: float = 0.0) -> Solid:
    """A short connector, standing on the right top tube as if it were slid on.

    design : the finger
    growth : how far every face is moved inwards
    """
    ports, g = design.ports, growth
    inner, outer = ports.hose_bore_mm / 2 + g, ports.hose_outer_mm / 2 - g
    section = [
        (inner, g),
        (outer, g),
        (outer, ports.connector_length_mm - g),
        (inner, ports.connector_length_mm - g),
    ]
    return cad.turned(section, _connector_foot(design), upwards=True)


def plug_solid(design: FingerDesign, growth: float = 0.0) -> Solid:
    """A plug in the free end of the right connector: a shank as thick as the tubes, and a head.

    design : the finger
    growth : how far every face is moved inwards
    """
    ports, g = design.ports, growth
    shank, head = ports.outer_diameter_mm / 2 - g, ports.hose_outer_mm / 2 - g
    bevel = min(ports.lead_in_mm, 0.5 * shank)
    x, z = _connector_foot(design)
    top = ports.plug_length_mm + ports.plug_head_mm - g
    section = [
        (0.0, g),
        (shank - bevel, g),
        (shank, g + bevel),
        (shank, ports.plug_length_mm + g),
        (head, ports.plug_length_mm + g),
        (head, top),
        (0.0, top),
    ]
    return cad.turned(section, (x, z + ports.connector_length_mm - ports.plug_length_mm), upwards=True)


def marker_plate_solid(design: FingerDesign, growth: float = 0.0) -> Solid:
    """A plate for one tag, on the first seat: pocket for the pad behind, recess for the tag in front.

    design : the finger, with at least one seat
    growth : how far every face is moved inwards
    """
    seats, plate, g = design.marker_seats, marker_plate_of(design), growth
    z = plate.heights[0]
    back = -design.profile.height / 2 - seats.pad_height_mm + seats.pocket_mm
    front = back - seats.plate_mm
    half = plate.side / 2
    solid = cad.box((g - half, half - g), (front + g, back - g), (z - half + g, z + half - g))
    tools = []
    if seats.pocket_mm > 0:
        wide = seats.pad_width_mm / 2 + seats.clearance_mm + g
        long = seats.pad_length_mm / 2 + seats.clearance_mm + g
        tools.append(cad.box((-wide, wide), (back - seats.pocket_mm - g, back + 1.0), (z - long, z + long)))
    if seats.tag_recess_mm > 0:
        tag = seats.marker_mm / 2 + seats.clearance_mm + g
        tools.append(cad.box((-tag, tag), (front - 1.0, front + seats.tag_recess_mm + g), (z - tag, z + tag)))
    solid = cad.cut(solid, tools)
    cad.require_valid(solid, "marker plate")
    return solid


def _connector_foot(design: FingerDesign) -> tuple[float, float]:
    """x and z where the right connector begins: as far down the tube as its plug leaves room for."""
    ports, profile = design.ports, design.profile
    tube_end = profile.bellows_length + profile.cap + ports.length_mm
    engaged = ports.connector_length_mm - ports.plug_length_mm
    return tube_axis(profile, ports), tube_end - engaged
