"""Pictures that runs of other verbs left in their directories, as they are."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

from tubefoot.report.look import Picture
from tubefoot.report.runs import RunRecord
from tubefoot.report.validation import CAPTION as VALIDATION_CAPTION

FOLDERS = (".", "figures", "pictures")
CAPTIONS = {
    "bend": "Measured angle, target and tolerance band; each run of the pump, forward up; change of the "
    "branch pressures since neutral.",
    "validation": VALIDATION_CAPTION,
    "attribution": "What each cause changes of angle and suction pressure against the ideal finger: alone, "
    "taken away last, and the mean over all orders (Shapley).",
    "strip": "The gripper at the beginning of each phase; red dots: contact.",
    "angles": "Turn of the centreline over the lower (theta1) and upper half (theta2) of both fingers during "
    "a grasp; background: closing, gripping, hold, lift, shaking.",
    "plane": "The path of (theta1, theta2), mean of both fingers; square: contact sure, star: end of hold. "
    "theta2 grows with every pulse: its sign belongs to a grip level, not to the shape alone.",
    "forces": "Normal force of each finger, estimated from angles and pressures and as it is on the "
    "virtual gripper; gauge pressures of the branches.",
}
"""What pictures show whose name says it; others are captioned by their name alone."""


def kept_pictures(runs: Sequence[RunRecord], taken: Collection[str]) -> list[Picture]:
    """The pictures beside the summaries of runs; the first of a name has it as its anchor.

    runs : of any verb but `solve`; taken : anchors that are in use
    """
    used, found = set(taken), []
    for run in runs:
        for png in _pictures_of(run.directory):
            key = _anchor(png.stem, run.name, used)
            used.add(key)
            svg = png.with_suffix(".svg")
            name = png.stem.replace("-", " ").replace("_", " ").capitalize()
            caption = CAPTIONS.get(png.stem, f"Drawn by {run.verb.replace('-', ' ')}.")
            found.append(Picture(key, f"{name}, {run.name}", caption, png, svg if svg.exists() else None))
    return found


def _pictures_of(directory: Path) -> list[Path]:
    return [path for folder in FOLDERS for path in sorted((directory / folder).glob("*.png"))]


def _anchor(stem: str, run_name: str, used: Collection[str]) -> str:
    """An anchor that is not in use: the stem, else with the run's name, else numbered."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", stem)
    if plain not in used:
        return plain
    named = f"{plain}-{re.sub(r'[^A-Za-z0-9_-]+', '-', run_name)}"
    numbered = (f"{named}-{number}" for number in range(2, 10_000))
    return named if named not in used else next(key for key in numbered if key not in used)
