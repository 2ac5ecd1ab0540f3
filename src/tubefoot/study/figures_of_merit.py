"""What a candidate is judged by: numbers read from its solve and from its design.

At 35 kPa in the right chamber unless the name says otherwise; a number that the solve does not give is None.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.design.printability import check_rules
from tubefoot.design.rules import Rule, broken
from tubefoot.records import read_table
from tubefoot.study.curve import REFERENCE_KPA, Curve, FloatArray, line_fit
from tubefoot.study.stress_claims import CENTRAL, FOLDS, share

Row = dict[str, Any]

ZONES_BESIDE = ("near_mid_plane",)
"""Zones of hotspots.csv that overlap the others."""


def design_figures(design: FingerDesign, max_slenderness: float) -> Row:
    """Footprint, sealing width, slenderness, broken rules.

    design : the finger; max_slenderness : of the partition
    """
    width, height, length = design.profile.envelope
    rules = [*check_rules(design), slenderness_rule(design, max_slenderness)]
    faults = broken(rules)
    return {
        "units": design.profile.units,
        "width_mm": width,
        "height_mm": height,
        "length_mm": length,
        "footprint_cm3": width * height * length / 1000.0,
        "sealing_width_mm": min(rule.value for rule in rules if rule.name.startswith("sealing width")),
        "partition_slenderness": rules[-1].value,
        "printable": not faults,
        "broken_rules": "; ".join(dict.fromkeys(rule.name for rule in faults)),
        "rule_violation": violation(faults),
    }


def slenderness_rule(design: FingerDesign, limit: float) -> Rule:
    """Free height of the partition over its thickness.

    design : the finger; limit : the largest allowed
    """
    profile = design.profile
    ratio = (profile.height - 2 * profile.side_wall) / profile.partition
    return Rule(
        "slenderness of the partition", ratio, limit, "<=", "", "raise partition_mm or reduce height_mm"
    )


def violation(faults: list[Rule]) -> float:
    """By how much rules are broken, summed as shares of their limits.

    faults : broken rules
    """
    return float(sum(abs(rule.value - rule.limit) / max(abs(rule.limit), 0.1) for rule in faults))


def solve_figures(directory: Path, angle_deg: float) -> Row:
    """Bending, stress and seam of a solved candidate.

    directory : of the solve; angle_deg : at which `von_mises_p99_at_angle_kpa` is read
    """
    curve = Curve(directory)
    pressure, bend = curve.column("pressure_right_kpa"), curve.column("bend_deg")
    figures: Row = {
        "end_pressure_right_kpa": float(pressure[-1]),
        "end_bend_deg": float(bend[-1]),
        "von_mises_p99_at_angle_kpa": _at(bend, curve.column("von_mises_p99_kpa"), angle_deg),
        "min_jacobian": float(curve.column("min_jacobian").min()),
    }
    if pressure.max() < REFERENCE_KPA - 1e-3:
        return figures
    gain, r_squared, _ = line_fit(*curve.up_to_reference("pressure_right_kpa", "bend_deg"))
    figures |= {
        "bend_deg_at_35kpa": curve.at_reference("bend_deg"),
        "gain_deg_per_kpa": gain,
        "gain_r_squared": r_squared,
        "pressure_left_kpa": curve.at_reference("pressure_left_kpa"),
        "pumped_volume_ml": curve.at_reference("pumped_volume_ml"),
        "von_mises_p99_kpa": curve.at_reference("von_mises_p99_kpa"),
    }
    return {**figures, **_regions(directory, curve), **_spread(curve), **_seam(curve)}


def _regions(directory: Path, curve: Curve) -> Row:
    """99th percentile of von Mises stress of each region."""
    step = int(np.argmin(np.abs(curve.column("pressure_right_kpa") - REFERENCE_KPA)))
    return {
        f"von_mises_p99_{row['region']}_kpa": row["von_mises_p99_kpa"]
        for row in read_table(directory / "regions.csv")
        if int(row["step"]) == step
    }


def _spread(curve: Curve) -> Row:
    """Where the 5 % of the volume with the highest von Mises stress lie."""
    zones = {zone: row for zone, row in curve.hotspots("von_mises").items() if zone not in ZONES_BESIDE}
    if not zones:
        return {}
    stress = curve.unit_stress()
    return {
        "hottest_share_central": share(zones, CENTRAL),
        "hottest_share_folds": share(zones, FOLDS),
        "stress_concentration": max(
            float(row["hottest_share"]) / float(row["volume_share"])
            for row in zones.values()
            if float(row["volume_share"]) > 0
        ),
        "unit_stress_variation": float(stress.std() / stress.mean()),
    }


def _seam(curve: Curve) -> Row:
    rows = curve.seam()
    if "all" not in rows:
        return {}
    margin = rows["all"].get("bond_margin")
    return {
        "seam_s33_p99_kpa": float(rows["all"]["s33_p99_kpa"]),
        "seam_opening_force_right_n": float(rows["right"]["opening_force_n"]),
        "seam_peeling_moment_right_n_mm": float(rows["right"]["peeling_moment_n_mm"]),
        "seam_margin": margin if isinstance(margin, float) else None,
    }


def _at(x: FloatArray, y: FloatArray, at: float) -> float | None:
    """y where x takes a value, by a shape-preserving cubic; None beyond the curve or where x turns back."""
    from scipy.interpolate import PchipInterpolator

    if len(x) < 2 or not (np.diff(x) > 0).all() or not x[0] <= at <= x[-1]:
        return None
    value = float(PchipInterpolator(x, y)(at))
    return value if math.isfinite(value) else None
