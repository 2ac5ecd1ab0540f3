"""Session: from a camera to the rows of `angles.csv`, frame by frame, until the source ends."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from tubefoot.units import DEG
from tubefoot.vision.camera import Camera, EndOfFrames, Frame
from tubefoot.vision.columns import column_level
from tubefoot.vision.finger import FingerReading, FingerTracker

ANGLE_COLUMNS = (
    "frame",
    "time_s",
    "bend_deg",
    "theta1_deg",
    "theta2_deg",
    "theta1_chord_deg",
    "theta2_chord_deg",
    "sigma_deg",
    "theta1_sigma_deg",
    "theta2_sigma_deg",
    "inflexions",
    "quality",
    "visible_markers",
    "lost",
    "fault",
)
"""Header of `angles.csv`; a `level_NAME_mm` follows for each fluid column."""


def measured_frames(camera: Camera, tracker: FingerTracker) -> Iterator[tuple[Frame, FingerReading]]:
    """Each frame of an open camera with what was measured in it.

    camera : an open source
    tracker : measures the finger
    """
    while True:
        try:
            frame = camera.read()
        except EndOfFrames:
            return
        yield frame, tracker.measure(frame.picture, frame.time_s)


def angle_row(frame: Frame, reading: FingerReading, tracker: FingerTracker) -> dict[str, Any]:
    """One row of `angles.csv`; what is not known is an empty cell.

    frame : the frame
    reading : what was measured in it
    tracker : what measured it, for the fluid columns
    """
    line = reading.centreline
    row: dict[str, Any] = {
        "frame": frame.index,
        "time_s": frame.time_s,
        "bend_deg": reading.bend / DEG,
        "theta1_deg": reading.theta1 / DEG,
        "theta2_deg": reading.theta2 / DEG,
        "theta1_chord_deg": reading.theta1_chord / DEG,
        "theta2_chord_deg": reading.theta2_chord / DEG,
        "sigma_deg": reading.sigma / DEG,
        "theta1_sigma_deg": reading.theta_sigma[0] / DEG if math.isfinite(reading.theta1) else math.nan,
        "theta2_sigma_deg": reading.theta_sigma[1] / DEG if math.isfinite(reading.theta2) else math.nan,
        "inflexions": len(line.inflexions) if line else math.nan,
        "quality": reading.quality,
        "visible_markers": reading.visible_markers,
        "lost": reading.lost,
        "fault": reading.fault,
    }
    for column in tracker.layout.columns:
        row[f"level_{column.name}_mm"] = column_level(frame.picture, tracker.plane_map, column).level
    return {
        key: "" if isinstance(value, float) and math.isnan(value) else value for key, value in row.items()
    }
