"""Trajectories of the bend angle, from a table, and how much pump they need.

The linear creep law turns flow into bend; its answer to a sine gives the largest amplitude that a pump can
drive at a frequency, |bend| = flow |H(i omega)| with H = gain / s sum_i share_i / (1 + s T_i).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.creep import MODE_TIMES_S, CreepLaw
from tubefoot.errors import ConfigError
from tubefoot.records import read_table
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

COLUMNS = ("time_s", "bend_deg")
LONGEST_S = 3600.0
LARGEST_DEG = 120.0
FRAME_S = 1 / 30
REST_S, BACK_S = 60.0, 60.0
"""How long the finger rests before and after, and takes to go back, where a trajectory is inverted [s]."""


@dataclass(frozen=True)
class Trajectory:
    """Wanted bend over time, linear between its points, still beyond the last.

    times : (n,) from 0, growing [s]; bends : (n,) [rad]
    """

    times: FloatArray
    bends: FloatArray

    @property
    def duration(self) -> float:
        """From the first point to the last [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> float:
        """Wanted bend [rad].

        time : since the begin [s]
        """
        return float(np.interp(time, self.times, self.bends))


def load_trajectory(path: Path) -> Trajectory:
    """The trajectory in a table, checked.

    path : CSV with the columns time_s (from 0, growing) and bend_deg

    Raises ConfigError naming the line that is wrong.
    """
    rows = read_table(path)
    points: list[tuple[float, float]] = []
    for number, row in enumerate(rows, start=2):
        values = [row.get(name) for name in COLUMNS]
        if not all(isinstance(value, float) and np.isfinite(value) for value in values):
            raise ConfigError(f"{path}, line {number}: needs numbers in the columns {', '.join(COLUMNS)}")
        points.append((float(values[0]), float(values[1])))  # type: ignore[arg-type]
        _check_point(path, number, points)
    if len(points) < 2:
        raise ConfigError(
            f"{path}: a trajectory has two points or more, with the columns {', '.join(COLUMNS)}"
        )
    return trajectory_of(points)


def trajectory_of(points: Sequence[tuple[float, float]]) -> Trajectory:
    """A trajectory through points.

    points : time [s], from 0 and growing, and bend [deg]
    """
    times, bends = np.array(points, dtype=float).T
    return Trajectory(times, bends * DEG)


def _check_point(path: Path, number: int, points: list[tuple[float, float]]) -> None:
    (time, bend), before = points[-1], points[-2] if len(points) > 1 else None
    if before is None and time != 0.0:
        raise ConfigError(f"{path}, line {number}: the first time_s is {time:g}; begin at 0")
    if before is not None and time <= before[0]:
        raise ConfigError(f"{path}, line {number}: time_s = {time:g} does not come after {before[0]:g}")
    if time > LONGEST_S or abs(bend) > LARGEST_DEG:
        raise ConfigError(
            f"{path}, line {number}: time_s = {time:g}, bend_deg = {bend:g}; at most {LONGEST_S:g} s and "
            f"{LARGEST_DEG:g} deg either way"
        )


def flow_needed(law: CreepLaw, trajectory: Trajectory, smooth_s: float) -> FloatArray:
    """Flow that keeps a finger on a trajectory, one value each `FRAME_S` [mm^3/s].

    law : of the finger's creep
    trajectory : to be followed, from rest at its first point
    smooth_s : corners are rounded over this time, as no controller follows them faster [s]

    Solved in the frequency domain, bend / H; before and after it the finger rests long enough to forget.
    """
    count = max(2, round(trajectory.duration / FRAME_S))
    path = np.interp(FRAME_S * np.arange(count), trajectory.times, trajectory.bends)
    rest, back = round(REST_S / FRAME_S), round(BACK_S / FRAME_S)
    fade = 0.5 + 0.5 * np.cos(np.pi * np.arange(back) / back)
    home = path[0] + (path[-1] - path[0]) * fade
    whole = np.concatenate([np.full(rest, path[0]), path, home, np.full(rest, path[0])])
    laplace = 2j * np.pi * np.fft.rfftfreq(len(whole), FRAME_S)
    spectrum = np.fft.rfft(whole) * np.exp(-0.5 * (0.5 * smooth_s * np.abs(laplace)) ** 2)
    relaxed = np.fft.irfft(spectrum / _follows(law, laplace), len(whole))
    return np.asarray(np.gradient(relaxed, FRAME_S)[rest : rest + count] / law.gain)


def largest_sine(law: CreepLaw, flow: float, frequencies: FloatArray) -> FloatArray:
    """Amplitude of the fastest sine that a pump can drive [rad], (n,).

    law : of the finger's creep
    flow : largest of the pump [mm^3/s]
    frequencies : (n,) [Hz]
    """
    laplace = 2j * np.pi * np.asarray(frequencies)
    return np.asarray(flow * law.gain * np.abs(_follows(law, laplace) / laplace))


def _follows(law: CreepLaw, laplace: NDArray[Any]) -> NDArray[Any]:
    """Bend over the relaxed angle that the fluid is worth, at Laplace variables (n,) [1/s]."""
    shares, _ = law.shares_at(float(np.log(law.ratio)))
    return np.asarray((shares / (1.0 + laplace[:, None] * MODE_TIMES_S)).sum(axis=1))
