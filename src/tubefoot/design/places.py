"""Pictures of the places that decide printability: one panel a rule, on the section at the bonding face."""

from __future__ import annotations

import io
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from tubefoot.design.outline import chamber, silhouette
from tubefoot.design.profile import Profile
from tubefoot.design.rules import Rule
from tubefoot.design.section import base_pieces, pin_circles, tube_bores, tube_walls
from tubefoot.design.surface import FloatArray
from tubefoot.records import write_whole

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

COLUMNS = 6
PANEL_INCH = (2.6, 2.8)
PANEL_MM = (13.0, 14.0)
"""Size of a panel in mm of finger."""
REACH_MM = 5.5
"""Half the size of the piece of finger that a panel shows."""
SOLID, FLUID, RIGID = "#d9dee4", "#eaf3fb", "#efe6c4"
Piece = tuple[FloatArray, str]
"""Outline (n, 2) as (x, z) [mm] and its fill."""
PASS, FAIL = "#2a7a3f", "#b3261e"


def write_places(path: Path, profile: Profile, rules: list[Rule], design: FingerDesign | None = None) -> Path:
    """The path of a PNG with one panel for each rule that has a place, broken rules first.

    path : file to write
    profile : the finger
    rules : its rules
    design : the finger, for its tubes, pins and base; None where the dimensions make none
    """
    placed = sorted((rule for rule in rules if rule.place is not None), key=lambda rule: rule.passed)
    rows = max(1, ceil(len(placed) / COLUMNS))
    figure = Figure(figsize=(COLUMNS * PANEL_INCH[0], rows * PANEL_INCH[1]))
    # One axes for all panels is ten times as fast as one axes each.
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, COLUMNS * PANEL_MM[0])
    axes.set_ylim(-rows * PANEL_MM[1], 0)
    axes.set_axis_off()
    right = chamber(profile).points()
    pieces = [(silhouette(profile).points(), SOLID), (right, FLUID), (right * [-1.0, 1.0], FLUID)]
    if design is not None:
        pieces += [(wall, RIGID) for wall in (*base_pieces(design), *tube_walls(design))]
        pieces += [(bore, FLUID) for bore in tube_bores(design)]
        pieces += [(pin, RIGID) for pin in pin_circles(design)]
    for number, rule in enumerate(placed):
        middle = (number % COLUMNS + 0.5) * PANEL_MM[0], -(number // COLUMNS + 0.55) * PANEL_MM[1]
        _panel(axes, middle, rule, pieces)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=80)
    return write_whole(path, buffer.getvalue())


def _panel(axes: Axes, middle: tuple[float, float], rule: Rule, pieces: list[Piece]) -> None:
    """One rule: its place on the section, in a window of the sheet, under its name and numbers."""
    x, z = rule.place or (0.0, 0.0)
    shift = np.array([middle[0] - x, middle[1] - z])
    corner = (middle[0] - REACH_MM, middle[1] - REACH_MM)
    window = Rectangle(corner, 2 * REACH_MM, 2 * REACH_MM, fill=False, edgecolor="#999999", linewidth=0.6)
    axes.add_patch(window)
    for outline, colour in pieces:
        if np.any(
            np.abs((outline.min(axis=0) + outline.max(axis=0)) / 2 - (x, z))
            > np.ptp(outline, axis=0) / 2 + REACH_MM
        ):
            continue
        patch = Polygon(outline + shift, closed=True, facecolor=colour, edgecolor="black", linewidth=0.8)
        axes.add_patch(patch)
        patch.set_clip_path(window)
    colour = PASS if rule.passed else FAIL
    axes.plot(
        *middle, marker="o", markersize=16, markerfacecolor="none", markeredgecolor=colour, markeredgewidth=2
    )
    name = rule.name + (f", {rule.where}" if rule.where else "")
    numbers = f"{rule.value:.3g} {rule.sense} {rule.limit:.3g} {rule.unit}".strip()
    title = f"{_wrapped(name)}\n{numbers}: {'pass' if rule.passed else 'FAIL'} at x {x:.1f}, z {z:.1f} mm"
    axes.text(
        middle[0], middle[1] + REACH_MM + 0.3, title, fontsize=7, color=colour, ha="center", va="bottom"
    )


def _wrapped(text: str, width: int = 38) -> str:
    words, lines = text.split(), [""]
    for word in words:
        fits = len(lines[-1]) + len(word) < width
        lines = [*lines[:-1], f"{lines[-1]} {word}".strip()] if fits else [*lines, word]
    return "\n".join(lines)
