"""Measured over predicted, like the paper's Fig. 4B, drawn from the tables of a `validate` run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, MARKERS, End, Picture, label_ends, save, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]
Rows = Sequence[Mapping[str, Any]]

CAPTION = (
    "Settled states: filled while loading, hollow while unloading, the left side mirrored. Lines with bands: "
    "mean loading stroke and its 95 % confidence (bootstrap of strokes); dashed: prediction by finite "
    "elements. Below: difference of the two."
)
QUANTITIES = (("other_kpa", "pressure of the other chamber [kPa]"), ("angle_deg", "bend angle [deg]"))


def draw_validation(directory: Path) -> Picture | None:
    """The figure of a run, `validation.png` and `.svg` in its directory; None where it has no tables.

    directory : of a `validate` run
    """
    if not (directory / "bands.csv").exists() or not (directory / "states.csv").exists():
        return None
    states, bands = read_table(directory / "states.csv"), read_table(directory / "bands.csv")
    names = list(dict.fromkeys(str(row["recording"]) for row in bands))
    from matplotlib import pyplot

    with styled():
        canvas, grid = pyplot.subplots(2, 2, figsize=(9.6, 6.8), layout="constrained", sharex=True)
        for column, (quantity, label) in enumerate(QUANTITIES):
            _draw_overlay(grid[0, column], quantity, names, states, bands)
            _draw_offsets(grid[1, column], quantity, names, bands)
            grid[0, column].set_ylabel(label)
            grid[1, column].set_ylabel(f"measured less predicted\n{label[label.index('[') :]}")
            grid[1, column].set_xlabel("pressure of the pressed chamber since rest [kPa]")
        grid[0, 0].set_title("Pressure coupling")
        grid[0, 1].set_title("Pressure and angle")
        png, svg = save(canvas, directory, "validation", vector=True)
    return Picture("validation", "Simulation against experiment", CAPTION, png, svg)


def _of(rows: Rows, name: str, *columns: str) -> list[FloatArray]:
    mine = [row for row in rows if str(row["recording"]) == name]
    return [
        np.array([row[column] if isinstance(row[column], float) else np.nan for row in mine])
        for column in columns
    ]


def _draw_overlay(axes: Axes, quantity: str, names: Sequence[str], states: Rows, bands: Rows) -> None:
    ends = []
    for number, name in enumerate(names):
        colour = COLOURS[number % len(COLOURS)]
        _draw_states(axes, quantity, [row for row in states if str(row["recording"]) == name], number)
        pressed, mean, low, high, predicted = _of(
            bands,
            name,
            "pressed_kpa",
            quantity,
            f"{quantity}_low",
            f"{quantity}_high",
            f"predicted_{quantity}",
        )
        axes.fill_between(pressed, low, high, color=colour, alpha=0.25, linewidth=0)
        axes.plot(pressed, mean, color=colour)
        axes.plot(pressed, predicted, color=colour, linestyle="--")
        ends += [
            End.of(pressed, mean, name, colour),
            End.of(pressed, predicted, f"{name}, predicted", colour),
        ]
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
    label_ends(axes, ends)


def _draw_states(axes: Axes, quantity: str, rows: Rows, number: int) -> None:
    colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
    for branch, face in (("loading", colour), ("unloading", "white")):
        x, y = [], []
        for row in rows:
            if row["branch"] != branch or row["outlier"] or not row["side"]:
                continue
            right = row["side"] > 0
            sides = ("pressure_right_kpa", "pressure_left_kpa")
            x.append(row[sides[0] if right else sides[1]])
            other = row[sides[1] if right else sides[0]]
            bend = row["bend_deg"] if isinstance(row["bend_deg"], float) else np.nan
            y.append(other if quantity == "other_kpa" else row["side"] * bend)
        axes.plot(
            x, y, marker, color=colour, markerfacecolor=face, markersize=3.2, markeredgewidth=0.7, alpha=0.7
        )


def _draw_offsets(axes: Axes, quantity: str, names: Sequence[str], bands: Rows) -> None:
    for number, name in enumerate(names):
        colour = COLOURS[number % len(COLOURS)]
        pressed, mean, low, high, predicted = _of(
            bands,
            name,
            "pressed_kpa",
            quantity,
            f"{quantity}_low",
            f"{quantity}_high",
            f"predicted_{quantity}",
        )
        axes.fill_between(pressed, low - predicted, high - predicted, color=colour, alpha=0.25, linewidth=0)
        axes.plot(pressed, mean - predicted, color=colour, label=name)
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
