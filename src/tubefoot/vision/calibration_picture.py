"""The calibration picture: where the corners fell and how far each is from its prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tubefoot.vision.views import LensCalibration


def draw_calibration(found: LensCalibration, size: tuple[int, int], path: Path) -> Path:
    """The path, after drawing coverage and residuals there.

    found : the calibration
    size : picture width and height [px]
    path : PNG or SVG file
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    coverage, scatter = figure.subplots(1, 2, width_ratios=[1.6, 1])
    everything = np.vstack([view.pixels for view in found.views])
    residuals = np.vstack(found.residuals)
    length = 0.05 * size[0] / max(float(np.abs(residuals).max()), 1e-9)
    coverage.plot(*everything.T, ".", color="#99aabb", markersize=2)
    arrows = {"angles": "xy", "scale_units": "xy", "scale": 1 / length, "width": 0.0015}
    coverage.quiver(*everything.T, *residuals.T, color="#aa3322", **arrows)
    coverage.set(xlim=(0, size[0]), ylim=(size[1], 0), aspect="equal", xlabel="x [px]", ylabel="y [px]")
    coverage.set_title(f"{len(found.views)} views, coverage {found.coverage:.0%}; residuals x {length:.0f}")
    scatter.plot(*residuals.T, ".", color="#aa3322", markersize=2)
    scatter.set(aspect="equal", xlabel="residual x [px]", ylabel="residual y [px]")
    scatter.set_title(f"rms {found.residual_px:.3f} px")
    scatter.grid(alpha=0.3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    return path
