"""Solves set against the first of them, at a right pressure that all of them reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.report.merit import SUMMARY
from tubefoot.report.runs import RunRecord

FloatArray = NDArray[np.float64]

COMPARED = tuple(line for line in SUMMARY if line[2] != "pressure_right_kpa")
SMALL = 1e-9
"""A reference under this share of the row's largest value has no meaningful relative difference."""


@dataclass(frozen=True)
class Difference:
    """A row: name, unit, the value of each run, its difference from the first run as a share of that."""

    name: str
    unit: str
    values: Sequence[float | None]
    shares: Sequence[float | None]


def meeting_pressure(runs: Sequence[RunRecord]) -> float | None:
    """The right pressure [kPa] furthest from rest that all reach which go the first run's way.

    runs : solves; None when only one goes that way
    """
    ends = [float(max(run.curve["pressure_right_kpa"], key=abs)) for run in runs]
    alike = [end for end in ends if end * ends[0] > 0] if ends else []
    return min(alike, key=abs) if len(alike) > 1 else None


def difference_lines(runs: Sequence[RunRecord]) -> list[Difference]:
    """The compared quantities at the meeting pressure, each beside its difference from the first run.

    runs : solves; empty where they have no pressure in common
    """
    pressure = meeting_pressure(runs)
    if pressure is None:
        return []
    lines = []
    for name, unit, key in COMPARED:
        values = [value_at(run, key, pressure) for run in runs]
        if all(value is None for value in values):
            continue
        lines.append(Difference(name, unit, values, [_share(value, values) for value in values]))
    return lines


def value_at(run: RunRecord, key: str, pressure_right_kpa: float) -> float | None:
    """A column where the right pressure is first reached, by straight lines between states, or None.

    run : a solve; key : column of its curve; pressure_right_kpa : where to read it
    """
    along = run.curve["pressure_right_kpa"] * np.sign(pressure_right_kpa)
    column = run.curve.get(key)
    if column is None:
        return None
    reached = np.flatnonzero(along >= abs(pressure_right_kpa) * (1 - 1e-9))
    if not reached.size:
        return None
    after = int(reached[0])
    if after == 0:
        value = float(column[0])
    else:
        share = (abs(pressure_right_kpa) - along[after - 1]) / (along[after] - along[after - 1])
        value = float(column[after - 1] + min(share, 1.0) * (column[after] - column[after - 1]))
    return value if np.isfinite(value) else None


def _share(value: float | None, values: Sequence[float | None]) -> float | None:
    reference = values[0]
    largest = max(abs(other) for other in values if other is not None)
    if value is None or reference is None or abs(reference) <= SMALL * largest:
        return None
    return (value - reference) / abs(reference)
