"""The virtual bench: speed against real time by what is in the loop, and the liquid it keeps.

python -m benchmarks twin
"""

from __future__ import annotations

import resource
import time

import cv2
import numpy as np

from benchmarks.row import Row
from tubefoot.lab.sensing import measure_neutral
from tubefoot.twin.bench import BoardKind, VirtualBench
from tubefoot.units import DEG
from tubefoot.vision.finger import FingerTracker

SIMULATED_S = 30.0
CASES: tuple[tuple[str, BoardKind, float | None], ...] = (
    ("samples", "native", 20.0),
    ("angles", "native", 20.0),
    ("samples", "simavr", None),
    ("frames", "native", None),
    ("frames", "simavr", 3.0),
    ("tracked frames", "simavr", None),
)
"""What is read, on which board, and the target as a multiple of real time."""


def run() -> list[Row]:
    cv2.setNumThreads(1)
    return [*(row for case in CASES for row in _speed(*case)), _liquid()]


def _speed(what: str, board: BoardKind, target: float | None) -> list[Row]:
    """Half a minute with a short pulse either way every second, as a controller would have it."""
    before = _ended_children_cpu()
    with VirtualBench(board=board) as bench:
        tracker = FingerTracker(bench.calibration, bench.layout)
        bench.rig.connect()
        measure_neutral(bench.rig, 0.5)
        bench.camera.open()
        bench.angles.open()
        wall, cpu, errors = time.perf_counter(), time.process_time(), []
        start = bench.clock.now()
        next_pulse, direction, pictures, marks = start, 1, 0, []
        while bench.clock.now() - start < SIMULATED_S:
            if bench.clock.now() >= next_pulse:
                marks.append((bench.clock.now(), time.perf_counter()))
                bench.rig.pulse(direction, 0.6, 0.15)
                next_pulse, direction = next_pulse + 1.0, -direction
            if what == "samples":
                bench.rig.wait(0.05)
                continue
            if what == "angles":
                bench.angles.read()
            else:
                frame = bench.camera.read()
                if what == "tracked frames":
                    reading = tracker.measure(frame.picture, frame.time_s)
                    errors.append(abs(reading.bend - bench.truth().bend) / DEG)
            pictures += 1
            bench.rig.wait(0.0)
        passed = bench.clock.now() - start
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    simulator = _ended_children_cpu() - before
    share = passed / (cpu + simulator)
    simulated, taken = np.diff(marks, axis=0).T
    best = float((simulated / taken).max())  # of a machine with other work, the least disturbed one
    note = (
        f"CPU a simulated second {1e3 * cpu / passed:.0f} ms, chip {1e3 * simulator / passed:.0f} ms: "
        f"{share:.1f} x real time by CPU; best second {best:.1f} x; {pictures / passed:.1f} pictures/s"
    )
    if errors:
        note += f"; angle off by {np.median(errors):.3f} deg in the median, latency included"
    return [
        Row(
            f"virtual bench, {what}, {board}",
            passed / wall,
            target if target is not None else 1.0,
            "target" if target is not None else "real time",
            passed / wall / target if target is not None else passed / wall,
            "x real time",
            note,
        )
    ]


def _ended_children_cpu() -> float:
    """CPU time of the processes that have ended, the simulated chip's among them [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _liquid() -> Row:
    """Ten minutes of pulses: what the bookkeeping of the liquid is off by."""
    with VirtualBench(board="native") as bench:
        bench.rig.connect()
        for _ in range(600):
            bench.rig.pulse(-1 if bench.rig.read().pressures[0] > 0 else 1, 0.7, 0.2)
            bench.rig.wait(1.0)
        error, turned = bench.plant.hydraulics.liquid_error, bench.plant.pump.turned
    note = f"after {turned * 1e-3:.0f} ml pumped to and fro in 600 simulated s; 1 mm^3 is a microlitre"
    return Row("liquid gained or lost", float(np.abs(error)), 0.0, "nothing", None, "mm^3", note)
