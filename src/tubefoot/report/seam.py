"""The bond plane as a map: what pulls the two modules of a finger apart, on their undeformed face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tubefoot.report.look import Picture, save, styled
from tubefoot.report.runs import RunRecord
from tubefoot.report.scale import ColourScale, colour_bar, state_line
from tubefoot.report.sheet import Box, sheet
from tubefoot.report.surface import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARGIN_MM = 1.5
ROOM_BELOW_MM = 7.0
"""For the forces of both sides."""


def draw_seam(runs: Sequence[tuple[RunRecord, Surface]], directory: Path) -> Picture | None:
    """S33 on the mid-plane of each run's last state; None where no run has a `seam.csv`.

    runs : runs and the surfaces of their last states, halves y >= 0; directory : where the file goes
    """
    shown = [(run, surface.cut(), run.seam_rows()) for run, surface in runs if run.seam_rows()]
    if not shown:
        return None
    scale = ColourScale.of("s33_kpa", "S33 across the bond [kPa]", [cut for _, cut, _ in shown], signed=True)
    with styled():
        canvas, grid = sheet([_box(cut) for _, cut, _ in shown])
        painted = None
        for axes, (run, cut, rows) in zip(grid, shown, strict=True):
            painted = _draw(axes, cut, scale)
            _write_forces(axes, cut, {str(row["place"]): row for row in rows})
            axes.set_title(state_line(run), fontsize=8.5)
            axes.set_xlabel("x at rest [mm]")
        grid[0].set_ylabel("z at rest [mm]")
        colour_bar(canvas, painted, grid, scale)
        png, _ = save(canvas, directory, "seam", vector=False)
    caption = (
        "Stress across the bonded mid-plane in the last state, drawn on the undeformed face: red pulls the "
        "bond apart, blue presses it together. Below each side, from the reactions of the plane: its opening "
        "force, and the moment of these forces about its outer edge."
    )
    return Picture("seam", "The bonded seam", caption, png)


def _box(cut: Surface) -> Box:
    x, z = cut.rest[np.unique(cut.triangles)][:, [0, 2]].T
    return (
        x.min() - MARGIN_MM,
        x.max() + MARGIN_MM,
        z.min() - MARGIN_MM - ROOM_BELOW_MM,
        z.max() + MARGIN_MM,
    )


def _draw(axes: Axes, cut: Surface, scale: ColourScale) -> object:
    from matplotlib.tri import Triangulation

    x, z = cut.rest[:, 0], cut.rest[:, 2]
    painted = axes.tripcolor(
        Triangulation(x, z, cut.triangles), cut.value(scale.field), shading="gouraud", **scale.keywords
    )
    for loop in cut.outlines():
        ring = np.r_[loop, loop[:1]]
        axes.plot(x[ring], z[ring], color="black", linewidth=0.8)
    axes.grid(False)
    return painted


def _write_forces(axes: Axes, cut: Surface, rows: Mapping[str, Mapping[str, Any]]) -> None:
    """The forces of both sides, below them."""
    x, z = cut.rest[np.unique(cut.triangles)][:, [0, 2]].T
    for hand, place in (("left", x.min()), ("right", x.max())):
        row = rows[hand]
        text = (
            f"{hand}\n{float(row['opening_force_n']):+.2f} N\n{float(row['peeling_moment_n_mm']):+.1f} N mm"
        ).replace("-", "−")
        axes.text(0.55 * place, z.min() - 1.0, text, ha="center", va="top", fontsize=7.5)
