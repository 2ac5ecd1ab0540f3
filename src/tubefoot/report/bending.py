"""The course of a closed-loop bending run, from its `bend.csv`: angle, target and band, pump, pressures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.config import read_toml
from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, Picture, save, styled
from tubefoot.report.runs import read_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]


def draw_bending(directory: Path) -> Picture | None:
    """The figure of a run, `bend.png` and `bend.svg` in its directory; None where no frame was seen.

    directory : of a `bend` run; motions follow each other on one time axis
    """
    rows = on_one_axis(read_table(directory / "bend.csv"))
    if not any(isinstance(row["bend_deg"], float) for row in rows):
        return None
    from matplotlib import pyplot

    with styled():
        canvas, panels = pyplot.subplots(
            3, 1, figsize=(6.4, 6.0), sharex=True, layout="constrained", height_ratios=(3, 1, 1.6)
        )
        _draw_angle(panels[0], rows, _band(directory))
        _draw_pump(panels[1], rows)
        _draw_pressures(panels[2], rows)
        panels[2].set_xlabel("bench time [s]")
        png, svg = save(canvas, directory, "bend", vector=True)
    summary = read_json(directory / "summary.json") or {}
    caption = (
        f"Controller {summary.get('controller', '')}: measured angle, target and tolerance band; each run of "
        "the pump, forward up; change of the branch pressures since neutral."
    )
    return Picture("bend", "Closed-loop bending", caption, png, svg)


def on_one_axis(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows with `at`, their time since the first motion began [s].

    rows : of `bend.csv`
    """
    start, last, found = 0.0, 0.0, []
    part = rows[0]["part"] if rows else ""
    for row in rows:
        if row["part"] != part:
            part, start = row["part"], last
        last = start + row["time_s"]
        found.append({**row, "at": last})
    return found


def _band(directory: Path) -> float:
    """Half the tolerance band [deg], 0 for a tracked trajectory."""
    settings = (
        read_toml(directory / "run.toml").get("settings", {}) if (directory / "run.toml").exists() else {}
    )
    if settings.get("controller") == "tracking":
        return 0.0
    return float(settings.get("bend", {}).get("goal", {}).get("band_deg", 1.0))


def column(rows: list[dict[str, Any]], name: str) -> FloatArray:
    """(n,) numbers of a column, nan where a cell holds none.

    rows : of a table; name : of the column
    """
    return np.array([row[name] if isinstance(row[name], float) else np.nan for row in rows])


def _draw_angle(axes: Axes, rows: list[dict[str, Any]], band: float) -> None:
    at, target = column(rows, "at"), column(rows, "target_deg")
    axes.fill_between(at, target - band, target + band, color="#dddddd", linewidth=0)
    axes.plot(at, target, color="#777777", linewidth=1.0, label="target")
    axes.plot(at, column(rows, "bend_deg"), color=COLOURS[0], label="measured")
    pulses = column(rows, "pulses")
    begun = np.flatnonzero(np.diff(pulses, prepend=0.0) > 0)
    if len(begun) <= 60:
        axes.plot(at[begun], column(rows, "bend_deg")[begun], "o", color=COLOURS[1], label="pulse begins")
    axes.set_ylabel("bend angle [deg]")
    axes.legend(frameon=False, loc="best")


def _draw_pump(axes: Axes, rows: list[dict[str, Any]]) -> None:
    drive = column(rows, "direction") * column(rows, "duty")
    axes.fill_between(column(rows, "at"), drive, step="pre", color=COLOURS[1], linewidth=0)
    axes.set_ylim(-1.05, 1.05)
    axes.set_ylabel("pump duty\n(forward up)")


def _draw_pressures(axes: Axes, rows: list[dict[str, Any]]) -> None:
    at = column(rows, "at")
    axes.plot(at, column(rows, "pressure_right_kpa"), color=COLOURS[0], label="right")
    axes.plot(at, column(rows, "pressure_left_kpa"), color=COLOURS[0], linestyle="--", label="left")
    axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
    axes.set_ylabel("pressure [kPa]")
    axes.legend(frameon=False, loc="best")
