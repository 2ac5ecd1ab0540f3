"""What a motion came to: the figures of its summary, from the rows of its trace."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tubefoot.control.motion import Motion

COLUMNS = (
    "time_s",
    "seen_at_s",
    "part",
    "target_deg",
    "bend_deg",
    "error_deg",
    "sigma_deg",
    "pressure_right_kpa",
    "pressure_left_kpa",
    "pumped_volume_ml",
    "direction",
    "duty",
    "pulses",
    "command",
    "note",
)
"""Header of `bend.csv`; what a virtual bench knows beside the measured follows."""
HOLD_NOTES = ("hold", "settled")
"""Notes of the rows in which the pump stands at the goal."""


def step_figures(motion: Motion, target_deg: float, band_deg: float = 1.0) -> dict[str, Any]:
    """Figures of a step: iterations, errors, overshoot, time.

    motion : that has ended
    target_deg : where to
    band_deg : half the tolerance band

    `iterations` counts runs of the pump, `iterations_to_band` those up to the first angle in the band;
    `overshoot_deg` is how far the measured angle passed the target, `hold_error_deg` the mean absolute
    error of the last hold, `final_error_deg` that of its last frame, signed. nan where nothing was seen.
    """
    seen = [row for row in motion.rows if "bend_deg" in row]
    bends = np.array([row["bend_deg"] for row in seen])
    way = 1.0 if len(bends) and bends[0] < target_deg else -1.0
    held = _last_hold(seen)
    return {
        "settled": motion.settled,
        "iterations": motion.pulses,
        "iterations_to_band": _pulses_to_band(seen, band_deg),
        "final_error_deg": float(target_deg - bends[-1]) if len(bends) else math.nan,
        "overshoot_deg": max(0.0, float((way * (bends - target_deg)).max())) if len(bends) else math.nan,
        "hold_error_deg": float(np.abs([row["error_deg"] for row in held]).mean()) if held else math.nan,
        "bench_time_s": motion.ended - motion.began,
        "end_reason": motion.reason,
    }


def tracking_figures(motion: Motion) -> dict[str, Any]:
    """Figures of a tracked trajectory: errors against the target of the frame's own time.

    motion : that has ended
    """
    errors = np.array([row["error_deg"] for row in motion.rows if "error_deg" in row])
    return {
        "settled": motion.settled,
        "iterations": motion.pulses,
        "final_error_deg": float(errors[-1]) if len(errors) else math.nan,
        "overshoot_deg": float(np.abs(errors).max()) if len(errors) else math.nan,
        "rms_error_deg": float(np.sqrt(np.mean(errors**2))) if len(errors) else math.nan,
        "bench_time_s": motion.ended - motion.began,
        "end_reason": motion.reason,
    }


def _pulses_to_band(rows: list[dict[str, Any]], band_deg: float) -> int | None:
    """Pulses given when the angle was first in the band with the pump standing."""
    inside = (row["pulses"] for row in rows if abs(row["error_deg"]) <= band_deg and not row["direction"])
    return next(inside, None)


def _last_hold(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of the hold at the end of a settled motion."""
    held: list[dict[str, Any]] = []
    for row in reversed(rows):
        if row["note"] not in HOLD_NOTES:
            break
        held.append(row)
    return held
