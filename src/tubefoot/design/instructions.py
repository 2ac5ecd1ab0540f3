"""Assembly instructions as one self-contained page: print, clean, bond, mount, fill, plug."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from tubefoot.design.bill import Bill
from tubefoot.design.layout import lip_of, marker_plate_of, pin_places
from tubefoot.design.outline import chamber, nearest, silhouette
from tubefoot.records import write_whole

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign


def write_instructions(
    path: Path, design: FingerDesign, bill: Bill, pictures: dict[str, Path], growth: float
) -> Path:
    """The path of the page, pictures embedded.

    path : file to write
    design : the finger
    bill : its bill of materials
    pictures : PNG files by name, as made by `stills.draw`
    growth : growth compensation of the exported files [mm]
    """
    profile, ports = design.profile, design.ports
    right = chamber(profile).points()
    seal = min(nearest(silhouette(profile).points(), right)[0], profile.partition, profile.cap)
    loader = PackageLoader("tubefoot.design", ".")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True)
    page = environment.get_template("instructions.html.j2").render(
        name=design.name,
        units=profile.units,
        rows=bill.rows,
        totals=bill.totals,
        pictures=_Embedded(pictures),
        growth=growth,
        slot_mm=2 * profile.slot_half_width(profile.slot_end),
        bore_mm=ports.bore_mm,
        pins=len(pin_places(design)),
        lip=lip_of(design) is not None,
        seam_mm=design.seam.thickness_mm,
        seal_mm=seal,
        socket_mm=design.base.socket_depth_mm,
        clearance_mm=design.base.clearance_mm,
        screw_mm=design.base.screw_hole_mm,
        markers=marker_plate_of(design).units,
        marker_mm=design.marker_seats.marker_mm,
        hose_bore_mm=ports.hose_bore_mm,
        hose_outer_mm=ports.hose_outer_mm,
        engaged_mm=ports.connector_length_mm - ports.plug_length_mm,
        finger_gap_mm=design.gripper.finger_gap_mm,
    )
    return write_whole(path, page)


class _Embedded(dict[str, str]):
    """Pictures as base64 text by name; empty for those that were not drawn."""

    def __init__(self, pictures: dict[str, Path]):
        super().__init__({name: b64encode(path.read_bytes()).decode() for name, path in pictures.items()})

    def __missing__(self, name: str) -> str:
        return ""
