"""Pressures and angle of solves in time: ramp, hold and recovery of a viscoelastic finger."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tubefoot.report.look import End, Picture, label_ends, line_of, save, styled
from tubefoot.report.runs import RunRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_time_courses(runs: Sequence[RunRecord], directory: Path) -> Picture | None:
    """Both pressures and the bend angle over time; None where no run was one in time.

    runs : solves; directory : where the files go
    """
    timed = [run for run in runs if "time_s" in run.curve]
    if not timed:
        return None
    from matplotlib import pyplot

    with styled():
        canvas, (above, below) = pyplot.subplots(2, 1, figsize=(5.6, 5.6), sharex=True, layout="constrained")
        pressures, angles = [], []
        for number, run in enumerate(timed):
            look = line_of(number, len(timed))
            time, right = run.curve["time_s"], run.curve["pressure_right_kpa"]
            above.plot(time, right, **look)
            above.plot(time, run.curve["pressure_left_kpa"], linestyle="--", markerfacecolor="white", **look)
            below.plot(time, run.curve["bend_deg"], **look)
            pressures.append(End.of(time, right, run.name, look["color"]))
            angles.append(End.of(time, run.curve["bend_deg"], run.name, look["color"]))
        _scale_time(below, timed)
        above.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
        above.set_ylabel("chamber pressure [kPa]\n(solid: right, dashed: left)")
        below.set_ylabel("bend angle [deg]")
        below.set_xlabel("time [s]")
        label_ends(above, pressures)
        label_ends(below, angles)
        png, svg = save(canvas, directory, "time-course", vector=True)
    caption = (
        "Gauge pressures and bend angle over time while the drive ramps up, is held and, where it does, runs "
        "back. Time is linear up to the first recorded state and logarithmic beyond."
    )
    return Picture("time-course", "Ramp, hold and recovery", caption, png, svg)


def _scale_time(axes: Axes, runs: Sequence[RunRecord]) -> None:
    """Logarithmic beyond the shortest first step: relaxation spans decades."""
    first = min((float(run.curve["time_s"][1]) for run in runs if len(run.curve["time_s"]) > 1), default=1.0)
    axes.set_xscale("symlog", linthresh=first)
    axes.set_xlim(left=0.0)
