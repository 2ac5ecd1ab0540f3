"""What changes from stroke to stroke: hysteresis of each loop, drift from cycle to cycle, repeatability.

A loop is a loading stroke with the unloading that follows it. Its area is taken over the pressures that both
have been at; a wall that creeps gives loops like friction does, wide ones where a hold lies between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tubefoot.units import DEG, KPA
from tubefoot.validation.recording import FloatArray
from tubefoot.validation.settled import SettledState

LEVELS = 12
"""Pressures at which strokes are held against each other."""
LEAST_STATES = 3


@dataclass(frozen=True)
class Loop:
    """One loop of one side.

    cycle, side : which; states : of both strokes
    angle_area : between unloading and loading, angle over pressed pressure [deg kPa]
    angle_width : the same over the range of pressures [deg]; share : over the range of angles too
    pressure_area, pressure_width : of the other pressure over the pressed one [kPa^2], [kPa]
    rest_angle : angle where the pressures are equal again [deg], nan where the finger did not come back
    """

    cycle: int
    side: int
    states: int
    angle_area: float
    angle_width: float
    share: float
    pressure_area: float
    pressure_width: float
    rest_angle: float

    def row(self) -> dict[str, float | int]:
        """One row of loops.csv."""
        return {
            "cycle": self.cycle,
            "side": self.side,
            "states": self.states,
            "angle_area_deg_kpa": self.angle_area,
            "angle_width_deg": self.angle_width,
            "angle_width_share": self.share,
            "pressure_area_kpa2": self.pressure_area,
            "pressure_width_kpa": self.pressure_width,
            "rest_angle_deg": self.rest_angle,
        }


def loops_of(states: Sequence[SettledState]) -> list[Loop]:
    """The loops of a recording in their order; those with fewer than three states a stroke are left out.

    states : settled
    """
    found = []
    for cycle, side in dict.fromkeys((s.cycle, s.side) for s in states if s.side and _good(s)):
        mine = [s for s in states if s.cycle == cycle and s.side == side and _good(s)]
        strokes = [[s for s in mine if s.branch == branch] for branch in ("loading", "unloading")]
        if min(len(stroke) for stroke in strokes) >= LEAST_STATES:
            found.append(_loop(cycle, side, strokes[0], strokes[1]))
    return found


def repeatability(states: Sequence[SettledState]) -> dict[str, float]:
    """How well loading strokes of the same side repeat, and how they drift.

    states : settled

    `angle_scatter_deg`, `other_scatter_kpa`: standard deviation between strokes at the same pressed
    pressure, rms over pressures and sides; `angle_drift_deg_per_cycle`: mean slope over the cycles. nan where
    there are too few strokes.
    """
    figures = {"angle_scatter_deg": np.nan, "other_scatter_kpa": np.nan, "angle_drift_deg_per_cycle": np.nan}
    variances: dict[str, list[float]] = {"angle": [], "other": []}
    drifts: list[float] = []
    for side in (1, -1):
        strokes = _strokes(states, side)
        if len(strokes) < 2:
            continue
        top = min(pressed.max() for pressed, _, _ in strokes.values())
        at = np.linspace(0.25 * top, top, LEVELS)
        angle = np.array([np.interp(at, p, a) for p, a, _ in strokes.values()]) / DEG
        other = np.array([np.interp(at, p, o) for p, _, o in strokes.values()]) / KPA
        variances["angle"].append(float(angle.var(axis=0, ddof=1).mean()))
        variances["other"].append(float(other.var(axis=0, ddof=1).mean()))
        drifts.append(float(np.polyfit(list(strokes), angle[:, LEVELS // 2], 1)[0]))
    if drifts:
        figures = {
            "angle_scatter_deg": float(np.sqrt(np.mean(variances["angle"]))),
            "other_scatter_kpa": float(np.sqrt(np.mean(variances["other"]))),
            "angle_drift_deg_per_cycle": float(np.mean(drifts)),
        }
    return figures


def _good(state: SettledState) -> bool:
    return not state.outlier and bool(np.isfinite(state.angle))


def _strokes(
    states: Sequence[SettledState], side: int
) -> dict[int, tuple[FloatArray, FloatArray, FloatArray]]:
    """Pressed pressure, angle and other pressure of the loading strokes of a side, by cycle, rising."""
    found = {}
    for cycle in dict.fromkeys(s.cycle for s in states):
        mine = [s for s in states if (s.cycle, s.side, s.branch) == (cycle, side, "loading") and _good(s)]
        if len(mine) >= LEAST_STATES:
            found[cycle] = _path(mine, side)
    return found


def _path(states: Sequence[SettledState], side: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Pressed pressure, angle, other pressure in order of the pressed one."""
    pressed = np.array([s.right if side > 0 else s.left for s in states])
    other = np.array([s.left if side > 0 else s.right for s in states])
    angle = np.array([side * s.angle for s in states])
    order = np.argsort(pressed)
    return pressed[order], angle[order], other[order]


def _loop(cycle: int, side: int, loading: Sequence[SettledState], unloading: Sequence[SettledState]) -> Loop:
    up, down = _path(loading, side), _path(unloading, side)
    low, high = max(up[0][0], down[0][0]), min(up[0][-1], down[0][-1])
    span = (high - low) / KPA
    if span <= 0:
        return Loop(cycle, side, len(loading) + len(unloading), *(np.nan,) * 6)
    at = np.linspace(low, high, 8 * LEVELS)
    angle_width, other_width = (
        float((np.interp(at, down[0], down[k]) - np.interp(at, up[0], up[k])).mean()) / unit
        for k, unit in ((1, DEG), (2, KPA))
    )
    range_of_angles = float(np.ptp(up[1])) / DEG
    return Loop(
        cycle,
        side,
        len(loading) + len(unloading),
        angle_width * span,
        angle_width,
        angle_width / range_of_angles if range_of_angles > 0 else np.nan,
        other_width * span,
        other_width,
        _rest_angle(unloading),
    )


def _rest_angle(unloading: Sequence[SettledState]) -> float:
    """Angle at equal pressures, by the line through the last two states of unloading [deg].

    nan where the finger was not brought back to a quarter of the pressures it came from.
    """
    differences = [s.right - s.left for s in unloading]
    last, before = differences[-1], differences[-2]
    if last == before or abs(last) > 0.25 * max(abs(value) for value in differences):
        return float("nan")
    slope = (unloading[-1].angle - unloading[-2].angle) / (last - before)
    return (unloading[-1].angle - slope * last) / DEG
