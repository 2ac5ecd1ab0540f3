"""The bill of materials: volume and mass of every part, fluid, resin and print envelope."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from tubefoot.design.outline import chamber, silhouette
from tubefoot.design.parts import Part
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.design.surface import TriangleMesh
from tubefoot.units import ML

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign


@dataclass(frozen=True)
class Bill:
    """Rows, one a part, and what holds for the whole finger; keys bear their units."""

    rows: list[dict[str, Any]]
    totals: dict[str, Any]


def bill_of_materials(design: FingerDesign, parts: list[Part], laid: dict[str, TriangleMesh]) -> Bill:
    """The bill for one finger on its base; the gripper base is listed but not summed.

    design : the finger
    parts : its parts
    laid : their meshes as they lie on the tray
    """
    rows = []
    masses: dict[str, float] = {}
    for part in parts:
        size = laid[part.name].size
        rows.append(
            {
                "part": part.name,
                "material": part.material,
                "copies": part.copies,
                "volume_mm3": part.volume,
                "mass_g": part.mass_g,
                "tray_x_mm": float(size[0]),
                "tray_y_mm": float(size[1]),
                "tray_z_mm": float(size[2]),
                "purpose": part.purpose,
            }
        )
        if part.shifts:
            masses[part.material] = masses.get(part.material, 0.0) + part.copies * part.mass_g
    fluid, lumen = chamber_rest_volume(design.profile), lumen_volume(design)
    area = bond_area(design)
    assembled = [part.mesh.bounds for part in parts if part.shifts == ((0.0, 0.0, 0.0),)]
    low = np.min([bounds[0] for bounds in assembled], axis=0)
    high = np.max([bounds[1] for bounds in assembled], axis=0)
    totals = {
        **{f"mass_{material.lower()}_g": mass for material, mass in masses.items()},
        "mass_g": sum(masses.values()),
        "fluid_volume_per_chamber_ml": fluid / ML,
        "fluid_volume_in_tubes_per_chamber_ml": lumen / ML,
        "fluid_volume_finger_ml": 2 * (fluid + lumen) / ML,
        "resin_area_mm2": area,
        "resin_volume_mm3": area * design.seam.thickness_mm,
        "finger_x_mm": design.profile.envelope[0],
        "finger_y_mm": design.profile.envelope[1],
        "finger_z_mm": design.profile.envelope[2],
        "assembly_x_mm": float(high[0] - low[0]),
        "assembly_y_mm": float(high[1] - low[1]),
        "assembly_z_mm": float(high[2] - low[2]),
    }
    return Bill(rows, totals)


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
