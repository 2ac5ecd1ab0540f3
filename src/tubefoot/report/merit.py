"""The numbers of a solve that a reader compares, and those that say how far to trust it, from its files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.report.runs import RunRecord

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """A row of a table: name, unit, one value a run (None where a run does not have it), a remark."""

    name: str
    unit: str
    values: Sequence[float | str | None]
    remark: str = ""


SUMMARY = (
    ("bend angle", "deg", "bend_deg"),
    ("lower half, theta1", "deg", "theta1_deg"),
    ("upper half, theta2", "deg", "theta2_deg"),
    ("pressure, right chamber", "kPa", "pressure_right_kpa"),
    ("pressure, left chamber", "kPa", "pressure_left_kpa"),
    ("pumped volume", "ml", "pumped_volume_ml"),
    ("tip, x", "mm", "tip_x_mm"),
    ("tip, z", "mm", "tip_z_mm"),
    ("von Mises stress, 99th percentile", "kPa", "von_mises_p99_kpa"),
    ("largest principal stress, 99th percentile", "kPa", "max_principal_p99_kpa"),
    ("strain energy", "mJ", "strain_energy_mj"),
)
COST = (
    ("cells", "", "elements"),
    ("unknowns", "", "unknowns"),
    ("Newton iterations", "", "newton_iterations"),
    ("wall time", "s", "wall_s"),
    ("processor time", "s", "cpu_s"),
    ("peak memory", "MB", "peak_memory_mb"),
)


def summary_lines(runs: Sequence[RunRecord]) -> list[Line]:
    """What the runs ended with, their gain and its linearity, and what they cost.

    runs : solves
    """
    fits = [pressure_angle_fit(run) for run in runs]
    return [
        Line("ended by", "", [_text(run.summary.get("end_reason")) for run in runs]),
        *(Line(name, unit, [_finite(run.last.get(key)) for run in runs]) for name, unit, key in SUMMARY),
        Line("gain, angle over right pressure", "deg/kPa", [fit.slope if fit else None for fit in fits]),
        Line("R² of that line", "", [fit.r_squared if fit else None for fit in fits]),
        Line("largest deviation from it", "deg", [fit.deviation if fit else None for fit in fits]),
        *(Line(name, unit, [_finite(run.summary.get(key)) for run in runs]) for name, unit, key in COST),
    ]


def check_lines(runs: Sequence[RunRecord]) -> list[Line]:
    """Checks that need nothing but the tables, each with what it should be.

    runs : solves
    """
    return [
        Line(
            "converged",
            "",
            ["yes" if run.summary.get("converged") else "no" for run in runs],
            "States that did not converge are never written; no means that the path broke off early.",
        ),
        Line(
            "work of both fluids against strain energy",
            "%",
            [energy_error(run) for run in runs],
            "Difference over the path, as recorded: states are joined by a smooth curve. Under 0.5 expected.",
        ),
        Line(
            "volume exchange, difference between chambers",
            "%",
            [exchange_error(run) for run in runs],
            "Largest |ΔV right + ΔV left| over the largest |ΔV right|. 0 for a closed loop, more with "
            "trapped air or chambers that are driven apart.",
        ),
        Line(
            "smallest volume ratio det F",
            "",
            [_least(run, "min_jacobian") for run in runs],
            "At a quadrature point, over all states. Must be positive; far from 1 only at sharp edges.",
        ),
        Line(
            "smallest gap between facing walls",
            "mm",
            [_least(run, "contact_gap_min_mm") for run in runs],
            "Over all states; at 0 walls touch, which ends a path solved without contact.",
        ),
        Line(
            "smallest scaled Jacobian of the mesh",
            "",
            [_finite(run.summary.get("scaled_jacobian_min")) for run in runs],
            "1 is a right-angled cell, 0 a collapsed one.",
        ),
    ]


@dataclass(frozen=True)
class Fit:
    """A straight line through the pressure-angle curve: slope [deg/kPa], R squared, deviation [deg]."""

    slope: float
    r_squared: float
    deviation: float


def pressure_angle_fit(run: RunRecord) -> Fit | None:
    """The least-squares line of bend angle over right pressure; None with fewer than three states.

    run : a solve
    """
    pressure, angle = run.curve["pressure_right_kpa"], run.curve["bend_deg"]
    if len(pressure) < 3 or np.ptp(pressure) == 0.0:
        return None
    slope, offset = np.polyfit(pressure, angle, 1)
    left_over = angle - slope * pressure - offset
    spread = float(((angle - angle.mean()) ** 2).sum())
    r_squared = 1.0 - float((left_over**2).sum()) / spread if spread > 0 else math.nan
    return Fit(float(slope), r_squared, float(np.abs(left_over).max()))


def energy_error(run: RunRecord) -> float | None:
    """Work of both fluids along the path against the strain energy at its end [%].

    run : a solve; None when its curve lacks the volumes, has under three states, or stores no energy
    """
    keys = ("volume_change_right_ml", "volume_change_left_ml", "strain_energy_mj")
    if not set(keys) <= run.curve.keys() or len(run.curve["step"]) < 3:
        return None
    along = run.curve["pumped_volume_ml"]
    # 1 kPa ml = 1 mJ.
    work = sum(
        _integral(run.curve[f"pressure_{hand}_kpa"], run.curve[f"volume_change_{hand}_ml"], along)
        for hand in ("right", "left")
    )
    stored = float(run.curve["strain_energy_mj"][-1] - run.curve["strain_energy_mj"][0])
    return 100.0 * abs(work - stored) / abs(stored) if stored else None


def exchange_error(run: RunRecord) -> float | None:
    """By how much the chambers' volume changes differ from being opposite [%].

    run : a solve; None when its curve lacks the volumes or they do not change
    """
    if not {"volume_change_right_ml", "volume_change_left_ml"} <= run.curve.keys():
        return None
    right, left = run.curve["volume_change_right_ml"], run.curve["volume_change_left_ml"]
    largest = float(np.abs(right).max())
    return 100.0 * float(np.abs(right + left).max()) / largest if largest else None


def _integral(pressure: FloatArray, volume: FloatArray, along: FloatArray) -> float:
    """The integral of p dV, by splines over the path where it never turns back, else by trapezoids."""
    from scipy.interpolate import CubicSpline

    forward = along if along[-1] > along[0] else -along
    if (np.diff(forward) > 0).all():
        work = CubicSpline(forward, pressure * CubicSpline(forward, volume)(forward, 1))
        return float(work.integrate(forward[0], forward[-1]))
    return float(np.trapezoid(pressure, volume))


def _least(run: RunRecord, column: str) -> float | None:
    values = run.curve.get(column)
    return None if values is None or np.isnan(values).all() else float(np.nanmin(values))


def _finite(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _text(value: object) -> str | None:
    return None if value is None else str(value)
