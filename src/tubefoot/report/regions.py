"""Stress by region of the finger, percentiles by volume, several runs side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tubefoot.report.look import COLOURS, MARKERS, Picture, save, styled
from tubefoot.report.runs import RunRecord

SHARES = ("von_mises_p50_kpa", "von_mises_p95_kpa", "von_mises_p99_kpa")
ROW_INCH = 0.36


def draw_regions(runs: Sequence[RunRecord], directory: Path) -> Picture | None:
    """Median to 99th percentile of von Mises stress in each region, last state; None without `regions.csv`.

    runs : solves; directory : where the files go
    """
    from matplotlib import pyplot

    shown = [run for run in runs if run.is_solve and run.region_rows()]
    names = list(dict.fromkeys(str(row["region"]) for run in shown for row in run.region_rows()))
    if not names:
        return None
    with styled():
        size = (6.2, ROW_INCH * len(names) * max(1.0, 0.45 * len(shown)) + 1.1)
        canvas, axes = pyplot.subplots(figsize=size, layout="constrained")
        for number, run in enumerate(shown):
            shift = 0.7 * ((number + 0.5) / len(shown) - 0.5)
            colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
            for row in run.region_rows():
                place = names.index(str(row["region"])) + shift
                low, middle, high = (float(row[share]) for share in SHARES)
                axes.plot([low, high], [place, place], color=colour, linewidth=1.4, zorder=2)
                axes.plot(low, place, "|", color=colour, markersize=7, zorder=3)
                axes.plot(middle, place, marker, color=colour, markerfacecolor="white", zorder=3)
                label = run.name if row["region"] == names[0] else None
                axes.plot(high, place, marker, color=colour, zorder=3, label=label)
        axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("von Mises stress [kPa]")
        if len(shown) > 1:
            canvas.legend(loc="outside lower center", ncols=3, frameon=False)
        else:
            axes.set_title(shown[0].name)
        png, svg = save(canvas, directory, "regions", vector=True)
    caption = (
        "Von Mises stress in each region in the last state, percentiles by volume: bar 50th, open marker "
        "95th, filled marker 99th. Peaks at sharp edges depend on the mesh; percentiles do far less."
    )
    return Picture("regions", "Stress by region", caption, png, svg)
