"""What a `bend` leaves behind: run.toml, bend.csv, summary.json, the picture, and its exit code."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tubefoot.cli.bend_plan import BendPlan
    from tubefoot.control.loop import Motion
    from tubefoot.lab.settings import RigSettings
    from tubefoot.records import Run
    from tubefoot.twin.bench_settings import BenchSettings


def begin_record(
    out: Path,
    plan: BendPlan,
    rig: RigSettings,
    bench: BenchSettings | None,
    seed: int | None,
    population: int | None = None,
) -> Run:
    """The run's record, begun.

    out : its directory; plan : of the motions; rig : settings
    bench : the virtual bench, None for the real one; seed : of what is random on it
    population : seed by which that bench was drawn
    """
    from tubefoot.records import Run

    resolved: dict[str, Any] = {
        "sim": bench is not None,
        "controller": plan.name,
        "targets_deg": plan.targets,
        "bend": plan.settings.model_dump(mode="json"),
        "rig": rig.model_dump(mode="json"),
        "population": population,
    }
    if bench is not None:
        resolved["bench"] = bench.model_dump(mode="json")
    return Run(out, "bend", resolved, seed=seed)


def finish_record(
    run: Run, plan: BendPlan, motions: list[Motion], rig: RigSettings, seed: int | None
) -> dict[str, Any]:
    """The summary, after everything is written.

    run : its record; plan, motions : what was to be done, and what came of it
    rig : settings; seed : of the virtual bench
    """
    from tubefoot.control.trace import COLUMNS
    from tubefoot.records import write_json, write_table
    from tubefoot.report.bending import draw_bending

    rows = [row for motion in motions for row in motion.rows]
    extra = [key for key in (rows[-1] if rows else {}) if key not in COLUMNS]
    write_table(run.path("bend.csv"), rows, [*COLUMNS, *extra])
    summary = _summary(plan, motions, rig, seed)
    write_json(run.path("summary.json"), summary)
    draw_bending(run.directory)
    run.finish()
    return summary


def _summary(plan: BendPlan, motions: list[Motion], rig: RigSettings, seed: int | None) -> dict[str, Any]:
    import numpy as np

    from tubefoot.control.trace import step_figures, tracking_figures
    from tubefoot.control.trajectory import flow_needed
    from tubefoot.units import DEG, ML

    if plan.trajectory is None:
        target = plan.targets[0]
        summary = {"target_deg": target, "controller": plan.name, "seed": seed}
        band = plan.settings.goal.band_deg
        summary |= step_figures(motions[0], target, band)
        if len(motions) > 1:
            summary["return"] = {"target_deg": 0.0, **step_figures(motions[1], 0.0, band)}
        return summary
    needed = flow_needed(plan.law, plan.trajectory, plan.settings.tracking.ahead_s)
    summary = {"target_deg": float(np.abs(plan.trajectory.bends).max()) / DEG, "controller": plan.name}
    summary |= {"seed": seed, **tracking_figures(motions[0])}
    pump = rig.pump
    flow = min(pump.forward.flow_ml_per_s, pump.reverse.flow_ml_per_s)
    most = float(np.abs(needed).max()) / ML
    summary |= {"flow_needed_ml_per_s": most, "flow_of_pump_ml_per_s": flow, "within_pump_flow": most <= flow}
    return summary


def raise_for(motion: Motion) -> None:
    """Raise the error that an unsettled motion stands for, for the exit code.

    motion : the last one
    """
    from tubefoot.errors import ConvergenceError, LinkError, SafetyStop

    if motion.settled:
        return
    if motion.reason.startswith("interrupted"):
        raise KeyboardInterrupt
    if motion.reason.startswith("link lost"):
        raise LinkError(motion.reason)
    if motion.reason.startswith(("safety stop", "board fault", "no answer", "leak", "blind")):
        raise SafetyStop(motion.reason)
    raise ConvergenceError(motion.reason)
