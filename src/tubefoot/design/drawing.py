"""The dimensioned drawing of a finger: section at the mid-plane, one unit in detail, end view, title."""

from __future__ import annotations

from math import atan, cos, sin
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design.layout import base_of, tube_axis
from tubefoot.design.outline import chamber, silhouette
from tubefoot.design.section import base_pieces, circle, pin_circles, tube_bores, tube_walls
from tubefoot.design.sheet import THICK, THIN, Sheet, View, fitting_scale, scale_text
from tubefoot.design.surface import FloatArray
from tubefoot.units import DEG

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

RIGID_FILL = "#f4f1e4"


def write_drawing(design: FingerDesign, directory: Path) -> list[Path]:
    """The paths of `drawing.svg` and `drawing.pdf`, on A3 paper at a standard scale.

    design : the finger
    directory : where to write them
    """
    sheet = drawing_sheet(design)
    return [sheet.save(directory / f"drawing.{kind}") for kind in ("svg", "pdf")]


def drawing_sheet(design: FingerDesign) -> Sheet:
    """The drawing, to be saved in any format.

    design : the finger
    """
    sheet = Sheet()
    _section(sheet, design)
    _detail(sheet, design)
    _end_view(sheet, design)
    _title(sheet, design)
    return sheet


def _section(sheet: Sheet, design: FingerDesign) -> None:
    """The whole finger cut at y = 0, z to the right, on the lower half of the sheet."""
    profile, ports, mount = design.profile, design.ports, base_of(design)
    low = -profile.cap - ports.length_mm
    high = profile.bellows_length + profile.cap + ports.length_mm
    across = 2 * max(profile.crest_outside, mount.socket_half_x)
    scale = fitting_scale((high - low, across), (360.0, 95.0))
    view = View((210.0 - scale * (low + high) / 2, 92.0), scale, z_to_the_right=True)
    right = chamber(profile)
    holes = [view.points(right.points()), view.points(right.mirrored().points())]
    sheet.area(view.points(silhouette(profile).points()), holes)
    _rigid_parts(sheet, view, design)
    sheet.line([view.at(0, low - 3 / scale), view.at(0, high + 3 / scale)], THIN, "-.")
    wide, cap_low, cap_high = profile.crest_outside, -profile.cap, profile.bellows_length + profile.cap
    bottom = -across / 2
    sheet.dimension(
        view.at(bottom, cap_low), view.at(bottom, cap_high), f"length {cap_high - cap_low:.4g}", -9
    )
    sheet.dimension(
        view.at(bottom, 0),
        view.at(bottom, profile.bellows_length),
        f"bellows {profile.bellows_length:.4g} = {profile.units} × {profile.pitch:.4g}",
        -18,
    )
    sheet.dimension(view.at(bottom, low), view.at(bottom, high), f"with tubes {high - low:.4g}", -27)
    sheet.dimension(view.at(-wide, high), view.at(wide, high), f"{2 * wide:.4g}", 12, along="y")
    left = view.at(-across / 2, low)[1], view.at(across / 2, low)[1]
    sheet.text(210.0, left[1] + 6.0, f"SECTION at the bonding face y = 0   {scale_text(scale)}", 9)
    axis = tube_axis(profile, ports)
    sheet.dimension(view.at(-axis, low), view.at(axis, low), f"{2 * axis:.4g}", -8, along="y")


def _rigid_parts(sheet: Sheet, view: View, design: FingerDesign) -> None:
    """Base, tubes and pins cut at y = 0; drawn over the body, whose caps the tubes pass."""
    for wall in (*base_pieces(design), *tube_walls(design)):
        sheet.area(view.points(wall), [], RIGID_FILL, "\\\\\\\\")
    for bore in tube_bores(design):
        sheet.area(view.points(bore), [], "white", "")
    for pin in pin_circles(design):
        sheet.area(view.points(pin), [], RIGID_FILL, "")


def _detail(sheet: Sheet, design: FingerDesign) -> None:
    """One unit of the right side with wall thicknesses and pitch angle, upper left."""
    p = design.profile
    reach = p.crest_outside
    scale = fitting_scale((reach + p.partition_face, p.pitch * 1.5), (105.0, 78.0))
    view = View((52.0 + scale * p.partition_face, 232.0 - scale * p.pitch / 2), scale)
    outer, inner = _with_fillets(design)
    low, high = 0.0, p.pitch
    web = np.array(
        [
            (-p.partition_face, low),
            (p.partition_face, low),
            (p.partition_face, high),
            (-p.partition_face, high),
        ]
    )
    sheet.area(view.points(web), [])
    wall = np.concatenate(
        [
            [(p.valley_outside, low)],
            outer,
            [(p.valley_outside, high)],
            [(p.valley_inside, high)],
            inner[::-1],
            [(p.valley_inside, low)],
        ]
    )
    sheet.area(view.points(wall), [])
    sheet.line([view.at(0, low - 4 / scale), view.at(0, high + 4 / scale)], THIN, "-.")
    middle = p.pitch / 2
    sheet.thickness(
        view.at(-p.partition_face, middle), view.at(p.partition_face, middle), f"T3 = {p.partition:.4g}", 6
    )
    low_z = low + 0.1 * p.valley_flat
    sheet.dimension(
        view.at(p.valley_inside, low_z), view.at(p.valley_outside, low_z), f"T2 = {p.valley_wall:.4g}", -6
    )
    sheet.dimension(
        view.at(p.partition_face, low_z), view.at(p.valley_inside, low_z), f"gap {p.chamber_gap:.4g}", -13
    )
    lean = atan(p.slope)
    x = (p.valley_outside + p.slot_end) / 2
    z = middle + p.crest_flat / 2 + p.rise - (x - p.valley_outside) * p.slope
    on_face = view.at(x, z)
    inside = view.at(x - p.fold_wall * sin(lean), z - p.fold_wall * cos(lean))
    sheet.thickness(inside, on_face, f"T1 = {p.fold_wall:.4g}", 6)
    _pitch_angle(sheet, view, design)
    right = view.at(p.crest_outside, 0)[0]
    sheet.dimension(
        view.at(p.crest_outside, middle - p.crest_flat / 2),
        view.at(p.crest_outside, middle + p.crest_flat / 2),
        f"{p.crest_flat:.4g}",
        8,
        along="y",
    )
    sheet.dimension(
        view.at(p.valley_outside, low),
        view.at(p.valley_outside, high),
        f"pitch {p.pitch:.4g}",
        right + 16 - view.at(p.valley_outside, 0)[0],
        along="y",
    )
    sheet.dimension(
        view.at(p.valley_outside, high),
        view.at(p.crest_outside, middle + p.crest_flat / 2),
        f"run {p.crest_outside - p.valley_outside:.4g}",
        14,
    )
    sheet.text(105.0, 282.0, f"DETAIL, one unit   {scale_text(scale)}", 9)


def _pitch_angle(sheet: Sheet, view: View, design: FingerDesign) -> None:
    """The pitch angle at the lower flank, between the flank and the bending direction x."""
    p = design.profile
    degrees = atan(p.slope) / DEG
    corner = view.at(p.valley_outside, p.valley_flat / 2)
    reach = 0.75 * view.scale * (p.crest_outside - p.valley_outside)
    sheet.line([corner, (corner[0] + reach + 6, corner[1])], THIN)
    sheet.arc(corner, reach, 0.0, max(degrees, 1e-3))
    below = view.at(p.valley_outside, 0.0)
    text = f"pitch angle α = {degrees:.4g}°, tan α = {p.slope:.4g}"
    sheet.text(below[0] + 4.0, below[1] - 8.0, text, align="left")


def _end_view(sheet: Sheet, design: FingerDesign) -> None:
    """The tip seen along -z, with the base plate behind it, upper right; y runs up."""
    p, mount, ports = design.profile, base_of(design), design.ports
    scale = fitting_scale((2 * p.crest_outside, 2 * mount.plate_half_y), (90.0, 95.0))
    view = View((235.0, 228.0), scale)
    sheet.line(view.points(_rectangle(mount.plate_half_x, mount.plate_half_y)), THICK)
    sheet.line(view.points(_rectangle(mount.socket_half_x, mount.socket_half_y)), THIN)
    sheet.area(view.points(_rectangle(p.crest_outside, p.height / 2)[:-1]), [], "#d9dee4", "")
    sheet.line(view.points(_rectangle(p.valley_outside, p.height / 2)), THIN)
    for x in (-tube_axis(p, ports), tube_axis(p, ports)):
        sheet.area(
            circle(view.at(x, 0), scale * ports.outer_diameter_mm / 2),
            [circle(view.at(x, 0), scale * ports.bore_mm / 2)],
            RIGID_FILL,
            "",
        )
    for x, y in mount.screws:
        sheet.area(circle(view.at(x, y), scale * design.base.screw_hole_mm / 2), [], "white", "")
    wide = p.crest_outside
    sheet.line([view.at(-wide - 3 / scale, 0), view.at(wide + 3 / scale, 0)], THIN, "-.")
    sheet.dimension(
        view.at(wide, -p.height / 2), view.at(wide, p.height / 2), f"{p.height:.4g}", 8, along="y"
    )
    (_, low), (_, high) = mount.screws[:2]
    sheet.dimension(
        view.at(-mount.plate_half_x, low),
        view.at(-mount.plate_half_x, high),
        f"{high - low:.4g}",
        -(wide - mount.plate_half_x) * scale - 8,
        along="y",
    )
    sheet.text(235.0, 282.0, f"TIP, with base   {scale_text(scale)}", 9)


def _title(sheet: Sheet, design: FingerDesign) -> None:
    """The title block, with what has no dimension line of its own."""
    p, ports, registration = design.profile, design.ports, design.registration
    left, top = 292.0, 280.0
    sheet.text(left, top, design.name, 14, align="left")
    fillets = f"fillets {p.fillet_outside:.3g} outside, {p.fillet_chamber:.3g} in the chambers"
    pins = f"pins ⌀{registration.pin_diameter_mm:.3g} × {2 * registration.pin_height_mm:.3g}"
    lines = [
        f"dual-chamber bellows finger, {p.units} units; all dimensions in mm",
        f"body {design.body.name}, tubes and base {design.rigid.name}",
        f"T1 fold wall {p.fold_wall:.4g}, T2 valley wall {p.valley_wall:.4g}, T3 partition {p.partition:.4g}",
        f"side walls {p.side_wall:.4g}, caps {p.cap:.4g}, chamber height {p.height - 2 * p.side_wall:.4g}",
        f"tubes ⌀{ports.outer_diameter_mm:.4g} / bore {ports.bore_mm:.4g}, {ports.length_mm:.4g} long",
        fillets if p.fillet_outside or p.fillet_chamber else "profile without fillets",
        f"registration: {pins}" if registration.pin_diameter_mm else "registration: no pins",
        f"split at y = 0 and bonded with UV resin, film {design.seam.thickness_mm:.3g}",
        f"screws: holes ⌀{design.base.screw_hole_mm:.3g}",
    ]
    for number, text in enumerate(lines):
        sheet.text(left, top - 9 - 5.5 * number, text, 8, align="left")


def _with_fillets(design: FingerDesign) -> tuple[FloatArray, FloatArray]:
    """Outer and chamber side of the first unit with their fillets, (n, 2) each."""
    p = design.profile
    outer = silhouette(p).points()
    first = outer[(outer[:, 0] > 0) & (outer[:, 1] > 0) & (outer[:, 1] < p.pitch)]
    inner = chamber(p).points()
    second = inner[(inner[:, 0] > p.partition_face + 1e-9) & (inner[:, 1] > 0) & (inner[:, 1] < p.pitch)]
    return first, second


def _rectangle(half_x: float, half_y: float) -> FloatArray:
    return np.array(
        [(half_x, -half_y), (half_x, half_y), (-half_x, half_y), (-half_x, -half_y), (half_x, -half_y)]
    )
