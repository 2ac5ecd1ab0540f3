"""The demo's closed loop: to 30 deg and back with the paper's controller and ours, on the virtual bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage, Tell
    from tubefoot.study.claims import Claim

TARGET_DEG = 30.0
PAPER, OURS, OURS_BACKWARD = "bend-paper", "bend-adaptive", "bend-adaptive-reversed"
CASES = {
    PAPER: ("paper", TARGET_DEG),
    OURS: ("adaptive", TARGET_DEG),
    OURS_BACKWARD: ("adaptive", -TARGET_DEG),
}
"""Directory of each run: controller and target [deg]."""
BENCH_TIME_S = {"paper": 24.0, "adaptive": 13.0}
"""About how long there and back takes on the bench's clock [s]."""
COST, QUICK_COST = 1.4, 0.4
"""Of a second on that clock, with firmware binary and frames, and without [s of one core]."""


def bending_stages(quick: bool) -> list[Stage]:
    """One stage a run; only the paper's controller has the firmware binary and frames, and not with `quick`.

    quick : angles without pixels and the firmware's native core throughout
    """
    return [_stage(name, quick or name != PAPER) for name in CASES]


def judge_bending(root: Path) -> list[Claim]:
    """C5, C10, C11 and C12 on the virtual bench; none where it was not run.

    root : directory of the runs
    """
    from tubefoot.study.bench_claims import (
        BendRecord,
        judge_bench_pressures,
        judge_bench_reversal,
        judge_columns,
        judge_tracking,
    )

    runs = {name: BendRecord(root / name) for name in CASES}
    if not all((run.directory / "summary.json").exists() for run in runs.values()):
        return []
    return [
        judge_bench_pressures(runs[PAPER]),
        judge_bench_reversal(runs[OURS], runs[OURS_BACKWARD]),
        judge_tracking(runs[PAPER]),
        judge_columns(runs[PAPER]),
    ]


def _stage(name: str, quick: bool) -> Stage:
    from tubefoot.cli.demo_stages import Stage

    controller, target_deg = CASES[name]
    lasts = BENCH_TIME_S[controller]

    def run(directory: Path, tell: Tell) -> None:
        from tubefoot.cli.bench import recording_path
        from tubefoot.cli.bend_gauge import gauge_line
        from tubefoot.cli.bend_plan import BendPlan
        from tubefoot.cli.bend_record import begin_record, finish_record
        from tubefoot.cli.bend_stage import virtual_stage
        from tubefoot.control.loop import Motion
        from tubefoot.lab.settings import RigSettings
        from tubefoot.twin.bench_settings import BenchSettings

        if (directory / "run.toml").exists():
            return
        plan = BendPlan.made(controller, target_deg, True, None, None, None)
        rig, make = RigSettings(), BenchSettings()
        record = begin_record(directory, plan, rig, make, 0)
        motions: list[Motion] = []
        due = 0.0

        def watch(row: dict[str, Any]) -> None:
            nonlocal due
            passed = row["time_s"] + (motions[0].ended - motions[0].began if motions else 0.0)
            if passed >= due:
                due = passed + 2.0
                tell(min(passed / lasts, 1.0), gauge_line(row))

        with virtual_stage(rig, recording_path(record.directory), 0, make, quick, False) as stage:
            plan.carry_out(stage, rig, motions, watch)
        finish_record(record, plan, motions, rig, 0)

    return Stage(name, lasts * (QUICK_COST if quick else COST), run)
