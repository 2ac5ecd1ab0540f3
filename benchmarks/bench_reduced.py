"""The reduced finger and its MuJoCo chain: cost of an answer and of a step, as a multiple of real time.

python -m benchmarks reduced
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mujoco
import numpy as np

from benchmarks.row import Row
from tubefoot.reduced.files import reference_file, reference_finger
from tubefoot.reduced.relaxation import RelaxingFinger
from tubefoot.twin.finger import SimulatedFinger

STEP_S = 1e-3
REPEATS = 5
PASSES = 4000


def run() -> list[Row]:
    finger, prony = reference_finger(), reference_file().to_prony()
    angles, pressures = np.full(12, 0.04), np.array([0.02, -0.03])
    wall = RelaxingFinger(finger, prony)
    chain = SimulatedFinger(finger, prony)
    chain.advance(0.02, -0.03, STEP_S)
    chain.volumes(0.02, -0.03, STEP_S)
    costs = {
        "answer of 12 units, NumPy": lambda: finger.respond(angles, pressures),
        "answer of 12 units with memory, NumPy": lambda: wall.respond(angles, pressures, STEP_S),
        "volumes of 12 units with memory, compiled": lambda: chain.volumes(0.02, -0.03, STEP_S),
        "one step of MuJoCo alone, 12 hinges": lambda: mujoco.mj_step(chain.model, chain.data),
    }
    rows = [Row(name, _cost_us(call), None, "", None, "us", "CPU, best of 5") for name, call in costs.items()]
    chain.reset()
    step = _cost_us(lambda: chain.advance(0.02, -0.03, STEP_S))
    real_time = STEP_S * 1e6
    rows.append(
        Row(
            "step of 1 ms: law, memory, MuJoCo",
            step,
            real_time,
            "real time",
            real_time / step,
            "us",
            "CPU, best of 5; hydraulics and camera not included",
        )
    )
    return rows


def _cost_us(call: Callable[[], object]) -> float:
    """Least mean CPU time of a call [us]."""
    best = np.inf
    for _ in range(REPEATS):
        started = time.process_time()
        for _ in range(PASSES):
            call()
        best = min(best, (time.process_time() - started) / PASSES)
    return 1e6 * best
