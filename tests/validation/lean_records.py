"""Recordings made by the lean bench itself, with noise: the fit's arithmetic, quick and exactly known."""

from dataclasses import replace

import numpy as np

from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_parameters import SAME_TIME_S, UNKNOWNS, bench_numbers, pumped_volumes
from tubefoot.validation.lean_bench import LeanBench
from tubefoot.validation.recording import NO_LATENCY, BenchRecord, RecordedPulse, Rest
from tubefoot.validation.windows import observe

CONTENT = reference_file()
DUTY = 0.35
"""At which the flows of known values are."""


def known_values(**given):
    """All unknowns at their priors' middles but those given."""
    values = {unknown.name: unknown.outer(unknown.middle) for unknown in UNKNOWNS}
    return values | {"scale": 1.1, "seam": 0.15, "flow_forward_ml_per_s": 0.33, **given}


def cyclic_pulses(count=9, length=0.12, pause=0.9, hold=8.0, rest=2.0):
    """Up in pulses, a hold, down, to the other side, down, a hold."""
    pulses, now = [], rest
    for direction, number in ((1, count), (-1, 2 * count), (1, count)):
        for _ in range(number):
            pulses.append(RecordedPulse(now, now + length, direction, DUTY, float("nan")))
            now += length + pause
        now += hold
    return tuple(pulses), now


def made_record(
    values, units=3, seed=0, pressure_noise=0.05 * KPA, angle_noise=0.01 * DEG, pulses=None, slip_ul=0.0
):
    """What a bench of these values would record: 100 samples and 30 angles a second.

    Each pulse brings more or less than it should by a chance of `slip_ul`, one standard deviation.
    """
    runs, last = pulses or cyclic_pulses()
    time, frames = np.arange(0.0, last, 0.01), np.arange(0.0, last, 1 / 30)
    empty = BenchRecord(
        "made",
        units,
        time,
        np.zeros((len(time), 2)),
        np.zeros(len(time)),
        frames,
        np.zeros(len(frames)),
        np.full(len(frames), angle_noise),
        np.zeros(len(time), bool),
        np.zeros(len(frames), bool),
        runs,
        Rest((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), 0.0, (pressure_noise, pressure_noise, angle_noise)),
        NO_LATENCY,
    )
    seen = observe(empty)
    grid = np.unique(np.round(np.concatenate([seen.grid, np.arange(seen.grid[0], last, 0.01)]), 6))
    fine = replace(seen, grid=grid)
    bench = LeanBench(CONTENT.to_finger().with_units(units))
    chance = np.random.default_rng(seed)
    pumped = slipped(fine, pumped_volumes(fine, values, DUTY), slip_ul, chance)
    course = bench.simulate(np.diff(grid), pumped, bench_numbers(values, CONTENT.to_prony()))
    seen_at = time - values["pressure_late_s"]
    pressures = np.array([np.interp(seen_at, grid, course.branch[:, side], left=0.0) for side in (0, 1)]).T
    bend = np.interp(frames, grid, course.bend, left=0.0)
    return replace(
        empty,
        pressures=pressures + pressure_noise * chance.standard_normal(pressures.shape),
        angle=bend + angle_noise * chance.standard_normal(len(bend)),
    )


def slipped(seen, pumped, slip_ul, chance):
    """Volumes of the steps with the chance of each pulse: as much more of each of its steps."""
    if not slip_ul:
        return pumped
    pulse = np.searchsorted(seen.starts - SAME_TIME_S, seen.grid[:-1], side="right") - 1
    whole = np.bincount(pulse, np.abs(pumped))
    return pumped * (1.0 + slip_ul * chance.standard_normal(len(whole)) / whole)[pulse]
