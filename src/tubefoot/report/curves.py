"""Angle, pressures and volumes of a cyclic actuation, several runs in one figure (the paper's Fig. 2B)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tubefoot.report.look import End, Picture, label_ends, line_of, save, styled
from tubefoot.report.runs import RunRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN_NAMES = {
    "pressure_right_kpa": "pressure in the right chamber [kPa]",
    "pressure_left_kpa": "pressure in the left chamber [kPa]",
    "pumped_volume_ml": "pumped volume [ml]",
    "bend_deg": "bend angle [deg]",
}


@dataclass(frozen=True)
class Relation:
    """One figure: a column over another.

    key : anchor and file name; title, caption : for the page
    x, y : columns of `curve.csv`; y_left : column of the left chamber drawn dashed beside y
    """

    key: str
    title: str
    caption: str
    x: str
    y: str
    y_left: str | None = None
    y_name: str | None = None


RELATIONS = (
    Relation(
        "pressure-pressure",
        "Pressure coupling",
        "What the pump takes from the left chamber it puts into the right one: the pressures move inversely.",
        "pressure_right_kpa",
        "pressure_left_kpa",
    ),
    Relation(
        "pressure-angle",
        "Pressure and angle",
        "Bend angle of the tip over the gauge pressure of the right chamber; positive towards the left.",
        "pressure_right_kpa",
        "bend_deg",
    ),
    Relation(
        "pressure-volume",
        "Volume and pressure",
        "Gauge pressure over pumped volume: right chamber solid, left chamber dashed.",
        "pumped_volume_ml",
        "pressure_right_kpa",
        "pressure_left_kpa",
        "chamber pressure [kPa]\n(solid: right, dashed: left)",
    ),
    Relation(
        "volume-angle",
        "Volume and angle",
        "Bend angle of the tip over pumped volume of the whole finger.",
        "pumped_volume_ml",
        "bend_deg",
    ),
)


def draw_curves(runs: Sequence[RunRecord], directory: Path, say: Callable[[str], None]) -> list[Picture]:
    """The four relations, each as SVG and PNG, and all of them on one sheet `curves.png` and `curves.svg`.

    runs : those without a curve are left out; directory : where the files go; say : told of each step
    """
    drawn = [run for run in runs if run.is_solve]
    if not drawn:
        return []
    say("curves")
    from matplotlib import pyplot

    pictures = []
    with styled():
        for relation in RELATIONS:
            canvas, axes = pyplot.subplots(figsize=(4.6, 3.3), layout="constrained")
            draw_relation(axes, relation, drawn)
            png, svg = save(canvas, directory, relation.key, vector=True)
            pictures.append(Picture(relation.key, relation.title, relation.caption, png, svg))
        canvas, grid = pyplot.subplots(2, 2, figsize=(9.6, 6.8), layout="constrained")
        for axes, relation in zip(grid.flat, RELATIONS, strict=True):
            draw_relation(axes, relation, drawn)
            axes.set_title(relation.title)
        save(canvas, directory, "curves", vector=True)
    return pictures


def draw_relation(axes: Axes, relation: Relation, runs: Sequence[RunRecord]) -> None:
    """One relation of several runs, their names beside their lines.

    axes : empty; relation : what over what; runs : solves
    """
    ends = []
    for number, run in enumerate(runs):
        look = line_of(number, len(runs))
        x, y = run.curve[relation.x], run.curve[relation.y]
        axes.plot(x, y, **look)
        ends.append(End.of(x, y, run.name, look["color"]))
        if relation.y_left:
            axes.plot(x, run.curve[relation.y_left], linestyle="--", markerfacecolor="white", **look)
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
    axes.set_xlabel(COLUMN_NAMES[relation.x])
    axes.set_ylabel(relation.y_name or COLUMN_NAMES[relation.y])
    label_ends(axes, ends)
