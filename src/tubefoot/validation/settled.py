"""Settled states: means over the pauses between pulses, with what was pumped before and how long ago.

The paper logs half a second after each pulse; so does this, and a later state of a long pause can be asked
for: the wall creeps for minutes, and a state without its time says little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.recording import BenchRecord, FloatArray

Branch = Literal["rest", "loading", "unloading"]

SETTLE_S = 0.5
WINDOW_S = 0.3
LEAST_SAMPLES = 3
NEUTRAL = 0.5 * KPA
"""Difference of the pressures below which a state belongs to neither side [MPa]."""
LEFT_OVER = 3.0 * KPA
"""Difference of the pressures up to which a finger counts as brought back at the end [MPa]."""
ODD_SHARE = 0.5
"""A state of which a larger share of values is flagged is flagged itself."""


@dataclass(frozen=True, slots=True)
class SettledState:
    """One state at rest.

    pulse : number of the pulse before it, 0 before the first
    cycle : 1 and up, counted at each new loading of the side that was loaded first
    branch : whether the pulse before led away from neutral or back
    side : 1 where the right chamber is pressed, -1 the left, 0 neither
    time : middle of the averaging window [s]; since_pulse : from the pulse's end to there [s]
    duration : length of the window [s]
    right, left, angle : means since rest [MPa], [rad]; the angle is nan where it was not seen
    right_sigma, left_sigma, angle_sigma : standard errors of these means
    samples : pressures that were averaged; outlier : whether more than half of the values were flagged
    """

    pulse: int
    cycle: int
    branch: Branch
    side: int
    time: float
    since_pulse: float
    duration: float
    right: float
    left: float
    angle: float
    right_sigma: float
    left_sigma: float
    angle_sigma: float
    samples: int
    outlier: bool

    def row(self) -> dict[str, float | int | str]:
        """The state as a row of states.csv."""
        return {
            "pulse": self.pulse,
            "cycle": self.cycle,
            "branch": self.branch,
            "side": self.side,
            "time_s": self.time,
            "since_pulse_s": self.since_pulse,
            "pressure_right_kpa": self.right / KPA,
            "pressure_left_kpa": self.left / KPA,
            "bend_deg": self.angle / DEG,
            "sigma_right_kpa": self.right_sigma / KPA,
            "sigma_left_kpa": self.left_sigma / KPA,
            "sigma_bend_deg": self.angle_sigma / DEG,
            "samples": self.samples,
            "outlier": int(self.outlier),
        }


def settled_states(
    record: BenchRecord, settle: float = SETTLE_S, window: float = WINDOW_S
) -> list[SettledState]:
    """One state for each pause that lasts long enough, the rest before the first pulse among them.

    record : of the bench
    settle : from a pulse's end to the window [s]; a pause that is too short for it gives its last window
    window : over which is averaged [s]

    Raises ConfigError when no pause lasts as long as the window.
    """
    return _states(record, [(settle, False)], window)


def creeping_states(
    record: BenchRecord, delays: Sequence[float], window: float = WINDOW_S
) -> list[SettledState]:
    """States at several times after each pulse, as far as the pauses last.

    record : of the bench
    delays : from the pulse's end to the window [s]
    window : over which is averaged [s]
    """
    return _states(record, [(delay, True) for delay in delays], window)


def last_rest(record: BenchRecord, window: float = WINDOW_S) -> SettledState | None:
    """The state at the recording's end, None where the pump ran until then or the pressures differ.

    record : of the bench
    window : over which is averaged [s]
    """
    start = record.duration - window
    if start < record.pulses[-1].end + window:
        return None
    state = _mean_state(record, len(record.pulses), start, window, record.duration)
    return state if state is not None and abs(state.right - state.left) < LEFT_OVER else None


def _states(record: BenchRecord, delays: list[tuple[float, bool]], window: float) -> list[SettledState]:
    pulses = record.pulses
    found = [_mean_state(record, 0, max(pulses[0].start - window - 0.05, 0.0), window, pulses[0].start)]
    for number, pulse in enumerate(pulses, start=1):
        until = pulses[number].start if number < len(pulses) else record.duration
        for delay, strict in delays:
            room = until - pulse.end - window
            if room < 0 or (strict and room < delay):
                continue
            found.append(_mean_state(record, number, pulse.end + min(delay, room), window, until))
    whole = [state for state in found if state is not None]
    if len(whole) < 2:
        raise ConfigError(
            f"{record.name}: no pause between pulses lasts {window:g} s; record with longer pauses, or give "
            "a shorter window"
        )
    return _with_branches(whole, record)


def _mean_state(
    record: BenchRecord, pulse: int, start: float, window: float, until: float
) -> SettledState | None:
    """The means over a window, branch and cycle not yet known; None where there are too few samples."""
    end = min(start + window, until)
    inside = (record.time >= start) & (record.time <= end)
    good = inside & ~record.pressure_outlier
    if inside.sum() < LEAST_SAMPLES:
        return None
    used = good if good.sum() >= LEAST_SAMPLES else inside
    right, left = record.pressures[used].mean(axis=0)
    sigmas = [standard_error(record.pressures[used, side]) for side in (0, 1)]
    seen = (record.angle_time >= start) & (record.angle_time <= end) & np.isfinite(record.angle)
    fine = seen & ~record.angle_outlier
    angles = record.angle[fine if fine.any() else seen]
    flagged = [1.0 - good.sum() / inside.sum()]
    flagged += [1.0 - fine.sum() / seen.sum()] if seen.any() else []
    middle = 0.5 * (start + end)
    return SettledState(
        pulse,
        0,
        "rest",
        0,
        middle,
        middle - record.pulses[pulse - 1].end if pulse else middle,
        end - start,
        float(right),
        float(left),
        float(angles.mean()) if len(angles) else float("nan"),
        sigmas[0],
        sigmas[1],
        _angle_error(record, angles, seen),
        int(used.sum()),
        max(flagged) > ODD_SHARE,
    )


def _angle_error(record: BenchRecord, angles: FloatArray, seen: np.ndarray) -> float:
    """Standard error of the mean angle; of one or two frames by what the tracker said, or by the rest."""
    if len(angles) == 0:
        return float("nan")
    if len(angles) >= LEAST_SAMPLES:
        return standard_error(angles)
    stated = record.angle_sigma[seen]
    one = float(np.nanmean(stated)) if np.isfinite(stated).any() else record.rest.sigma[2]
    return one / len(angles) ** 0.5


def standard_error(values: FloatArray) -> float:
    """Standard error of the mean of successive values, their straight trend taken off, correlation counted.

    values : (n,) evenly spaced in time, of any unit; the sum of correlations ends at its first negative one
    """
    n = len(values)
    if n < LEAST_SAMPLES:
        return float("nan")
    about = np.arange(n) - (n - 1) / 2
    left = values - values.mean() - about * (about @ values) / (about @ about)
    variance = float(left @ left) / (n - 2)
    if variance <= 0:
        return 0.0
    correlated = 1.0
    for lag in range(1, n // 2):
        share = float(left[lag:] @ left[:-lag]) / (variance * (n - 2))
        if share <= 0:
            break
        correlated += 2.0 * share
    return (variance * correlated / n) ** 0.5


def _with_branches(states: list[SettledState], record: BenchRecord) -> list[SettledState]:
    """The states with side, branch and cycle."""
    found: list[SettledState] = []
    first, cycle, left_first = 0, 1, False
    for state in states:
        difference = state.right - state.left
        side = 0 if abs(difference) < NEUTRAL else (1 if difference > 0 else -1)
        branch: Branch = "rest"
        if state.pulse:
            direction = record.pulses[state.pulse - 1].direction
            branch = "loading" if direction == side else "unloading"
        if first == 0 and side:
            first = side
        left_first = left_first or (first != 0 and (side != first or branch == "unloading"))
        if left_first and side == first and branch == "loading":
            cycle, left_first = cycle + 1, False
        found.append(replace(state, side=side, branch=branch, cycle=cycle))
    return found
