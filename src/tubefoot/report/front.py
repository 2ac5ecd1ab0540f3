"""A Pareto front: gain against stress at a fixed angle, footprint by colour, with error bars."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, save, styled

STRESS, GAIN, FOOTPRINT = "von_mises_p99_at_angle_kpa", "gain_deg_per_kpa", "footprint_cm3"


def draw_front(directory: Path) -> Path:
    """The file of the figure `figures/front.png`.

    directory : of a search, with front.csv and evaluations.csv
    """
    from matplotlib import pyplot

    front = read_table(directory / "front.csv")
    rows = read_table(directory / "evaluations.csv")
    others = [row for row in rows if isinstance(row[GAIN], float) and isinstance(row[STRESS], float)]
    with styled():
        canvas, axes = pyplot.subplots(figsize=(6.6, 4.4), layout="constrained")
        axes.plot(
            _column(others, STRESS), _column(others, GAIN), ".", color="#b5b5b5", markersize=3, zorder=1
        )
        x, y = _column(front, STRESS), _column(front, GAIN)
        axes.errorbar(
            x,
            y,
            xerr=x * _column(front, "stress_sd_percent") / 100,
            yerr=y * _column(front, "gain_sd_percent") / 100,
            fmt="none",
            ecolor="#8a8a8a",
            elinewidth=0.8,
            zorder=2,
        )
        confirmed = np.array([row["confirmed"] == "true" for row in front])
        painted = axes.scatter(x, y, s=28, c=_column(front, FOOTPRINT), cmap="viridis", zorder=3)
        axes.scatter(x[confirmed], y[confirmed], s=80, facecolor="none", edgecolor=COLOURS[1], zorder=4)
        axes.set_xlabel("99th-percentile von Mises stress at the fixed angle [kPa]")
        axes.set_ylabel("gain [deg/kPa]")
        axes.set_title("Pareto front (ringed: solved in full; grey: other designs; bars: one sd)")
        canvas.colorbar(painted, ax=axes, label="footprint [cm³]")
        png, _ = save(canvas, directory / "figures", "front", vector=True)
    return png


def _column(rows: list[dict[str, Any]], name: str) -> NDArray[np.float64]:
    return np.array([float(row[name]) for row in rows])
