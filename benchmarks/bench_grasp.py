"""Grasping: speed of the virtual gripper against real time, and a few of the random grasps and free closings.

`python -m benchmarks grasp` runs these; all 200 of each, in tables that are resumed, are
`python -m benchmarks.grasp_population` (see there). Seconds are CPU seconds of one core.
"""

from __future__ import annotations

import time
from typing import Any

from benchmarks.grasp_population import SLIP_MM, run_trial
from benchmarks.row import Row
from tubefoot.lab.grasp_object import GraspObject, known_object
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.gripper_bench import NATIVE_STEP_S, GripperBench
from tubefoot.twin.gripper_scene import GripperMake
from tubefoot.twin.held_object import HeldObject
from tubefoot.twin.plant import PumpDrive

FEW = 10
DUTY, HELD_S = 0.6, 10.0
COURSE = ((-1, 0.3, 5), (1, 0.15, 13))
"""Direction, duration [s] and number of pulses: out, and in until the object is gripped."""
RIGID_TARGET, DEFORMABLE_TARGET = 15.0, 5.0
"""Times real time that the issue asks for."""


def run() -> list[Row]:
    """Speeds, then what a few trials came to."""
    cube = known_object("tofu")
    cases = (
        ("gripper, rigid sphere", known_object("blueberry"), RIGID_TARGET),
        ("gripper, rigid cube", cube.model_copy(update={"deformable": False}), RIGID_TARGET),
        ("gripper, deformable cube", cube, DEFORMABLE_TARGET),
    )
    rows = []
    for name, what, target in cases:
        speed = twin_speed(what)
        note = "fluid, fingers, object; no host; out, in, 10 s of hold"
        rows.append(Row(name, speed, target, "target", speed / target, "x real time", note))
    return [*rows, *few_trials()]


def twin_speed(what: GraspObject) -> float:
    """Bench time over CPU time of a grasp of an object by a given course of pulses, boards and host left out.

    what : the object
    """
    bench = GripperBench(HeldObject(what, "front", 0.8), (BenchSettings(),), GripperMake(), board="native")
    with bench:
        _pass(bench, 0, 0.1)
        began, start = time.process_time(), bench.plants[0].time
        for direction, lasting, count in COURSE:
            if direction > 0:
                bench.gripper.place((0.0, 0.0, 70.0))
            for _ in range(count):
                _pass(bench, direction, lasting)
                _pass(bench, 0, 0.5)
        bench.gripper.release()
        _pass(bench, 0, HELD_S)
        right, left = bench.gripper.touches()
        assert min(right.normal, left.normal) > 0.0, (
            "the object was lost: the speed is that of an empty gripper"
        )
        return (bench.plants[0].time - start) / (time.process_time() - began)


def few_trials() -> list[Row]:
    """The first grasps and free closings of the population."""
    grasps = [run_trial(trial) for trial in range(FEW)]
    closings = [run_trial(trial, free=True) for trial in range(FEW)]
    firm = [row for row in grasps if row["friction"] >= 0.4]
    latencies = [
        row[key] for row in grasps for key in ("latency_right", "latency_left") if row.get(key) is not None
    ]
    speed = _sum(grasps, "bench_time_s") / _sum(grasps, "cpu_s")
    held = sum(row["success"] for row in firm)
    early = sum(0 <= latency <= 1 for latency in latencies)
    false = sum(row.get("false_contacts", 0) > 0 for row in closings)
    return [
        Row(f"held, slip below {SLIP_MM:g} mm, friction >= 0.4", held, len(firm), "grasps", None, ""),
        Row("contact found within one pulse", early, len(latencies), "contacts", None, ""),
        Row("false contacts", false, len(closings), "free closings", None, ""),
        Row(
            "whole chain, firmware's core",
            speed,
            None,
            "",
            None,
            "x real time",
            "host, boards, angles, gripper",
        ),
    ]


def _pass(bench: GripperBench, direction: int, seconds: float) -> None:
    """Let time pass for the plants alone with both pumps driven."""
    drive = PumpDrive(direction, DUTY if direction else 0.0)
    for _ in range(round(seconds / NATIVE_STEP_S)):
        for plant in bench.plants:
            plant.step(NATIVE_STEP_S, drive)


def _sum(rows: list[dict[str, Any]], key: str) -> float:
    return sum(float(row.get(key, 0.0)) for row in rows)
