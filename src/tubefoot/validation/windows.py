"""A recording as a fit sees it: means over windows after each pulse, and the time steps to model them.

After a pulse everything creeps with the logarithm of time, so windows double in length. While the pump runs
one window of the pressures tells the tubes' resistance. Steps end at the edges and middles of the windows,
and a window's model value is Simpson's mean. Flagged samples are passed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.pulses import demand_known_pulses
from tubefoot.validation.recording import BenchRecord

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_S = 0.12
"""From the end of a pulse to its first window [s]: what relaxes faster is not modelled."""
LEAST_WINDOW_S = 0.1
LONG_WINDOW_S = 0.4
"""Longer windows are modelled in four steps, shorter ones in two [s]."""
LONGEST_STEP_S = 0.03
"""While the pump runs [s]."""
RUNNING_FLOOR = 0.3 * KPA
"""Uncertainty of the lean model while the pump runs: rollers, sag of the supply [MPa]."""
PRESSURE_FLOOR = 0.08 * KPA
"""The same at rest: a count of the converter is 0.24 kPa [MPa]."""
ANGLE_FLOOR = 0.05 * DEG
LEAST_SAMPLES = 3


@dataclass(frozen=True)
class Windows:
    """Means of one quantity over windows.

    steps : (w, 3) points of the time grid at beginning, middle and end of each window
    values, sigma : (w,) means and their standard uncertainties, with a guess of the lean model's own
    noise : (w,) of the means alone, by the sensor's scatter
    pulse : (w,) number of the pulse before
    early : (w,) by how much the samples' mean time is before the window's middle [s]: up to half an interval
    """

    steps: IntArray
    values: FloatArray
    sigma: FloatArray
    noise: FloatArray
    pulse: IntArray
    early: FloatArray

    def resting(self, seen: Observation) -> NDArray[np.bool_]:
        """Which windows lie in pauses, (w,).

        seen : the recording
        """
        return np.asarray(seen.grid[self.steps[:, 0]] >= seen.ends[self.pulse] - 1e-9)

    def of_model(self, course: FloatArray, grid: FloatArray, late: float = 0.0) -> FloatArray:
        """Means of a modelled quantity, (w,).

        course : (n + 1,) on the time grid; grid : (n + 1,) its times [s]
        late : by how much it is seen later than it happens [s]; small against the windows
        """
        at, times = course[self.steps], grid[self.steps]
        means = (at[:, 0] + 4.0 * at[:, 1] + at[:, 2]) / 6.0
        rates = (at[:, 2] - at[:, 0]) / (times[:, 2] - times[:, 0])
        return np.asarray(means - (late + self.early) * rates)


@dataclass(frozen=True)
class Observation:
    """One recording for a fit.

    name : of the recording; units : of its finger
    grid : (n + 1,) times between which the model steps, the first at the start of the first pulse [s]
    starts, ends, directions, duties : of the pulses, (p,); duties nan where the source does not say
    right, left, angle : what was seen [MPa], [MPa], [rad]
    """

    name: str
    units: int
    grid: FloatArray
    starts: FloatArray
    ends: FloatArray
    directions: FloatArray
    duties: FloatArray
    right: Windows
    left: Windows
    angle: Windows

    @property
    def quantities(self) -> tuple[Windows, Windows, Windows]:
        """Right, left, angle."""
        return self.right, self.left, self.angle

    @property
    def count(self) -> int:
        """How many means there are."""
        return sum(len(each.values) for each in self.quantities)


def observe(record: BenchRecord, until: float | None = None) -> Observation:
    """The windows of a recording.

    record : of the bench; until : pulses that begin later are left out [s], None for all

    Raises ConfigError when nobody said how many units the finger has, or there are too few windows.
    """
    if record.units is None:
        raise ConfigError(f"{record.name}: how many units has the finger? Give --units")
    last = record.duration if until is None else min(until, record.duration)
    pulses = [pulse for pulse in record.pulses if pulse.end < last]
    if not pulses:
        raise ConfigError(f"{record.name}: no pulse ends before the recording does; record until it rests")
    demand_known_pulses(record, last)
    spans, times = _spans([(pulse.start, pulse.end) for pulse in pulses], last)
    grid = np.unique(np.round(times, 6))
    resting = [span for span in spans if not span[3]]
    angle = _windows(
        record.angle_time,
        record.angle,
        record.angle_outlier,
        resting,
        grid,
        _angle_scatter(record),
        ANGLE_FLOOR,
    )
    sides = [
        _windows(
            record.time,
            record.pressures[:, side],
            record.pressure_outlier,
            spans,
            grid,
            record.rest.sigma[side],
            PRESSURE_FLOOR,
        )
        for side in (0, 1)
    ]
    if len(sides[0].values) < 10:
        raise ConfigError(
            f"{record.name}: only {len(sides[0].values)} windows of {LEAST_WINDOW_S:g} s with "
            "samples between pulses, 10 are needed; record more pulses, with pauses of half a second at least"
        )
    return Observation(
        record.name,
        record.units,
        grid,
        np.array([pulse.start for pulse in pulses]),
        np.array([pulse.end for pulse in pulses]),
        np.array([float(pulse.direction) for pulse in pulses]),
        np.array([pulse.duty for pulse in pulses]),
        sides[0],
        sides[1],
        angle,
    )


def _spans(
    pulses: Sequence[tuple[float, float]], last: float
) -> tuple[list[tuple[float, float, int, bool]], list[float]]:
    """Windows (begin, end, pulse, pump running) and all times of the grid."""
    spans: list[tuple[float, float, int, bool]] = []
    times: list[float] = [pulses[0][0]]
    for number, (start, end) in enumerate(pulses):
        middle = 0.5 * (start + end)
        count = max(2, 2 * int(np.ceil((end - start) / LONGEST_STEP_S / 2)))
        times += [*np.linspace(start, end, count + 1), 0.5 * (middle + end)]
        spans.append((middle, end, number, True))
        until = pulses[number + 1][0] if number + 1 < len(pulses) else last
        times += [min(end + delay, until) for delay in (0.03, 0.07)]
        begin = end + FIRST_S
        while begin + LEAST_WINDOW_S < until:
            finish = min(begin + max(LEAST_WINDOW_S, begin - end), until)
            if until - finish < LEAST_WINDOW_S:
                finish = until
            spans.append((begin, finish, number, False))
            times += np.linspace(begin, finish, 5 if finish - begin > LONG_WINDOW_S else 3).tolist()
            begin = finish
        times.append(until)
    return spans, times


def _windows(
    time: FloatArray,
    values: FloatArray,
    flagged: NDArray[np.bool_],
    spans: Sequence[tuple[float, float, int, bool]],
    grid: FloatArray,
    scatter: float,
    floor: float,
) -> Windows:
    good = ~flagged & np.isfinite(values)
    time, values = time[good], values[good]
    rows = []
    for begin, end, pulse, running in spans:
        first, beyond = np.searchsorted(time, (begin, end))
        if beyond - first < LEAST_SAMPLES:
            continue
        steps = [int(np.argmin(np.abs(grid - at))) for at in (begin, 0.5 * (begin + end), end)]
        noise = scatter / np.sqrt(beyond - first)
        error = np.hypot(noise, RUNNING_FLOOR if running else floor)
        early = 0.5 * (begin + end) - float(time[first:beyond].mean())
        rows.append((steps, float(values[first:beyond].mean()), error, noise, pulse, early))
    return Windows(
        np.array([row[0] for row in rows], dtype=np.int64).reshape(-1, 3),
        np.array([row[1] for row in rows]),
        np.array([row[2] for row in rows]),
        np.array([row[3] for row in rows]),
        np.array([row[4] for row in rows], dtype=np.int64),
        np.array([row[5] for row in rows]),
    )


def _angle_scatter(record: BenchRecord) -> float:
    stated = record.angle_sigma[np.isfinite(record.angle_sigma)]
    found = record.rest.sigma[2] if np.isfinite(record.rest.sigma[2]) else 0.0
    return max(found, float(np.median(stated)) if stated.size else 0.0)
