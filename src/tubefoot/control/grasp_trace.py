"""One row of a grasp's trace: what was seen, what the protocol made of it, what was done."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from tubefoot.control.grasp_contract import Decision, GripView
from tubefoot.control.grasp_protocol import GraspProtocol
from tubefoot.lab.rig import Reading
from tubefoot.units import DEG, KPA, ML
from tubefoot.vision.finger import FingerReading

SIDES = ("right", "left")
SENSES = (1.0, -1.0)
"""Inward over the angle in the picture: the right finger bends inward to the left, the left one to the
right."""


def trace_row(
    view: GripView,
    readings: Sequence[FingerReading | None],
    samples: Sequence[Reading],
    protocol: GraspProtocol,
    command: str,
) -> dict[str, Any]:
    """Columns of both fingers; angles inward positive.

    view : of this frame; readings : the newest of each finger; samples : of one or two rigs
    protocol : after it has decided; command : what was done, see `command_of`
    """
    row: dict[str, Any] = {"phase": protocol.phase}
    outcome = protocol.outcome
    for side, name in enumerate(SIDES):
        finger, reading = view.fingers[side], readings[side]
        sample = samples[min(side, len(samples) - 1)]
        shape, pressure = protocol.lags[side]
        row |= {
            f"bend_{name}_deg": finger.bend / DEG,
            f"theta1_{name}_deg": finger.theta1 / DEG,
            f"theta2_{name}_deg": finger.theta2 / DEG,
            f"theta1_chord_{name}_deg": _chord(reading, 0, SENSES[side]),
            f"theta2_chord_{name}_deg": _chord(reading, 1, SENSES[side]),
            f"pressure_in_{name}_kpa": finger.pressures[0] / KPA,
            f"pressure_out_{name}_kpa": finger.pressures[1] / KPA,
            f"pumped_volume_{name}_ml": sample.pumped_volume / ML,
            f"direction_{name}": sample.direction,
            f"shape_lag_{name}_deg": shape / DEG,
            f"pressure_lag_{name}_deg": pressure / DEG,
            f"touching_{name}": int(protocol.touching[side]),
            f"force_{name}_n": outcome.grip_force[side],
        }
    row["inward_pulses"], row["outward_pulses"] = outcome.inward_pulses, outcome.outward_pulses
    row["command"] = command
    return row


def command_of(decision: Decision, sent: bool) -> str:
    """What a row says was done.

    decision : of the protocol; sent : whether its pulses were
    """
    if decision.request:
        return decision.request
    if any(decision.pulses):
        return "pulse" if sent else "held back"
    return "wait"


def _chord(reading: FingerReading | None, half: int, sense: float) -> float:
    if reading is None:
        return math.nan
    return sense * (reading.theta2_chord if half else reading.theta1_chord) / DEG
