"""A screening's comparisons like the paper's Fig. 2: stress panels above, the four curves below; one page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.records import read_table
from tubefoot.report.claims import load_claims
from tubefoot.report.curves import RELATIONS, draw_relation
from tubefoot.report.look import Picture, save, styled
from tubefoot.report.page import write_page
from tubefoot.report.pictures import Gallery
from tubefoot.report.runs import RunRecord, load_run
from tubefoot.report.scale import ColourScale, colour_bar
from tubefoot.report.section import draw_cut
from tubefoot.report.solids import VON_MISES
from tubefoot.report.surface import Surface, read_surface

MARGIN_MM = 1.5
WIDTH_INCH, PANEL_INCH, CURVE_INCH = 13.2, 3.6, 3.1
CAPTION = (
    "Above: von Mises stress at the mid-plane in the last state, all at one scale of colour and of length, "
    "dashed at rest. Below: pressure coupling, angle over pressure, pressures and angle over pumped volume."
)


def draw_comparisons(directory: Path) -> list[Path]:
    """The files of a screening's report: a picture of each comparison, and `report.html`.

    directory : of the screening; comparisons whose designs were not solved are left out
    """
    compared = _comparisons(directory)
    gallery = Gallery([_draw(name, runs, directory / "figures") for name, runs in compared.items()])
    shown = {run.directory: run for runs in compared.values() for run in runs}
    claims = load_claims([directory], gallery.keys)
    if not shown:
        return []
    title = f"Screening {directory.resolve().name}"
    page = write_page(directory / "report.html", title, list(shown.values()), gallery, claims)
    return [*(picture.png for picture in gallery.pictures), page]


def _comparisons(directory: Path) -> dict[str, list[RunRecord]]:
    """The solved runs of each comparison, named as there."""
    found: dict[str, list[RunRecord]] = {}
    for row in read_table(directory / "candidates.csv"):
        if row["comparison"] and row["status"] == "solved" and row["source"] == "full":
            run = load_run(directory / str(row["folder"]))
            found.setdefault(str(row["comparison"]), []).append(replace(run, name=str(row["name"])))
    return found


def _draw(name: str, runs: Sequence[RunRecord], directory: Path) -> Picture:
    """The figure of one comparison."""
    from matplotlib import pyplot

    cuts = [(run, read_surface(run.last_fields).cut()) for run in runs if run.last_fields is not None]
    with styled():
        canvas = pyplot.figure(
            figsize=(WIDTH_INCH, (PANEL_INCH if cuts else 0) + CURVE_INCH), layout="constrained"
        )
        heights = [PANEL_INCH, CURVE_INCH]
        rows: Any = canvas.subfigures(2, 1, height_ratios=heights) if cuts else [None, canvas]
        if cuts:
            _panels(rows[0], cuts)
        for axes, relation in zip(rows[1].subplots(1, len(RELATIONS)), RELATIONS, strict=True):
            draw_relation(axes, relation, runs)
            axes.set_title(relation.title)
        png, _ = save(canvas, directory, name, vector=False)
    return Picture(name, f"Comparison: {name}", CAPTION, png)


def _panels(row: Any, cuts: Sequence[tuple[RunRecord, Surface]]) -> None:
    """Cuts of all candidates at one scale."""
    boxes = [_extent(cut) for _, cut in cuts]
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    grid = row.subplots(1, len(cuts), squeeze=False)[0]
    scale = ColourScale.of("von_mises_kpa", VON_MISES, [cut for _, cut in cuts], signed=False)
    painted = None
    for axes, (run, cut) in zip(grid, cuts, strict=True):
        painted = draw_cut(axes, run, cut, scale)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        axes.set_xlabel("x [mm]")
    grid[0].set_ylabel("z [mm]")
    colour_bar(row, painted, list(grid), scale)


def _extent(cut: Surface) -> tuple[Any, Any]:
    """Lowest and highest x and z that a cut needs, at rest and bent [mm]."""
    used = np.unique(cut.triangles)
    places = np.vstack([cut.rest[used], cut.deformed[used]])[:, [0, 2]]
    return places.min(axis=0) - MARGIN_MM, places.max(axis=0) + MARGIN_MM
