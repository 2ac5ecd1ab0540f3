"""When the pump ran: from the source's drive, or from the pressures alone where nobody wrote it down.

While the pump runs, the difference of the branch pressures changes faster than anything else makes it change;
its sign is the direction. The end found so is late by the smoothing, 0.05 s.
"""

from __future__ import annotations

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.validation.recording import BenchRecord, BoolArray, FloatArray, RecordedPulse

GRID_S = 0.02
"""Step of the even grid on which rates are taken [s]."""
SMOOTH_S = 0.1
"""Length of the running mean before [s]."""
NOISE_FACTOR = 8.0
"""A pulse is faster than so many robust standard deviations of the rate at rest."""
SHARE_OF_FASTEST = 0.2
"""And than this share of the fastest 2 % of the rates."""
LEAST_PULSE_S, LEAST_PAUSE_S = 0.04, 0.1
"""Shorter pulses are noise, shorter pauses are ripple of the pump's rollers [s]."""
RUNNING = 1e-9
LONGEST_GAP_S, GAP_OF_SAMPLES = 0.5, 10.0
"""Samples further apart than this, and than so many usual intervals, may hide a pulse [s]."""
MOST_DOUBT, SMALL_DOUBT = 0.5, 0.1
"""Of `pulse_doubt`: no fit above the one, a word above the other."""


def found_pulses(
    time: FloatArray, pressures: FloatArray, drive: FloatArray, wild: BoolArray
) -> tuple[RecordedPulse, ...]:
    """The runs of the pump in order.

    time : (n,) [s]
    pressures : (n, 2) [MPa]
    drive : (n,) signed share, nan where the source has none
    wild : (n,) samples to be passed over
    """
    if np.isfinite(drive).any():
        signal = np.nan_to_num(drive)
        way = np.where(np.abs(signal) > RUNNING, np.sign(signal), 0.0)
        return _runs(time, way, signal)
    seen = time[~wild]
    if len(seen) == 0 or seen[-1] - seen[0] < LEAST_PULSE_S:
        return ()
    grid, rate = pressure_rate(time, pressures, wild)
    still = np.median(np.abs(rate - np.median(rate)))
    fastest = np.quantile(np.abs(rate), 0.98)
    least = max(NOISE_FACTOR * 1.4826 * float(still), SHARE_OF_FASTEST * float(fastest))
    if least <= 0:
        return ()
    way = np.where(np.abs(rate) > least, np.sign(rate), 0.0)
    return _runs(grid, way, np.full(len(grid), np.nan))


def blind_stretches(time: FloatArray) -> tuple[tuple[float, float], ...]:
    """Where samples are so far apart that a pulse between them would have been missed, begin and end [s].

    time : (n,) of the samples [s]

    >>> import numpy as np
    >>> blind_stretches(np.array([0.0, 0.1, 0.2, 5.2, 5.3, 5.4]))
    ((0.2, 5.2),)
    """
    apart = np.diff(time)
    gaps = np.flatnonzero(apart > max(LONGEST_GAP_S, GAP_OF_SAMPLES * float(np.median(apart))))
    return tuple((float(time[at]), float(time[at + 1])) for at in gaps)


def demand_known_pulses(record: BenchRecord, last: float) -> None:
    """Refuse a recording that does not tell what was pumped: pulses unseen, or too short for its samples.

    record : of the bench, with pulses; last : what comes later does not matter [s]

    Raises ConfigError naming where, or how fast to record.
    """
    for begin, end in record.blind:
        if record.pulses[0].start < end and begin < min(last, record.pulses[-1].end):
            raise ConfigError(
                f"{record.name}: no samples from {begin:.1f} to {end:.1f} s, and nothing else says whether "
                "the pump ran meanwhile; fit the parts before and after as recordings of their own"
            )
    if pulse_doubt(record) > MOST_DOUBT:
        interval, length = _interval_and_length(record)
        raise ConfigError(
            f"{record.name}: samples are {interval:.3g} s apart and pulses {length:.3g} s long, so nobody "
            f"knows how much was pumped; record every {MOST_DOUBT * length:.2g} s, or pump longer"
        )


def pulse_doubt(record: BenchRecord) -> float:
    """Interval of the samples over the length of a pulse where only they tell it; 0 where pulses are listed.

    record : of the bench, with pulses
    """
    if np.isfinite([pulse.volume for pulse in record.pulses]).any():
        return 0.0
    interval, length = _interval_and_length(record)
    return interval / length


def _interval_and_length(record: BenchRecord) -> tuple[float, float]:
    """Medians between samples and of the pulses [s]."""
    lengths = [pulse.end - pulse.start for pulse in record.pulses]
    return float(np.median(np.diff(record.time))), float(np.median(lengths))


def pressure_rate(time: FloatArray, pressures: FloatArray, wild: BoolArray) -> tuple[FloatArray, FloatArray]:
    """An even grid of times [s] and the rate of right less left pressure on it [MPa/s], smoothed.

    time, pressures, wild : see `found_pulses`
    """
    difference = pressures[~wild, 0] - pressures[~wild, 1]
    grid, even = smoothed(time[~wild], difference)
    return grid, np.asarray(np.gradient(even, GRID_S))


def smoothed(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """An even grid of times [s] and a running mean of the values on it.

    time : (n,) rising [s]
    values : (n,) of any unit
    """
    grid = np.arange(time[0], time[-1], GRID_S)
    even = np.interp(grid, time, values)
    half = round(SMOOTH_S / GRID_S / 2)
    padded = np.pad(even, half, mode="edge")
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    return grid, np.convolve(padded, kernel, mode="valid")


def _runs(time: FloatArray, way: FloatArray, drive: FloatArray) -> tuple[RecordedPulse, ...]:
    """Stretches of one direction, joined over short pauses, the shortest left out."""
    edges = np.flatnonzero(np.diff(way, prepend=0.0, append=0.0)).tolist()
    stretches: list[list[int]] = []
    for first, last in zip(edges, [*edges, len(way)][1:], strict=True):
        if first >= len(way) or way[first] == 0:
            continue
        before = stretches[-1] if stretches else None
        near = before is not None and time[first] - time[before[1] - 1] < LEAST_PAUSE_S
        if before is not None and near and way[before[0]] == way[first]:
            before[1] = last
        else:
            stretches.append([first, last])
    found = []
    for first, last in stretches:
        start, end = float(time[first]), float(time[min(last, len(time) - 1)])
        if end - start >= LEAST_PULSE_S:
            duty = float(np.abs(drive[first:last]).mean())
            found.append(RecordedPulse(start, end, int(way[first]), duty, float("nan")))
    return tuple(found)
