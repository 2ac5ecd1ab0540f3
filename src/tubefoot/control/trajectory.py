"""Trajectories of the bend angle, from a table, and how much pump they need.

The linear creep law turns flow into bend; its answer to a sine gives the largest amplitude that a pump can
drive at a frequency, |bend| = flow |H(i omega)| with H = gain / s sum_i share_i / (1 + s T_i).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.creep import MODE_TIMES_S, CreepLaw
from tubefoot.control.estimator import Forecast
from tubefoot.errors import ConfigError
from tubefoot.records import read_table
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

COLUMNS = ("time_s", "bend_deg")
LONGEST_S = 3600.0
LARGEST_DEG = 120.0
FRAME_S = 1 / 30


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


def flow_needed(law: CreepLaw, trajectory: Trajectory, ahead_s: float) -> FloatArray:
    """Flow that keeps a finger on a trajectory, one value a frame, as the tracking controller asks [mm^3/s].

    law : of the finger's creep
    trajectory : to be followed
    ahead_s : how far ahead the finger is brought onto it [s]
    """
    shares, _ = law.shares_at(float(np.log(law.ratio)))
    decay = np.exp(-FRAME_S / MODE_TIMES_S)
    at = np.array([ahead_s])
    modes, relaxed, flows = np.zeros(len(MODE_TIMES_S)), 0.0, []
    for time in np.arange(0.0, trajectory.duration, FRAME_S):
        now = Forecast(modes, relaxed, 0.0, shares, (law.gain, law.gain), law.ratio, (1.0, 1.0))
        missing = trajectory.at(time + ahead_s) - float(now.free(at)[0])
        rate = missing / (ahead_s * float(now.step(at, ahead_s)[0]))
        middle = relaxed + 0.5 * rate * FRAME_S
        modes = decay * modes + (1.0 - decay) * shares * middle
        relaxed += rate * FRAME_S
        flows.append(rate / law.gain)
    return np.array(flows)


def largest_sine(law: CreepLaw, flow: float, frequencies: FloatArray) -> FloatArray:
    """Amplitude of the fastest sine that a pump can drive [rad], (n,).

    law : of the finger's creep
    flow : largest of the pump [mm^3/s]
    frequencies : (n,) [Hz]
    """
    shares, _ = law.shares_at(float(np.log(law.ratio)))
    laplace = 2j * np.pi * np.asarray(frequencies)[:, None]
    answer = law.gain / laplace[:, 0] * (shares / (1.0 + laplace * MODE_TIMES_S)).sum(axis=1)
    return np.asarray(flow * np.abs(answer))
