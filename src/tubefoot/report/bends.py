"""Closed-loop runs side by side: measured angles and pump over bench time, in one figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tubefoot.records import read_table
from tubefoot.report.bending import column, on_one_axis
from tubefoot.report.look import End, Picture, label_ends, line_of, save, styled
from tubefoot.report.runs import RunRecord

CAPTION = (
    "Measured bend angle of each run over bench time, its target dotted; below, direction times duty "
    "of the pump. Motions of a run follow each other."
)


def draw_bends(runs: Sequence[RunRecord], directory: Path) -> Picture | None:
    """The figure `bends`; None where fewer than two runs have a table of angles.

    runs : of any verb; directory : where the files go
    """
    recorded = [run for run in runs if (run.directory / "bend.csv").exists()]
    tables = [(run, on_one_axis(read_table(run.directory / "bend.csv"))) for run in recorded]
    shown = [(run, rows) for run, rows in tables if np.isfinite(column(rows, "bend_deg")).any()]
    if len(shown) < 2:
        return None
    from matplotlib import pyplot

    with styled():
        canvas, (angles, pumps) = pyplot.subplots(
            2, 1, figsize=(6.4, 5.0), sharex=True, layout="constrained", height_ratios=(3, 1.2)
        )
        ends = []
        for number, (run, rows) in enumerate(shown):
            look = line_of(number, len(shown)) | {"marker": ""}
            at, angle = column(rows, "at"), column(rows, "bend_deg")
            angles.plot(at, column(rows, "target_deg"), ":", color=look["color"], linewidth=1.0)
            angles.plot(at, angle, **look)
            pumps.step(at, column(rows, "direction") * column(rows, "duty"), where="post", **look)
            seen = np.flatnonzero(np.isfinite(angle))
            ends.append(End.of(at[seen], angle[seen], run.name, look["color"]))
        angles.set_ylabel("bend angle [deg]")
        pumps.set_ylabel("pump duty\n(forward up)")
        pumps.set_ylim(-1.05, 1.05)
        pumps.set_xlabel("bench time [s]")
        label_ends(angles, ends)
        png, svg = save(canvas, directory, "bends", vector=True)
    return Picture("bends", "Closed loops side by side", CAPTION, png, svg)
