"""The paper's claims about grasping, judged on the records of `grasp` runs (C13, C14, C15).

Angles are those at the end of the hold, means of both fingers; those when contact was sure are told beside
them, as theta2 moves by some degrees with every pulse and its sign belongs to a grip level.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tubefoot.records import read_summary
from tubefoot.study.claims import Claim, verdict_of

FAR_LARGER = 2.0
"""|theta1| over |theta2| from which on the one is far larger."""
LITTLE = 0.5
"""Change of theta2 over that of theta1, front to side, that counts as little."""
SLIP_MM = 1.0
"""A grasp without slip may move by so much."""


@dataclass(frozen=True)
class GraspRecord:
    """The directory of a `grasp` run."""

    directory: Path

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What is in summary.json; raises ConfigError when it is missing or no summary of `grasp`."""
        return read_summary(self.directory, "grasp", "pulses_after_contact")

    def angles(self, when: str = "") -> tuple[float, float]:
        """theta1 and theta2 [deg], nan where they are not known.

        when : empty for the end of the hold, `_contact` for when contact was sure
        """
        one, two = (self.summary.get(f"{name}{when}_deg") for name in ("theta1", "theta2"))
        return (math.nan if one is None else float(one)), (math.nan if two is None else float(two))


def judge_planar(front: GraspRecord, side: GraspRecord) -> Claim:
    """C13: tofu cubes.

    front, side : `grasp tofu` in either pose
    """
    parts = []
    (front1, front2), (side1, side2) = front.angles(), side.angles()
    for one, two in ((front1, front2), (side1, side2)):
        parts += [one * two > 0, abs(one) >= FAR_LARGER * abs(two)]
    parts.append(abs(side1) < abs(front1))
    parts.append(abs(side2 - front2) <= LITTLE * abs(side1 - front1))
    return Claim(
        "C13",
        "Tofu cubes: theta1 and theta2 of the same sign, |theta1| >> |theta2|; side grasp lowers theta1, "
        "theta2 changes little",
        f"at the end of the hold, in both poses: one sign, |theta1| at least {FAR_LARGER:g} |theta2|; "
        "|theta1| smaller "
        f"in the side grasp, where theta2 differs by at most {LITTLE:g} of what theta1 does",
        _verdict(parts, (front1, front2, side1, side2)),
        _numbers(front, side),
        "plane",
    )


def judge_curved(front: GraspRecord, side: GraspRecord) -> Claim:
    """C14: blueberries.

    front, side : `grasp blueberry` in either pose
    """
    (front1, front2), (side1, side2) = front.angles(), side.angles()
    parts = [
        front1 * front2 < 0,
        side1 * side2 < 0,
        abs(front2) > abs(side2),
        abs(front1) > abs(side1),
    ]
    return Claim(
        "C14",
        "Blueberries: opposite signs, an inflexion; frontal contact raises |theta2| and theta1 against "
        "side contact",
        "at the end of the hold: opposite signs in both poses; |theta1| and |theta2| larger in the front "
        "grasp",
        _verdict(parts, (front1, front2, side1, side2)),
        _numbers(front, side),
        "plane",
    )


def judge_gentleness(runs: Mapping[str, GraspRecord]) -> Claim:
    """C15: held without damage or slip.

    runs : name to run
    """
    numbers: dict[str, float] = {}
    parts = []
    for name, run in runs.items():
        found = run.summary
        slip, margin = found.get("slip_mm"), found.get("damage_margin")
        numbers |= {
            f"held_{name}": float(bool(found["held"])),
            f"slip_{name}_mm": math.nan if slip is None else slip,
            f"damage_margin_{name}": math.nan if margin is None else margin,
            f"peak_pressure_{name}_kpa": found.get("peak_pressure_kpa") or math.nan,
            f"compression_{name}_kpa": found.get("compression_kpa") or math.nan,
            f"local_compression_{name}_kpa": found.get("local_compression_kpa") or 0.0,
            f"peak_force_{name}_n": found.get("peak_force_n") or math.nan,
        }
        local = found.get("local_margin")
        parts += [
            bool(found["held"]),
            slip is not None and slip <= SLIP_MM,
            margin is not None and margin >= 1.0,
            local is None or local >= 1.0,
        ]
    return Claim(
        "C15",
        "Tofu and blueberries are held without damage or slip",
        f"held through hold, lift and shaking; slip at most {SLIP_MM:g} mm; force, stress across the object, "
        "shortening and tension within the bounds of its file, and the stress of a block under its most "
        "loaded crest. Bounds are stresses and forces known to be borne, not strengths; the peak pressure of "
        "the small patches is told, not judged",
        verdict_of(parts),
        numbers,
        "forces",
    )


def _verdict(parts: list[bool], angles: tuple[float, ...]) -> Any:
    """The verdict, not computed where an angle is missing."""
    return verdict_of(parts) if all(map(math.isfinite, angles)) else "not computed"


def _numbers(front: GraspRecord, side: GraspRecord) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for pose, run in (("front", front), ("side", side)):
        for when, name in (("", "hold"), ("_contact", "contact")):
            one, two = run.angles(when)
            numbers |= {f"theta1_{pose}_{name}_deg": one, f"theta2_{pose}_{name}_deg": two}
        numbers[f"grip_force_{pose}_n"] = float(run.summary.get("grip_force_estimated_n") or math.nan)
    return numbers
