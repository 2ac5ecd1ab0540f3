"""Our own recordings (`tubefoot rig record`, `tubefoot bend`) as raw series."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.lab.recording import Recording
from tubefoot.units import DEG, KPA, ML
from tubefoot.validation.recording import FloatArray, RawSeries, RecordedPulse

UNIT_TEXT = {
    "unit_time": "s",
    "unit_pressure_right": "kPa",
    "unit_pressure_left": "kPa",
    "unit_angle": "deg",
    "unit_drive": "1",
}


def read_bench_mcap(path: Path) -> RawSeries:
    """What a recording of our own holds.

    path : the `.mcap` file

    Raises ConfigError when it has no samples, LinkError when it is not a recording.
    """
    recording = Recording(path)
    samples = recording.rows("samples")
    if not samples:
        raise ConfigError(f"{path}: no samples in this recording; record with the pump connected")
    neutral = recording.rows("neutral")
    begin = samples[0]["time_s"]
    if neutral:
        # What came before the first neutral reading was not yet a measurement.
        begin = max(begin, neutral[0]["time_s"] - 1.0)
        samples = [row for row in samples if row["time_s"] >= begin]
    rest = (neutral[0]["gauge_right_kpa"] * KPA, neutral[0]["gauge_left_kpa"] * KPA) if neutral else None
    angle_time, angle, sigma = _angles(recording, begin)
    return RawSeries(
        _column(samples, "time_s"),
        np.column_stack([_column(samples, f"gauge_{side}_kpa") * KPA for side in ("right", "left")]),
        _column(samples, "direction") * _column(samples, "duty"),
        angle_time,
        angle,
        sigma,
        pulses=_pulses(recording),
        rest_pressures=rest,
        units=_units(recording),
        provenance={
            "file": path.name,
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "format": "mcap" if recording.complete else "mcap, cut short",
            "rig": recording.settings.name,
            **UNIT_TEXT,
        },
    )


def _column(rows: list[dict[str, Any]], name: str) -> FloatArray:
    return np.array([np.nan if row.get(name) is None else row[name] for row in rows], dtype=float)


def _angles(recording: Recording, begin: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, angles and uncertainties [s, rad]: of the camera, else those at a controller's decisions."""
    rows = [row for row in recording.rows("angles") if row["time_s"] >= begin and not row["fault"]]
    if rows:
        return _column(rows, "time_s"), _column(rows, "bend_deg") * DEG, _column(rows, "sigma_deg") * DEG
    decided = [
        {"time_s": row["time_s"], "bend_deg": row["values"].get("bend_deg")}
        for row in recording.rows("decisions")
    ]
    decided = [row for row in decided if isinstance(row["bend_deg"], int | float)]
    time = _column(decided, "time_s")
    return time, _column(decided, "bend_deg") * DEG, np.full(len(time), np.nan)


def _pulses(recording: Recording) -> tuple[RecordedPulse, ...]:
    """Each pulse with the end that the board told; without one it lasted as long as was asked."""
    found, ends = [], recording.rows("pulse_ends")
    pulses = recording.rows("pulses")
    for number, row in enumerate(pulses):
        start = row["time_s"]
        following = pulses[number + 1]["time_s"] if number + 1 < len(pulses) else np.inf
        end = next((end for end in ends if start <= end["time_s"] <= following), None)
        ran = end["duration_s"] if end else row["duration_s"]
        volume = end["volume_ml"] if end else row["volume_ml"]
        found.append(RecordedPulse(start, start + ran, row["direction"], row["duty"], volume * ML))
    return tuple(found)


def _units(recording: Recording) -> int | None:
    for row in recording.rows("events"):
        if row["name"] == "campaign" and row["detail"].get("units"):
            return int(row["detail"]["units"])
    return None
