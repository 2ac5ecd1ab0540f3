"""The topics of a recording and their columns: one table for writer, reader and viewers."""

from __future__ import annotations

from typing import Any

BRANCH_COLUMNS = {
    f"{quantity}_{branch}_kpa": "number"
    for branch in ("right", "left", "right_2", "left_2")
    for quantity in ("pressure", "gauge")
}

TOPICS: dict[str, dict[str, str]] = {
    "samples": {
        "time_s": "number",
        **BRANCH_COLUMNS,
        "supply_v": "number",
        "direction": "integer",
        "duty": "number",
        "pumped_volume_ml": "number",
        "faults": "integer",
        "board_time_ms": "integer",
        "received_s": "number",
    },
    "commands": {
        "time_s": "number",
        "sequence": "integer",
        "attempt": "integer",
        "command": "string",
        "fields": "object",
    },
    "acknowledgements": {
        "time_s": "number",
        "sequence": "integer",
        "command_id": "integer",
        "status": "string",
        "faults": "integer",
        "board_time_ms": "integer",
    },
    "pulses": {
        "time_s": "number",
        "direction": "integer",
        "duty": "number",
        "duration_s": "number",
        "volume_ml": "number",
        "volume_sigma_ml": "number",
        "clipped": "boolean",
    },
    "pulse_ends": {"time_s": "number", "duration_s": "number", "volume_ml": "number", "reason": "string"},
    "faults": {"time_s": "number", "faults": "integer", "names": "string", "channels": "integer"},
    "neutral": {"time_s": "number", "samples": "integer"},
    "angles": {
        "time_s": "number",
        "received_s": "number",
        "bend_deg": "number",
        "sigma_deg": "number",
        "theta1_deg": "number",
        "theta2_deg": "number",
        "quality": "number",
        "fault": "string",
    },
    "decisions": {"time_s": "number", "controller": "string", "values": "object"},
    "events": {"time_s": "number", "name": "string", "detail": "object"},
    "frames": {"time_s": "number", "width": "integer", "height": "integer", "format": "string"},
}
"""Columns of each topic and their JSON types; a sample has the pressures of the channels in use."""

FRAME_SCHEMA = (
    "foxglove.CompressedImage",
    {
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
            },
            "frame_id": {"type": "string"},
            "data": {"type": "string", "contentEncoding": "base64"},
            "format": {"type": "string"},
            "time_s": {"type": "number"},
            "width": {"type": "integer"},
            "height": {"type": "integer"},
        },
    },
)
"""Name and JSON schema under which viewers know an image."""


def schema_of(columns: dict[str, str]) -> dict[str, Any]:
    """The JSON schema of a topic.

    columns : names and JSON types
    """
    return {"type": "object", "properties": {name: {"type": kind} for name, kind in columns.items()}}
