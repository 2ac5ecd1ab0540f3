"""Rules for a finger that is to be printed on a PolyJet machine, freed of support, bonded and plumbed.

Limits come from the design's `printing` section; walls and gaps are measured on the mid-plane section, whose
outlines the solids share. The cavities run straight from the bonding face to the side walls, so that after
splitting every point of them is seen along y; what remains to be asked is how wide the opening is.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design.layout import (
    base_of,
    gripper_base_of,
    lip_of,
    marker_plate_of,
    pin_places,
    stretched_hose_outer,
    tube_axis,
)
from tubefoot.design.outline import chamber, nearest, silhouette
from tubefoot.design.rules import Rule, geometry_rules

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

MIN_INTERFERENCE, MAX_INTERFERENCE = 0.04, 0.35
"""Stretch of the hose over a tube: below it leaks, above it cannot be slid on by hand; our choice."""
MIN_ENGAGEMENT = 1.0
"""Length of hose on a tube over the tube's diameter; our choice."""
MIN_LAND_MM = 0.4
"""Bonding face left beside a hole or groove in it; our choice."""


def check_rules(design: FingerDesign) -> list[Rule]:
    """Every rule for a design: its geometry, then walls, gaps, features, fits and the tray.

    design : the finger
    """
    return [*geometry_rules(design.profile, design.ports), *printability_rules(design)]


def printability_rules(design: FingerDesign) -> list[Rule]:
    """The rules for printing, cleaning, bonding and plumbing a finger.

    design : the finger
    """
    return [
        *_wall_rules(design),
        *_gap_rules(design),
        *_registration_rules(design),
        *_plumbing_rules(design),
        *_mount_rules(design),
        *_marker_rules(design),
        *_tray_rules(design),
    ]


def _wall_rules(design: FingerDesign) -> list[Rule]:
    profile, printing = design.profile, design.printing
    right = chamber(profile).points()
    outer, outer_place = nearest(silhouette(profile).points(), right)
    web, web_place = nearest(right, right * [-1.0, 1.0])
    least = min(outer, web, profile.side_wall, profile.cap)
    axis, radius = tube_axis(profile, design.ports), design.ports.outer_diameter_mm / 2
    tube = (axis, -profile.cap / 2)
    tube_wall = radius - design.ports.bore_mm / 2
    cover = min(profile.valley_outside - axis, profile.height / 2) - radius
    thin = "raise bellows.fold_wall_mm, valley_wall_mm or partition_mm, whichever is at the place"
    growth = printing.growth_mm
    return [
        _least("sealing width, chamber to outside", outer, printing.min_seal_mm, thin, outer_place),
        _least("sealing width, chamber to chamber", web, printing.min_seal_mm, "raise bellows.partition_mm", web_place),
        _least("sealing width, chamber to cap end", profile.cap, printing.min_seal_mm, "raise bellows.cap_mm", tube),
        _least(
            "side wall", profile.side_wall, printing.min_wall_mm, "raise bellows.side_wall_mm", _slot(design)
        ),
        _least("tube wall", tube_wall, printing.min_wall_mm, "raise ports.outer_diameter_mm", tube),
        _least(
            "cap beside the tube", cover, printing.min_wall_mm,
            "reduce ports.outer_diameter_mm or ports.axis_mm, or raise bellows.valley_outside_mm or height_mm",
            (axis + radius, -profile.cap / 2),
        ),
        _least(
            "thinnest wall in a growth-compensated file", min(least, tube_wall) - 2 * growth,
            printing.min_feature_mm, "raise that wall or reduce printing.growth_mm", outer_place,
        ),
    ]  # fmt: skip


def _gap_rules(design: FingerDesign) -> list[Rule]:
    """Openings in the file, and what is left of them when faces grow without compensation."""
    profile, printing = design.profile, design.printing
    slot, gap = 2 * profile.slot_half_width(profile.slot_end), profile.chamber_gap
    core = profile.height - 2 * profile.side_wall
    middle = (profile.partition_face + profile.valley_inside) / 2
    grown = 2 * printing.growth_mm
    bore = design.ports.bore_mm
    slot_advice = "raise bellows.crest_flat_mm or reduce fold_wall_mm"
    valley = (profile.crest_outside, profile.pitch if profile.units > 1 else 0.0)
    rules = [
        _least("fold slot as printed", slot - grown, printing.min_gap_mm, slot_advice, _slot(design)),
        _least("support removal: opening of a fold slot", slot, printing.tool_mm, slot_advice, _slot(design)),
        _least(
            "support removal: opening of the chamber", gap, printing.tool_mm,
            "raise bellows.chamber_gap_mm", (middle, profile.pitch / 2),
        ),
        _least(
            "support removal: height of the chamber", core, printing.tool_mm,
            "raise bellows.height_mm or reduce side_wall_mm", (middle, profile.pitch / 2),
        ),
        _least(
            "support removal: bore of the tubes", bore, printing.tool_mm,
            "raise ports.bore_mm", (tube_axis(profile, design.ports), -profile.cap / 2),
        ),
        _least("bore as printed", bore - grown, printing.min_detail_mm, "raise ports.bore_mm",
               (tube_axis(profile, design.ports), -profile.cap / 2)),
    ]  # fmt: skip
    if profile.units > 1:
        advice = "raise bellows.valley_flat_mm"
        rules.append(
            _least(
                "valley between folds as printed",
                profile.valley_flat - grown,
                printing.min_gap_mm,
                advice,
                valley,
            )
        )
    return rules


def _registration_rules(design: FingerDesign) -> list[Rule]:
    registration, printing, profile = design.registration, design.printing, design.profile
    rules = []
    if pins := pin_places(design):
        hole = registration.pin_diameter_mm / 2 + registration.clearance_mm
        beside = tube_axis(profile, design.ports) - design.ports.outer_diameter_mm / 2 - hole
        thick = registration.pin_diameter_mm - 2 * printing.growth_mm
        less = "reduce registration.pin_diameter_mm, or set it to 0 to leave the pins out"
        depth = profile.height / 2 - registration.pin_height_mm - 2 * registration.clearance_mm
        rules += [
            _least("pin in a growth-compensated file", thick, printing.min_feature_mm, "raise registration.pin_diameter_mm", pins[0]),
            _least("bonding face between pin hole and tube", beside, MIN_LAND_MM, less, pins[0]),
            _least("bonding face between pin hole and cap end", profile.cap / 2 - hole, MIN_LAND_MM, less, pins[0]),
            _least("wall behind the pin hole", depth, printing.min_wall_mm, "reduce registration.pin_height_mm", pins[0]),
        ]  # fmt: skip
    if (lip := lip_of(design)) is not None:
        land = (profile.partition - lip.width) / 2 - registration.clearance_mm
        thin = lip.width - 2 * printing.growth_mm
        place = (0.0, profile.pitch / 2)
        back = profile.height / 2 - lip.height - registration.clearance_mm
        rules += [
            _least("lip in a growth-compensated file", thin, printing.min_feature_mm, "raise registration.lip_width_mm or set it to 0", place),
            _least("bonding face beside the groove", land, MIN_LAND_MM, "reduce registration.lip_width_mm or set it to 0", place),
            _least("wall behind the groove", back, printing.min_wall_mm, "reduce registration.lip_height_mm", place),
        ]  # fmt: skip
    return rules


def _plumbing_rules(design: FingerDesign) -> list[Rule]:
    ports, profile = design.ports, design.profile
    axis = tube_axis(profile, ports)
    stretch = ports.outer_diameter_mm / ports.hose_bore_mm - 1
    bottom = (axis, -profile.cap - ports.length_mm / 2)
    top = (axis, profile.bellows_length + profile.cap + ports.length_mm / 2)
    free = ports.length_mm - design.base.plate_mm
    engaged = ports.connector_length_mm - ports.plug_length_mm
    need = MIN_ENGAGEMENT * ports.outer_diameter_mm
    fit = "change ports.outer_diameter_mm or ports.hose_bore_mm"
    tube_hole = ports.outer_diameter_mm / 2 + design.base.tube_clearance_mm
    web = 2 * (axis - tube_hole)
    return [
        _least("hose: stretch over the tube", 100 * stretch, 100 * MIN_INTERFERENCE, fit, bottom, "%"),
        Rule("hose: stretch over the tube", 100 * stretch, 100 * MAX_INTERFERENCE, "<=", "%", fit, place=bottom),
        _least("hose: wall", (ports.hose_outer_mm - ports.hose_bore_mm) / 2, design.printing.min_wall_mm,
               "raise ports.hose_outer_mm or reduce hose_bore_mm", bottom),
        Rule("hoses beside each other: stretched diameter", stretched_hose_outer(ports), 2 * axis, "<=", "mm",
             "raise ports.axis_mm, or take a thinner hose", place=bottom),
        _least("hose on a bottom tube, below the base", free, need, "raise ports.length_mm or reduce base.plate_mm", bottom),
        _least("connector on a top tube", min(engaged, ports.length_mm), need,
               "raise ports.connector_length_mm or ports.length_mm", top),
        Rule("connector beyond the tube's free length", engaged, ports.length_mm, "<=", "mm",
             "reduce ports.connector_length_mm or raise ports.plug_length_mm", place=top),
        _least("plug in its connector", ports.plug_length_mm, need, "raise ports.plug_length_mm", top),
        _least("base between its tube holes", web, design.printing.min_wall_mm,
               "raise ports.axis_mm or reduce base.tube_clearance_mm", (0.0, bottom[1])),
    ]  # fmt: skip


def _mount_rules(design: FingerDesign) -> list[Rule]:
    base, profile, printing = design.base, design.profile, design.printing
    mount, gripper = base_of(design), gripper_base_of(design)
    place = (profile.valley_outside, mount.seat)
    socket = (mount.socket_half_x, mount.rim)
    between = gripper.finger_x[1] - gripper.finger_x[0] - 2 * gripper.socket_half_x
    rules = [
        Rule("base socket: depth", base.socket_depth_mm, profile.cap, "<=", "mm",
             "reduce base.socket_depth_mm: the socket would grip the first fold", place=place),
        _least("base socket: wall", base.socket_wall_mm, printing.min_wall_mm, "raise base.socket_wall_mm", socket),
        Rule("base screw: hole", base.screw_hole_mm, base.screw_head_mm - 1.0, "<=", "mm",
             "reduce base.screw_hole_mm or raise screw_head_mm", place=place),
        _least("base plate", base.plate_mm, 2.0, "raise base.plate_mm: the screws need a stiff seat", place),
    ]  # fmt: skip
    if between > 0:
        rules.append(
            _least("gripper base: gap between the sockets", between, printing.min_gap_mm,
                   "change gripper.finger_gap_mm: close the gap or widen it", socket)
        )  # fmt: skip
    return rules


def _marker_rules(design: FingerDesign) -> list[Rule]:
    plate, profile, seats = marker_plate_of(design), design.profile, design.marker_seats
    if not plate.units:
        return []
    first = (0.0, plate.heights[0])
    rules = [
        Rule("marker seats: highest unit", float(plate.units[-1]), float(profile.units), "<=", "",
             "list units of this finger in marker_seats.units", place=(0.0, plate.heights[-1])),
        Rule("marker pad: length", seats.pad_length_mm, profile.crest_flat, "<=", "mm",
             "reduce marker_seats.pad_length_mm to stay on the crest", place=first),
        _least("marker plate above the base", plate.heights[0] - plate.side / 2 - base_of(design).rim, 0.5,
               "start marker_seats.units higher or reduce marker_seats.marker_mm", first),
        _least("marker plate: web between pocket and tag",
               seats.plate_mm - seats.pocket_mm - seats.tag_recess_mm, design.printing.min_wall_mm,
               "raise marker_seats.plate_mm", first),
        Rule("marker plate: pocket over pad height", seats.pocket_mm, seats.pad_height_mm - 0.3, "<=", "mm",
             "raise marker_seats.pad_height_mm: the plate would touch the side wall", place=first),
    ]  # fmt: skip
    if len(plate.heights) > 1:
        step = np.diff(plate.heights)
        closest = int(np.argmin(step))
        rules.append(
            _least("marker seats: spacing", float(step[closest]), 1.05 * plate.side,
                   "list fewer marker_seats.units: bent plates would overlap", (0.0, plate.heights[closest]))
        )  # fmt: skip
    return rules


def _tray_rules(design: FingerDesign) -> list[Rule]:
    """The longest parts against the tray: lying modules with their tubes, and the gripper base."""
    profile, printing = design.profile, design.printing
    length = profile.envelope[2] + 2 * design.ports.length_mm
    gripper = 2 * gripper_base_of(design).plate_half_x
    longest = max(printing.tray_mm[:2])
    return [
        Rule("module length with tubes", length, longest, "<=", "mm", "reduce bellows.units or the pitch"),
        Rule("module width", profile.envelope[0], min(printing.tray_mm[:2]), "<=", "mm", "reduce bellows.fold_run_mm"),
        Rule("gripper base length", gripper, longest, "<=", "mm", "reduce gripper.finger_gap_mm"),
    ]  # fmt: skip


def bond_area(design: FingerDesign) -> float:
    """Area of the bonding face that takes resin: the section of body and tubes, once [mm^2].

    design : the finger
    """
    profile, ports = design.profile, design.ports
    body = silhouette(profile).area() - 2 * chamber(profile).area()
    bores = 4 * ports.bore_mm * profile.cap
    outside = 4 * (ports.outer_diameter_mm - ports.bore_mm) * ports.length_mm
    return body - bores + outside


def lumen_volume(design: FingerDesign) -> float:
    """Fluid in the two tubes of one chamber [mm^3].

    design : the finger
    """
    length = design.profile.cap + design.ports.length_mm
    return 2 * pi / 4 * design.ports.bore_mm**2 * length


def _slot(design: FingerDesign) -> tuple[float, float]:
    return design.profile.slot_end, design.profile.pitch / 2


def _least(
    name: str,
    value: float,
    limit: float,
    advice: str,
    place: tuple[float, float] | np.ndarray,
    unit: str = "mm",
) -> Rule:
    return Rule(name, float(value), limit, ">=", unit, advice, place=(float(place[0]), float(place[1])))
