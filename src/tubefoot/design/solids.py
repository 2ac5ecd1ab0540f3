"""The finger's solids: body, modules, tubes and registration, from the design record.

Growth compensation moves every free face of a solid inwards by `growth`, the bonding face too; faces where
soft and rigid material are printed onto each other stay together. Lengths in mm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from tubefoot.design import cad
from tubefoot.design.cad import Solid
from tubefoot.design.layout import lip_of, marker_plate_of, pin_places, tube_axis
from tubefoot.design.outline import Outline, chamber, silhouette

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

Side = Literal["front", "back"]


def whole_body(design: FingerDesign) -> Solid:
    """The unsplit body with closed caps: what the finite elements model.

    design : the finger
    """
    profile = design.profile
    half, core = profile.height / 2, profile.height / 2 - profile.side_wall
    right = chamber(profile)
    cavities = [cad.prism(outline, -core, core) for outline in (right, right.mirrored())]
    return cad.cut(cad.prism(silhouette(profile), -half, half), cavities)


def chamber_fluid(design: FingerDesign) -> Solid:
    """The fluid of the right chamber at rest, without the bores of its tubes.

    design : the finger
    """
    core = design.profile.height / 2 - design.profile.side_wall
    return cad.prism(chamber(design.profile), -core, core)


def module_body(design: FingerDesign, side: Side, growth: float = 0.0) -> Solid:
    """The soft part of one module: half the body with its sockets for tubes and pins.

    The back module carries the lip, the front module its groove and the marker pads.

    design : the finger
    side : front is y < 0
    growth : how far every free face is moved inwards
    """
    profile, registration = design.profile, design.registration
    sign = -1.0 if side == "front" else 1.0
    half, core = profile.height / 2, profile.height / 2 - profile.side_wall
    body = _slab(silhouette(profile).offset(-growth), sign, growth, half - growth)
    right = chamber(profile).offset(growth)
    tools = [_slab(outline, sign, -1.0, core + growth) for outline in (right, right.mirrored())]
    tools += [_tube_socket(design, x, top, growth) for x in _tube_x(design) for top in (False, True)]
    lip = lip_of(design)
    radius = registration.pin_diameter_mm / 2
    if side == "front":
        body = cad.joined([body, *_marker_pads(design, growth)])
        clear = registration.clearance_mm
        depth = registration.pin_height_mm + 2 * clear + growth
        tools += [
            cad.cylinder((x, 1.0, z), (0, -1, 0), radius + clear + growth, depth + 1.0)
            for x, z in pin_places(design)
        ]
        if lip is not None:
            wide = lip.width / 2 + clear + growth
            deep = -(lip.height + clear + growth)
            tools.append(
                cad.box((-wide, wide), (deep, 1.0), (lip.bottom - clear - growth, lip.top + clear + growth))
            )
    else:
        if lip is not None:
            wide = lip.width / 2 - growth
            ridge = cad.box(
                (-wide, wide),
                (growth - lip.height, 2 * growth + 0.1),
                (lip.bottom + growth, lip.top - growth),
            )
            body = cad.joined([body, ridge])
        tools += [
            cad.cylinder((x, -1.0, z), (0, 1, 0), radius - growth, registration.pin_height_mm + 1.0)
            for x, z in pin_places(design)
        ]
    body = cad.cut(body, tools)
    cad.require_valid(body, f"{side} body")
    return body


def module_rigid(design: FingerDesign, side: Side, growth: float = 0.0) -> Solid:
    """The rigid part of one module: four half tubes, and the pins in the back module.

    design : the finger
    side : front is y < 0
    growth : how far every free face is moved inwards
    """
    sign = -1.0 if side == "front" else 1.0
    halves = []
    for x in _tube_x(design):
        for top in (False, True):
            tube = _tube(design, x, top, growth)
            halves.append(cad.beyond(tube, sign * growth, above=side == "back"))
    if side == "back":
        halves += _pins(design, growth)
    solid = cad.grouped(halves)
    cad.require_valid(solid, f"{side} tubes")
    return solid


def _slab(outline: Outline, sign: float, near: float, far: float) -> Solid:
    """A prism on one side of the mid-plane, between two distances from it."""
    low, high = sorted((sign * near, sign * far))
    return cad.prism(outline, low, high)


def _tube_x(design: FingerDesign) -> tuple[float, float]:
    axis = tube_axis(design.profile, design.ports)
    return -axis, axis


def _tube_foot(design: FingerDesign, x: float, top: bool) -> tuple[float, float]:
    """Where a tube begins: at the end of the chamber."""
    return x, design.profile.bellows_length if top else 0.0


def _tube(design: FingerDesign, x: float, top: bool, growth: float) -> Solid:
    ports = design.ports
    inner, outer = ports.bore_mm / 2 + growth, ports.outer_diameter_mm / 2 - growth
    end = design.profile.cap + ports.length_mm - growth
    bevel = min(ports.lead_in_mm, 0.8 * (outer - inner))
    section = [(inner, growth), (outer, growth), (outer, end - bevel), (outer - bevel, end), (inner, end)]
    return cad.turned(section, _tube_foot(design, x, top), upwards=top)


def _tube_socket(design: FingerDesign, x: float, top: bool, growth: float) -> Solid:
    """What a tube takes from the cap, and a little beyond it on both sides."""
    radius = design.ports.outer_diameter_mm / 2 - growth
    foot_x, foot_z = _tube_foot(design, x, top)
    up = 1.0 if top else -1.0
    return cad.cylinder((foot_x, 0.0, foot_z), (0, 0, up), radius, design.profile.cap + 1.0)


def _pins(design: FingerDesign, growth: float) -> list[Solid]:
    registration = design.registration
    radius = registration.pin_diameter_mm / 2 - growth
    tip = -registration.pin_height_mm + growth
    return [
        cad.cylinder((x, tip, z), (0, 1, 0), radius, registration.pin_height_mm - tip)
        for x, z in pin_places(design)
    ]


def _marker_pads(design: FingerDesign, growth: float) -> list[Solid]:
    seats = design.marker_seats
    wall = -design.profile.height / 2
    wide, long = seats.pad_width_mm / 2 - growth, seats.pad_length_mm / 2 - growth
    return [
        cad.box(
            (-wide, wide), (wall - seats.pad_height_mm + growth, wall + growth + 0.1), (z - long, z + long)
        )
        for z in marker_plate_of(design).heights
    ]
