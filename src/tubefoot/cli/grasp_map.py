"""The map of the two angles: how theta1 and theta2 depend on grip level, size and place of the object."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tubefoot.lab.grasp_object import GraspObject

VOLUMES_ML = (-0.45, -0.3, -0.15, 0.0, 0.15, 0.3, 0.45, 0.6)
"""Pumped volumes of each finger, inward positive: grip levels."""
SIZES = (0.8, 1.0, 1.2)
"""Of the object over its record's."""
HEIGHTS_MM = (62.0, 70.0, 78.0)
"""Of the object's middle above the base."""
COLUMNS = ("object", "pose", "size", "height_mm", "expected", "kind", "confidence")


def write_map(thing: GraspObject, out: Path) -> None:
    """Compute the map of an object and write map.csv, map.png, summary.json, run.toml.

    thing : the object; out : directory
    """
    from tubefoot.records import Run, write_json, write_table
    from tubefoot.report.grasp_map import draw_map

    resolved = {
        "object": thing.model_dump(mode="json"),
        "volumes_ml": list(VOLUMES_ML),
        "sizes": list(SIZES),
        "heights_mm": list(HEIGHTS_MM),
    }
    run = Run(out, "grasp map", resolved)
    rows = map_rows(thing, print)
    write_table(run.path("map.csv"), rows)
    summary = map_summary(rows)
    write_json(run.path("summary.json"), summary)
    draw_map(run.directory)
    run.finish()
    for key, value in summary.items():
        print(f"{key:<34} {value:.4g}" if isinstance(value, float) else f"{key:<34} {value}")
    print(f"results: {run.directory}")


def map_rows(thing: GraspObject, say: Any = lambda line: None) -> list[dict[str, Any]]:
    """One row a state: grips at rest, without weight and friction.

    thing : the object; say : told of each case
    """
    rows = []
    for pose in ("front", "side"):
        cases = [(size, 70.0) for size in SIZES] + [(1.0, height) for height in HEIGHTS_MM if height != 70.0]
        for size, height in cases:
            say(f"{thing.name} {pose}, size {size:g}, height {height:g} mm")
            rows += _case_rows(thing, pose, size, height)
    return rows


def _case_rows(thing: GraspObject, pose: Any, size: float, height: float) -> list[dict[str, Any]]:
    from dataclasses import asdict

    from tubefoot.control.contact_type import classify_contact
    from tubefoot.twin.grip_state import grip_states
    from tubefoot.units import DEG

    x, y, z = thing.size_mm
    sized = thing.model_copy(update={"size_mm": (size * x, size * y, size * z)})
    expected = "planar" if thing.shape == "box" else "curved"
    rows = []
    for state in grip_states(sized, pose, VOLUMES_ML, height):
        touched = state.normal_force_n > 1e-3
        kind = classify_contact(state.theta1_deg * DEG, state.theta2_deg * DEG)
        head = (thing.name, pose, size, height, expected if touched else "even", kind.kind, kind.confidence)
        rows.append(dict(zip(COLUMNS, head, strict=True)) | asdict(state))
    return rows


def map_summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What the map says: where theta2 changes its sign, how often the paper's rule names the contact rightly.

    rows : of `map_rows`
    """
    summary: dict[str, Any] = {}
    for pose in ("front", "side"):
        course = [
            row for row in rows if row["pose"] == pose and row["size"] == 1.0 and row["height_mm"] == 70.0
        ]
        volume, force = _crossing(course)
        summary[f"theta2_zero_{pose}_volume_ml"] = volume
        summary[f"theta2_zero_{pose}_force_n"] = force
    touched = [row for row in rows if row["normal_force_n"] > 1e-3]
    for name, low, high in (
        ("below_0.03_n", 0.0, 0.03),
        ("0.03_to_0.06_n", 0.03, 0.06),
        ("above_0.06_n", 0.06, 9.0),
    ):
        there = [row for row in touched if low <= row["normal_force_n"] < high]
        right = sum(row["kind"] == row["expected"] for row in there)
        summary[f"named_rightly_{name}"] = f"{right} of {len(there)}"
    return summary


def _crossing(course: list[dict[str, Any]]) -> tuple[float, float]:
    """Volume and force at which theta2 changes its sign; nan where it does not."""
    for before, after in pairwise(course):
        low, high = before["theta2_deg"], after["theta2_deg"]
        if low < 0 <= high:
            share = -low / (high - low)
            volume, force = (
                float(before[key] + share * (after[key] - before[key]))
                for key in ("pumped_volume_ml", "normal_force_n")
            )
            return volume, force
    return math.nan, math.nan
