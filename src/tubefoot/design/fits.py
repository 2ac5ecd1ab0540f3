"""Rules for what must fit: hoses, connectors and plugs, bases, marker seats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design.layout import (
    ABOVE_RIM_MM,
    base_of,
    gripper_base_of,
    marker_plate_of,
    stretched_hose_outer,
    tube_axis,
)
from tubefoot.design.rules import Rule, at_least

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

MIN_INTERFERENCE, MAX_INTERFERENCE = 0.04, 0.35
"""Stretch of the hose over a tube: below it leaks, above it cannot be slid on by hand; our choice."""
MIN_ENGAGEMENT = 1.0
"""Length of hose on a tube over the tube's diameter; our choice."""


def plumbing_rules(design: FingerDesign) -> list[Rule]:
    """Hose, connectors and plugs: stretch, engagement, and room beside each other.

    design : the finger
    """
    return [*_hose_rules(design), *_connector_rules(design)]


def _hose_rules(design: FingerDesign) -> list[Rule]:
    ports, profile = design.ports, design.profile
    axis = tube_axis(profile, ports)
    stretch = ports.outer_diameter_mm / ports.hose_bore_mm - 1
    bottom = (axis, -profile.cap - ports.length_mm / 2)
    free = ports.length_mm - design.base.plate_mm
    need = MIN_ENGAGEMENT * ports.outer_diameter_mm
    fit = "change ports.outer_diameter_mm or ports.hose_bore_mm"
    tube_hole = ports.outer_diameter_mm / 2 + design.base.tube_clearance_mm
    web = 2 * (axis - tube_hole)
    return [
        at_least("hose: stretch over the tube", 100 * stretch, 100 * MIN_INTERFERENCE, fit, bottom, "%"),
        Rule(
            "hose: stretch over the tube", 100 * stretch, 100 * MAX_INTERFERENCE, "<=", "%", fit, place=bottom
        ),
        at_least(
            "hose: wall",
            (ports.hose_outer_mm - ports.hose_bore_mm) / 2,
            design.printing.min_wall_mm,
            "raise ports.hose_outer_mm or reduce hose_bore_mm",
            bottom,
        ),
        Rule(
            "hoses beside each other: stretched diameter",
            stretched_hose_outer(ports),
            2 * axis,
            "<=",
            "mm",
            "raise ports.axis_mm, or take a thinner hose",
            place=bottom,
        ),
        at_least(
            "hose on a bottom tube, below the base",
            free,
            need,
            "raise ports.length_mm or reduce base.plate_mm",
            bottom,
        ),
        at_least(
            "base between its tube holes",
            web,
            design.printing.min_wall_mm,
            "raise ports.axis_mm or reduce base.tube_clearance_mm",
            (0.0, bottom[1]),
        ),
    ]


def _connector_rules(design: FingerDesign) -> list[Rule]:
    ports, profile = design.ports, design.profile
    top = (tube_axis(profile, ports), profile.bellows_length + profile.cap + ports.length_mm / 2)
    engaged = ports.connector_length_mm - ports.plug_length_mm
    need = MIN_ENGAGEMENT * ports.outer_diameter_mm
    return [
        at_least(
            "connector on a top tube",
            min(engaged, ports.length_mm),
            need,
            "raise ports.connector_length_mm or ports.length_mm",
            top,
        ),
        Rule(
            "connector beyond the tube's free length",
            engaged,
            ports.length_mm,
            "<=",
            "mm",
            "reduce ports.connector_length_mm or raise ports.plug_length_mm",
            place=top,
        ),
        at_least("plug in its connector", ports.plug_length_mm, need, "raise ports.plug_length_mm", top),
    ]


def mount_rules(design: FingerDesign) -> list[Rule]:
    """Base and gripper base: socket, screws, plate.

    design : the finger
    """
    base, profile, printing = design.base, design.profile, design.printing
    mount, gripper = base_of(design), gripper_base_of(design)
    place = (profile.valley_outside, mount.seat)
    socket = (mount.socket_half_x, mount.rim)
    between = gripper.finger_x[1] - gripper.finger_x[0] - 2 * gripper.socket_half_x
    rules = [
        Rule(
            "base socket: depth",
            base.socket_depth_mm,
            profile.cap,
            "<=",
            "mm",
            "reduce base.socket_depth_mm: the socket would grip the first fold",
            place=place,
        ),
        at_least(
            "base socket: wall",
            base.socket_wall_mm,
            printing.min_wall_mm,
            "raise base.socket_wall_mm",
            socket,
        ),
        Rule(
            "base screw: hole",
            base.screw_hole_mm,
            base.screw_head_mm - 1.0,
            "<=",
            "mm",
            "reduce base.screw_hole_mm or raise screw_head_mm",
            place=place,
        ),
        at_least(
            "base plate", base.plate_mm, 2.0, "raise base.plate_mm: the screws need a stiff seat", place
        ),
    ]
    if between > 0:
        rules.append(
            at_least(
                "gripper base: gap between the sockets",
                between,
                printing.min_gap_mm,
                "change gripper.finger_gap_mm: close the gap or widen it",
                socket,
            )
        )
    return rules


def marker_rules(design: FingerDesign) -> list[Rule]:
    """Marker seats and plates: units, spacing, walls.

    design : the finger
    """
    plate, profile, seats = marker_plate_of(design), design.profile, design.marker_seats
    if not plate.units:
        return []
    first = (0.0, plate.heights[0])
    rules = [
        Rule(
            "marker seats: highest unit",
            float(plate.units[-1]),
            float(profile.units),
            "<=",
            "",
            "list units of this finger in marker_seats.units",
            place=(0.0, plate.heights[-1]),
        ),
        Rule(
            "marker pad: length",
            seats.pad_length_mm,
            profile.crest_flat,
            "<=",
            "mm",
            "reduce marker_seats.pad_length_mm to stay on the crest",
            place=first,
        ),
        at_least(
            "marker plate above the base",
            plate.heights[0] - plate.side / 2 - base_of(design).rim,
            ABOVE_RIM_MM,
            "start marker_seats.units higher or reduce marker_seats.marker_mm",
            first,
        ),
        at_least(
            "marker plate: web between pocket and tag",
            seats.plate_mm - seats.pocket_mm - seats.tag_recess_mm,
            design.printing.min_wall_mm,
            "raise marker_seats.plate_mm",
            first,
        ),
        Rule(
            "marker plate: pocket over pad height",
            seats.pocket_mm,
            seats.pad_height_mm - 0.3,
            "<=",
            "mm",
            "raise marker_seats.pad_height_mm: the plate would touch the side wall",
            place=first,
        ),
    ]
    if len(plate.heights) > 1:
        step = np.diff(plate.heights)
        closest = int(np.argmin(step))
        rules.append(
            at_least(
                "marker seats: spacing",
                float(step[closest]),
                1.05 * plate.side,
                "list fewer marker_seats.units: bent plates would overlap",
                (0.0, plate.heights[closest]),
            )
        )
    return rules
