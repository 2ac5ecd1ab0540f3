"""What no bench can have measured: a wrong unit, a wrong sign, two clocks, a sensor that stands still.

Such a recording could be read and fitted, with numbers that mean nothing. Each is refused with what was
found, what is allowed and what to look at. The limits are wide: they tell units apart, not good benches from
bad ones.
"""

from __future__ import annotations

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.units import ATMOSPHERE_MPA, DEG, KPA
from tubefoot.validation.recording import BenchRecord, BoolArray, FloatArray, RawSeries

INTERVALS_S = (2e-4, 5.0)
"""Between samples, median [s]: a thousandth or a thousand times the usual 5 to 100 ms lies outside."""
HIGHEST_MPA = 300 * KPA
"""Largest rise of a pressure; soft fingers burst far below [MPa]."""
SPIKES = 0.005
"""Share of the samples that may lie beyond, as spikes do."""
TURN_OF_A_UNIT = 60 * DEG
"""Largest bend over the number of units [rad]."""
USUAL_UNITS = 12
"""Where nobody said how many."""
LARGEST_DRIVE = 1.01
MOVED_MPA = 0.5 * KPA
"""A pulse that changes right less left pressure by less says nothing of its sign [MPa]."""
AGAINST = 0.8
"""Share of such pulses, or correlation of the angle with the pressures, that tells a sign."""
STILL_PULSES = 3
"""A pressure that shows one and the same value over so many pulses stands still."""


def demand_units_of_series(raw: RawSeries) -> None:
    """Refuse series whose times or drive cannot be in the unit that was said.

    raw : as the source has it

    Raises ConfigError naming what was found, what is allowed and what to do.
    """
    interval = float(np.median(np.diff(raw.time)))
    if not INTERVALS_S[0] <= interval <= INTERVALS_S[1]:
        raise ConfigError(
            f"samples are {interval:.3g} s apart: allowed are {INTERVALS_S[0]:g} to {INTERVALS_S[1]:g} s; "
            "check the unit of the time (columns.time.unit)"
        )
    largest = float(np.nanmax(np.abs(raw.drive), initial=0.0)) if np.isfinite(raw.drive).any() else 0.0
    if largest > LARGEST_DRIVE:
        raise ConfigError(
            f"the pump's drive reaches {largest:.3g}: it is a share from -1 to 1; "
            "check its unit (columns.drive.unit: 1, %, pwm255 or direction)"
        )
    seen = raw.angle_time[np.isfinite(raw.angle)]
    if len(seen) and (seen[0] > raw.time[-1] or seen[-1] < raw.time[0]):
        raise ConfigError(
            f"angles run from {seen[0]:.1f} to {seen[-1]:.1f} s, pressures from {raw.time[0]:.1f} to "
            f"{raw.time[-1]:.1f} s: no moment has both; bring them on one clock (check the time's units)"
        )


def demand_plausible(record: BenchRecord) -> None:
    """Refuse what no bench shows: pressures below vacuum, turns of many revolutions, signs that contradict.

    record : baseline taken off, outliers flagged, pulses known

    Raises ConfigError naming what was found, what is allowed and what to do.
    """
    good = ~record.pressure_outlier
    for side, name in enumerate(("right", "left")):
        _demand_pressures(record.pressures[good, side], name)
        _demand_motion(record, side, name, good)
    _demand_turns(record)
    _demand_signs(record, good)


def _demand_pressures(change: FloatArray, name: str) -> None:
    low, high = np.quantile(change, [SPIKES, 1.0 - SPIKES]) if len(change) else (0.0, 0.0)
    if low < -ATMOSPHERE_MPA or high > HIGHEST_MPA:
        off = low if low < -ATMOSPHERE_MPA else high
        raise ConfigError(
            f"the {name} pressure changes by {off / KPA:.4g} kPa: allowed are {-ATMOSPHERE_MPA / KPA:.0f} "
            f"(vacuum) to {HIGHEST_MPA / KPA:g} kPa; check its unit (columns.pressure_{name}.unit)"
        )


def _demand_motion(record: BenchRecord, side: int, name: str, good: BoolArray) -> None:
    """Refuse a sensor that shows one value over several pulses while the other one moves."""
    time, values = record.time[good], record.pressures[good, side]
    if not len(time):
        return
    shown = values + record.rest.drift[side] * time
    bounds = np.concatenate([[0], np.flatnonzero(np.abs(np.diff(shown)) > 1e-3 * KPA) + 1, [len(shown)]])
    longest = int(np.argmax(np.diff(bounds)))
    first, beyond = bounds[longest], bounds[longest + 1]
    begin, end = time[first], time[beyond - 1]
    inside = [pulse for pulse in record.pulses if begin <= pulse.start and pulse.end <= end]
    other = record.pressures[good, 1 - side][first:beyond]
    if len(inside) >= STILL_PULSES and np.ptp(other) > MOVED_MPA:
        raise ConfigError(
            f"the {name} pressure shows {values[first] / KPA:.4g} kPa without change from {begin:.1f} to "
            f"{end:.1f} s, over {len(inside)} pulses: a sensor that hangs, or has reached its end; "
            "use the recording up to there"
        )


def _demand_turns(record: BenchRecord) -> None:
    seen = np.abs(record.angle[~record.angle_outlier])
    limit = TURN_OF_A_UNIT * (record.units or USUAL_UNITS)
    if len(seen) and (most := float(np.quantile(seen, 1.0 - SPIKES))) > limit:
        raise ConfigError(
            f"the finger bends by {most / DEG:.4g} deg: allowed are {limit / DEG:g} deg, "
            f"{TURN_OF_A_UNIT / DEG:g} for each unit; check the angle's unit (angles.angle.unit)"
        )


def _demand_signs(record: BenchRecord, good: BoolArray) -> None:
    """Refuse a drive or an angle that goes against the pressures."""
    time, difference = record.time[good], record.pressures[good, 0] - record.pressures[good, 1]
    if len(time) < 2:
        return
    ends = np.array([(pulse.start, pulse.end) for pulse in record.pulses])
    moved = np.interp(ends[:, 1], time, difference) - np.interp(ends[:, 0], time, difference)
    told = np.array([pulse.direction for pulse in record.pulses])
    clear = np.abs(moved) > MOVED_MPA
    against = int((np.sign(moved[clear]) != told[clear]).sum())
    if clear.sum() >= STILL_PULSES and against > AGAINST * clear.sum():
        raise ConfigError(
            f"in {against} of {clear.sum()} pulses right less left pressure falls where the drive says "
            "forward, or rises where it says reverse; exchange the two pressures' columns, or set "
            "columns.drive.sign = -1"
        )
    seen = ~record.angle_outlier
    angle, at = record.angle[seen], record.angle_time[seen]
    pressed = np.interp(at, time, difference)
    if len(at) < 2 or np.ptp(pressed) < MOVED_MPA or np.ptp(angle) == 0:
        return
    if (alike := float(np.corrcoef(angle, pressed)[0, 1])) < -AGAINST:
        raise ConfigError(
            f"the angle falls where right less left pressure rises (correlation {alike:.2f}): it counts "
            "positive towards the left chamber; set sign = -1 at the angle in the column map"
        )
