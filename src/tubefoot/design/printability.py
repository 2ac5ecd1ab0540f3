"""Rules for a finger that is to be printed on a PolyJet machine, freed of support, bonded and plumbed.

Limits come from the design's `printing` section; walls and gaps are measured on the mid-plane section, whose
outlines the solids share. The cavities run straight from the bonding face to the side walls, so that after
splitting every point of them is seen along y; what remains to be asked is how wide the opening is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tubefoot.design.fits import marker_rules, mount_rules, plumbing_rules
from tubefoot.design.layout import gripper_base_of, lip_of, pin_places, tube_axis
from tubefoot.design.outline import chamber, nearest, silhouette
from tubefoot.design.rules import Rule, at_least, geometry_rules

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

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
        *plumbing_rules(design),
        *mount_rules(design),
        *marker_rules(design),
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
        at_least("sealing width, chamber to outside", outer, printing.min_seal_mm, thin, outer_place),
        at_least(
            "sealing width, chamber to chamber",
            web,
            printing.min_seal_mm,
            "raise bellows.partition_mm",
            web_place,
        ),
        at_least(
            "sealing width, chamber to cap end",
            profile.cap,
            printing.min_seal_mm,
            "raise bellows.cap_mm",
            tube,
        ),
        at_least(
            "side wall", profile.side_wall, printing.min_wall_mm, "raise bellows.side_wall_mm", _slot(design)
        ),
        at_least("tube wall", tube_wall, printing.min_wall_mm, "raise ports.outer_diameter_mm", tube),
        at_least(
            "cap beside the tube",
            cover,
            printing.min_wall_mm,
            "reduce ports.outer_diameter_mm or axis_mm, or raise bellows.valley_outside_mm or height_mm",
            (axis + radius, -profile.cap / 2),
        ),
        at_least(
            "thinnest wall in a growth-compensated file",
            min(least, tube_wall) - 2 * growth,
            printing.min_feature_mm,
            "raise that wall or reduce printing.growth_mm",
            outer_place,
        ),
    ]


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
        at_least("fold slot as printed", slot - grown, printing.min_gap_mm, slot_advice, _slot(design)),
        at_least(
            "support removal: opening of a fold slot", slot, printing.tool_mm, slot_advice, _slot(design)
        ),
        at_least(
            "support removal: opening of the chamber",
            gap,
            printing.tool_mm,
            "raise bellows.chamber_gap_mm",
            (middle, profile.pitch / 2),
        ),
        at_least(
            "support removal: height of the chamber",
            core,
            printing.tool_mm,
            "raise bellows.height_mm or reduce side_wall_mm",
            (middle, profile.pitch / 2),
        ),
        at_least(
            "support removal: bore of the tubes",
            bore,
            printing.tool_mm,
            "raise ports.bore_mm",
            (tube_axis(profile, design.ports), -profile.cap / 2),
        ),
        at_least(
            "bore as printed",
            bore - grown,
            printing.min_detail_mm,
            "raise ports.bore_mm",
            (tube_axis(profile, design.ports), -profile.cap / 2),
        ),
    ]
    if profile.units > 1:
        advice = "raise bellows.valley_flat_mm"
        rules.append(
            at_least(
                "valley between folds as printed",
                profile.valley_flat - grown,
                printing.min_gap_mm,
                advice,
                valley,
            )
        )
    return rules


def _registration_rules(design: FingerDesign) -> list[Rule]:
    """Pins and lip: thick enough to print, and bonding face left beside them."""
    registration, printing, profile = design.registration, design.printing, design.profile
    rules = []
    if pins := pin_places(design):
        hole = registration.pin_diameter_mm / 2 + registration.clearance_mm
        beside = tube_axis(profile, design.ports) - design.ports.outer_diameter_mm / 2 - hole
        thick = registration.pin_diameter_mm - 2 * printing.growth_mm
        less = "reduce registration.pin_diameter_mm, or set it to 0 to leave the pins out"
        depth = profile.height / 2 - registration.pin_height_mm - 2 * registration.clearance_mm
        rules += [
            at_least(
                "pin in a growth-compensated file",
                thick,
                printing.min_feature_mm,
                "raise registration.pin_diameter_mm",
                pins[0],
            ),
            at_least("bonding face between pin hole and tube", beside, MIN_LAND_MM, less, pins[0]),
            at_least(
                "bonding face between pin hole and cap end",
                profile.cap / 2 - hole,
                MIN_LAND_MM,
                less,
                pins[0],
            ),
            at_least(
                "wall behind the pin hole",
                depth,
                printing.min_wall_mm,
                "reduce registration.pin_height_mm",
                pins[0],
            ),
        ]
    if (lip := lip_of(design)) is not None:
        land = (profile.partition - lip.width) / 2 - registration.clearance_mm
        thin = lip.width - 2 * printing.growth_mm
        place = (0.0, profile.pitch / 2)
        back = profile.height / 2 - lip.height - registration.clearance_mm
        rules += [
            at_least(
                "lip in a growth-compensated file",
                thin,
                printing.min_feature_mm,
                "raise registration.lip_width_mm or set it to 0",
                place,
            ),
            at_least(
                "bonding face beside the groove",
                land,
                MIN_LAND_MM,
                "reduce registration.lip_width_mm or set it to 0",
                place,
            ),
            at_least(
                "wall behind the groove",
                back,
                printing.min_wall_mm,
                "reduce registration.lip_height_mm",
                place,
            ),
        ]
    return rules


def _tray_rules(design: FingerDesign) -> list[Rule]:
    """The longest parts against the tray: lying modules with their tubes, and the gripper base."""
    profile, printing = design.profile, design.printing
    length = profile.envelope[2] + 2 * design.ports.length_mm
    gripper = 2 * gripper_base_of(design).plate_half_x
    longest = max(printing.tray_mm[:2])
    return [
        Rule("module length with tubes", length, longest, "<=", "mm", "reduce bellows.units or the pitch"),
        Rule(
            "module width",
            profile.envelope[0],
            min(printing.tray_mm[:2]),
            "<=",
            "mm",
            "reduce bellows.fold_run_mm",
        ),
        Rule("gripper base length", gripper, longest, "<=", "mm", "reduce gripper.finger_gap_mm"),
    ]


def _slot(design: FingerDesign) -> tuple[float, float]:
    return design.profile.slot_end, design.profile.pitch / 2
