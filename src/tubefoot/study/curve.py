"""A solved finger's curve and stress tables, read from its run directory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.records import read_table

FloatArray = NDArray[np.float64]

REFERENCE_KPA = 35.0
"""Pressure of the right chamber at which the paper compares designs."""


class Curve:
    """The curve of a solved finger, read from its run directory."""

    def __init__(self, directory: Path | str):
        """Read curve.csv; the stress tables are read when they are asked for.

        directory : of a solve
        """
        self.directory = Path(directory)
        self._rows = read_table(self.directory / "curve.csv")

    def column(self, name: str) -> FloatArray:
        """One column, (n_states,).

        name : header in curve.csv
        """
        return np.array([float(row[name]) for row in self._rows])

    def up_to_reference(self, *names: str) -> tuple[FloatArray, ...]:
        """Columns over 0 to 35 kPa in the right chamber.

        names : headers in curve.csv
        """
        keep = self.column("pressure_right_kpa") <= REFERENCE_KPA + 1e-6
        return tuple(self.column(name)[keep] for name in names)

    def at_reference(self, name: str) -> float:
        """A column's value at 35 kPa in the right chamber, NaN where the curve ends before.

        name : header in curve.csv
        """
        pressure = self.column("pressure_right_kpa")
        if pressure.max() < REFERENCE_KPA - 1e-3:
            return float("nan")
        return float(np.interp(REFERENCE_KPA, pressure, self.column(name)))

    def unit_stress(self) -> FloatArray:
        """99th-percentile von Mises stress of each unit at the last state, (n_units,) [kPa]."""
        rows = self._table("units")
        last = max(float(row["step"]) for row in rows)
        return np.array([float(row["von_mises_p99_kpa"]) for row in rows if row["step"] == last])

    def hotspots(self, stress: str) -> dict[str, dict[str, Any]]:
        """Rows of hotspots.csv at 35 kPa in the right chamber by zone; none where no state lies there.

        stress : von_mises, s13, s23 or s33
        """
        return {row["zone"]: row for row in self._rows_at_reference("hotspots") if row["stress"] == stress}

    def seam(self) -> dict[str, dict[str, Any]]:
        """Rows of seam.csv at 35 kPa in the right chamber by place; none where no state lies there."""
        return {row["place"]: row for row in self._rows_at_reference("seam")}

    def _rows_at_reference(self, name: str) -> list[dict[str, Any]]:
        pressure = self.column("pressure_right_kpa")
        nearest = int(np.argmin(np.abs(pressure - REFERENCE_KPA)))
        if abs(pressure[nearest] - REFERENCE_KPA) > 1e-3 * REFERENCE_KPA:
            return []
        step = self._rows[nearest]["step"]
        return [row for row in self._table(name) if row["step"] == step]

    def _table(self, name: str) -> list[dict[str, Any]]:
        path = self.directory / f"{name}.csv"
        return read_table(path) if path.exists() else []


def line_fit(x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Slope, R squared and largest deviation of the least-squares line.

    x, y : (n,)
    """
    slope, intercept = np.polyfit(x, y, 1)
    residual = y - (slope * x + intercept)
    spread = ((y - y.mean()) ** 2).sum()
    r_squared = 1.0 - (residual**2).sum() / spread if spread > 0 else float("nan")
    return float(slope), float(r_squared), float(np.abs(residual).max())
