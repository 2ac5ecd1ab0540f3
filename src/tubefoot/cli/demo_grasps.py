"""The demo's grasps: tofu and blueberry in both poses on the virtual gripper, and the claims they decide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage, Tell
    from tubefoot.study.claims import Claim

OBJECTS: tuple[Literal["tofu", "blueberry"], ...] = ("tofu", "blueberry")
POSES: tuple[Literal["front", "side"], ...] = ("front", "side")
COST_S, QUICK_COST_S = 40.0, 13.0
"""One grasp with firmware binary and frames, and without [s of one core]."""
BENCH_TIME_S = 36.0
"""About how long a grasp takes on the bench's clock [s]."""


def grasp_stages(quick: bool) -> list[Stage]:
    """One stage a grasp.

    quick : angles without pixels and the firmware's native core
    """
    return [_stage(what, pose, quick) for what in OBJECTS for pose in POSES]


def judge_grasps(root: Path) -> list[Claim]:
    """C13, C14 and C15 by the demo's grasps; none where they were not run.

    root : directory of the runs
    """
    from tubefoot.study.grasp_claims import GraspRecord, judge_curved, judge_gentleness, judge_planar

    runs = {
        f"{what}-{pose}": GraspRecord(root / f"grasp-{what}-{pose}") for what in OBJECTS for pose in POSES
    }
    if not all((run.directory / "summary.json").exists() for run in runs.values()):
        return []
    return [
        judge_planar(runs["tofu-front"], runs["tofu-side"]),
        replace(
            judge_curved(runs["blueberry-front"], runs["blueberry-side"]),
            figure="plane-grasp-blueberry-front",
        ),
        judge_gentleness(runs),
    ]


def _stage(what: str, pose: Literal["front", "side"], quick: bool) -> Stage:
    from tubefoot.cli.demo_stages import Stage

    def run(directory: Path, tell: Tell) -> None:
        from tubefoot.cli.grasp import simulated_grasp
        from tubefoot.cli.grasp_stage import VirtualGrasp
        from tubefoot.control.grasp_settings import GraspSettings
        from tubefoot.lab.grasp_object import known_object
        from tubefoot.lab.settings import RigSettings
        from tubefoot.twin.bench_settings import BenchSettings
        from tubefoot.twin.gripper_scene import GripperMake

        if (directory / "run.toml").exists():
            return
        thing, benches = known_object(what), (BenchSettings(), BenchSettings())
        virtual = VirtualGrasp(benches, GripperMake(), thing.friction, quick=quick)

        def say(line: str) -> None:
            passed = float(line.split()[0]) if line.split()[0].replace(".", "").isdigit() else 0.0
            tell(min(passed / BENCH_TIME_S, 1.0), line)

        simulated_grasp(thing, pose, GraspSettings(), RigSettings(), virtual, directory, say)

    return Stage(f"grasp-{what}-{pose}", QUICK_COST_S if quick else COST_S, run)
