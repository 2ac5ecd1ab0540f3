"""The finger cut open at its mid-plane: stress in the walls, both chambers with their pressures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.report.look import Picture, save, styled
from tubefoot.report.runs import RunRecord
from tubefoot.report.scale import ColourScale, colour_bar, state_line
from tubefoot.report.sheet import Box, sheet
from tubefoot.report.surface import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PRESSED, SUCKED = "#dfd3ee", "#cfe3f3"
"""Fluid above and below the ambient pressure."""
MARGIN_MM = 1.5


def draw_section(runs: Sequence[tuple[RunRecord, Surface]], directory: Path, scale: ColourScale) -> Picture:
    """The mid-plane cut of the last state of each run, side by side at one scale.

    runs : runs and the surfaces of their last states; directory : where the file goes
    scale : of von Mises stress
    """
    cuts = [(run, surface.cut()) for run, surface in runs]
    with styled():
        canvas, grid = sheet([_box(cut) for _, cut in cuts])
        painted = None
        for axes, (run, cut) in zip(grid, cuts, strict=True):
            painted = draw_cut(axes, run, cut, scale)
            axes.set_xlabel("x [mm]")
        grid[0].set_ylabel("z [mm]")
        colour_bar(canvas, painted, grid, scale)
        png, _ = save(canvas, directory, "section", vector=False)
    caption = (
        "Cut at the mid-plane y = 0 in the last state of each run; dashed: at rest. Chambers with their "
        "gauge pressures, lilac above ambient, blue under suction; the right chamber lies at x > 0."
    )
    return Picture("section", "Cut at the mid-plane", caption, png)


def _box(cut: Surface) -> Box:
    used = np.unique(cut.triangles)
    x, z = np.vstack([cut.rest[used], cut.deformed[used]])[:, [0, 2]].T
    return x.min() - MARGIN_MM, x.max() + MARGIN_MM, z.min() - MARGIN_MM, z.max() + MARGIN_MM


def draw_cut(axes: Axes, run: RunRecord, cut: Surface, scale: ColourScale) -> object:
    """The coloured triangles of a cut, after it was drawn with its chambers and its shape at rest.

    axes : empty; run : whose; cut : of its last state at the mid-plane; scale : of von Mises stress
    """
    from matplotlib.tri import Triangulation

    x, z = cut.deformed[:, 0], cut.deformed[:, 2]
    loops = cut.outlines()
    for loop in loops:
        axes.plot(*_closed(cut.rest, loop), color="#8a8a8a", linewidth=0.6, linestyle=(0, (4, 3)), zorder=1)
    for loop in loops[1:]:
        _fill_chamber(axes, run, cut, loop)
    painted = axes.tripcolor(
        Triangulation(x, z, cut.triangles),
        cut.value(scale.field),
        shading="gouraud",
        zorder=3,
        **scale.keywords,
    )
    for loop in loops:
        axes.plot(*_closed(cut.deformed, loop), color="black", linewidth=0.8, zorder=4)
    axes.set_title(state_line(run), fontsize=8.5)
    axes.grid(False)
    return painted


def _fill_chamber(axes: Axes, run: RunRecord, cut: Surface, loop: NDArray[np.int64]) -> None:
    """Colour a chamber by the sign of its pressure, and write the pressure beside the base."""
    side = "right" if cut.rest[loop, 0].mean() > 0 else "left"
    pressure = run.last[f"pressure_{side}_kpa"]
    colour = PRESSED if pressure > 0 else SUCKED if pressure < 0 else "white"
    axes.fill(*_closed(cut.deformed, loop), color=colour, zorder=2)
    base = cut.rest[cut.rest[:, 2] < cut.rest[:, 2].min() + 1e-6]
    place = (base[:, 0].max() + 0.8 if side == "right" else base[:, 0].min() - 0.8, base[:, 2].min() + 1.6)
    look: dict[str, Any] = {
        "ha": "left" if side == "right" else "right",
        "va": "center",
        "fontsize": 7.5,
        "zorder": 5,
    }
    box = {"facecolor": colour, "edgecolor": "none", "boxstyle": "round,pad=0.25"}
    axes.text(*place, f"{side}\n{pressure:+.1f} kPa".replace("-", "−"), bbox=box, **look)


def _closed(points: NDArray[np.float64], loop: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    ring = np.r_[loop, loop[:1]]
    return points[ring, 0], points[ring, 2]
