"""Recordings with a known truth, made by formulas: pulses of the pump, pressures, angles that creep."""

from __future__ import annotations

import numpy as np

from tubefoot.units import DEG, KPA
from tubefoot.validation.loading import prepared
from tubefoot.validation.recording import BenchRecord, RawSeries, RecordedPulse

RATE_HZ, FRAMES_HZ = 100.0, 30.0
PULSE_S, PAUSE_S, REST_S = 0.2, 1.3, 4.0
STEPS = 6
"""Pulses of each stroke: forward, back, reverse, back."""


def program(cycles: int) -> list[RecordedPulse]:
    """Loading to the right, back, loading to the left, back; so many times."""
    ways = ([1] * STEPS + [-1] * STEPS + [-1] * STEPS + [1] * STEPS) * cycles
    starts = REST_S + np.arange(len(ways)) * (PULSE_S + PAUSE_S)
    return [
        RecordedPulse(start, start + PULSE_S, way, 0.5, 50.0 * way)
        for start, way in zip(starts.tolist(), ways, strict=True)
    ]


def level(pulses: list[RecordedPulse], time: np.ndarray) -> np.ndarray:
    """Share of the full stroke at some times, from -1 to 1."""
    total = np.zeros(len(time))
    for pulse in pulses:
        total += pulse.direction * np.clip((time - pulse.start) / PULSE_S, 0.0, 1.0)
    return total / STEPS


def raw_series(
    cycles: int = 2,
    top_kpa: float = 30.0,
    coupling: float = -0.8,
    gain_deg_per_kpa: float = 0.4,
    lag_s: float = 0.0,
    latency_s: float = 0.0,
    offsets_kpa: tuple[float, float] = (0.0, 0.0),
    drift_kpa_per_s: float = 0.0,
    noise_kpa: float = 0.02,
    noise_deg: float = 0.02,
    seed: int = 0,
) -> RawSeries:
    """Series of which every number is known.

    `lag_s` lets half of the angle follow the pressures by an exponential of that time constant.
    """
    chance = np.random.default_rng(seed)
    pulses = program(cycles)
    end = pulses[-1].end + PAUSE_S
    time = np.arange(0.0, end, 1.0 / RATE_HZ)
    pressed = top_kpa * level(pulses, time)
    right = np.where(pressed > 0, pressed, coupling * -pressed)
    left = np.where(pressed > 0, coupling * pressed, -pressed)
    both = np.column_stack([right, left]) + offsets_kpa + drift_kpa_per_s * time[:, None]
    both += noise_kpa * chance.standard_normal(both.shape)
    frames = np.arange(0.01, end, 1.0 / FRAMES_HZ)
    fine = np.arange(0.0, end, 1e-3)
    angle = gain_deg_per_kpa * top_kpa * level(pulses, fine)
    if lag_s:
        late, keep = np.empty_like(angle), np.exp(-1e-3 / lag_s)
        held = 0.0
        for at, value in enumerate(angle):
            held = keep * held + (1 - keep) * value
            late[at] = held
        angle = 0.5 * (angle + late)
    seen = np.interp(frames, fine, angle) + noise_deg * chance.standard_normal(len(frames))
    drive = np.zeros(len(time))
    for pulse in pulses:
        drive[(time >= pulse.start) & (time < pulse.end)] = 0.5 * pulse.direction
    return RawSeries(
        time,
        both * KPA,
        drive,
        frames + latency_s,
        seen * DEG,
        np.full(len(frames), noise_deg * DEG),
        tuple(pulses),
        None,
        3,
        {"format": "made"},
    )


def record(**truth: float) -> BenchRecord:
    """A recording ready to be judged."""
    return prepared(raw_series(**truth), "made")
