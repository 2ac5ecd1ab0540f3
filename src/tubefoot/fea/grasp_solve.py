"""The grasp stage: the finger opens, the object is put in place, the finger closes; resumable."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.fields import write_fields, write_index
from tubefoot.fea.finger_model import HALF, SolveSettings
from tubefoot.fea.grasp_model import GraspModel, build_grasp
from tubefoot.fea.grasp_rows import TOUCHING_N, GraspedFinger, judge
from tubefoot.fea.grasp_settings import GraspSettings
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.path import Path as SolvedPath
from tubefoot.fea.recorder import Progress, Recorder, SolveResult, record
from tubefoot.fea.step import Step
from tubefoot.fea.waypoints import Observer, walk
from tubefoot.records import Run, read_table, write_json
from tubefoot.units import ATMOSPHERE_MPA, ML

OPENING = 4.0
"""Longest step while the finger opens, over that while it closes."""
NEAR_MM, LEFT = 0.5, 0.3
"""Gap from which the finger closes in short steps [mm], and the share of a gap that a long one leaves."""
MODELLED_VOLUME = HALF * ML
"""From mL of the whole finger to the path parameter."""


def solve_grasp(
    design: FingerDesign,
    directory: Path | str,
    grasp: GraspSettings,
    settings: SolveSettings | None = None,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> SolveResult:
    """The result of a grasp, written to a directory; an interrupted run goes on where it was.

    Beside what a solve writes there are grasp.csv, one row a state, and object fields.

    design : the finger, both alike; directory : where the results go; grasp : the object, its place, the pump
    settings : mesh and fields; where its path ends is taken from `grasp`
    progress : called with each new state, its columns of curve.csv and grasp.csv together
    overwrite : replace the results of another run that lie in the directory

    Raises ConfigError when the object does not fit between the opened fingers or the directory holds another
    run, ConvergenceError when the path breaks off (the converged states are kept).
    """
    goal = {"until": "pumped_volume_ml", "target": grasp.states_ml[-1] or grasp.open_ml}
    settings = (settings or SolveSettings()).model_copy(update=goal)
    settled = {
        "design": design.model_dump(mode="json"),
        "solve": settings.model_dump(mode="json"),
        "grasp": grasp.model_dump(mode="json"),
    }
    run = Run(directory, "solve", settled)
    ledger = Ledger.open(run, settled, overwrite)
    if ledger.summary is not None:
        return SolveResult(run.directory, ledger.curve, ledger.regions, ledger.summary)
    subject = GraspedFinger(build_grasp(design, settings, grasp))
    walker = _Walker(subject, run, ledger, progress)
    result = record(subject, run, ledger, None, walker.walk)
    summary = {**result.summary, **grasp_summary(grasp, read_table(run.path("grasp.csv")))}
    write_json(run.path("summary.json"), summary)
    return replace(result, summary=summary)


def grasp_summary(grasp: GraspSettings, rows: list[Row]) -> dict[str, Any]:
    """Figures of a grasp for summary.json, those of the last state and the pumped volume of first contact.

    grasp : its settings; rows : of grasp.csv
    """
    last = rows[-1]
    keys = (
        "theta1_deg",
        "theta2_deg",
        "normal_force_n",
        "pressure_mean_kpa",
        "pressure_p99_kpa",
        "patch_mm2",
    )
    verdict = judge(grasp.object, last)
    return {
        **{key: last[key] for key in keys},
        "first_contact_ml": first_contact(rows),
        "damage_margin": verdict.margin,
        "damage_margin_by": verdict.by,
    }


def first_contact(rows: list[Row]) -> float | None:
    """Pumped volume at which the finger touches the object [mL], None where it does not.

    From the line through the forces of the first two states that touch, not before the last free one.

    rows : of grasp.csv
    """
    placed = [row for row in rows if row["placed"]]
    touching = [k for k, row in enumerate(placed) if row["normal_force_n"] > TOUCHING_N]
    if not touching:
        return None
    first = touching[0]
    here = float(placed[first]["pumped_volume_ml"])
    free = float(placed[first - 1]["pumped_volume_ml"]) if first else here
    if first + 1 == len(placed):
        return 0.5 * (free + here)
    rise = placed[first + 1]["normal_force_n"] - placed[first]["normal_force_n"]
    run = placed[first + 1]["pumped_volume_ml"] - here
    return (
        float(max(free, min(here, here - placed[first]["normal_force_n"] * run / rise))) if rise > 0 else here
    )


class _Walker:
    """Opens, places and closes, with every state recorded."""

    def __init__(self, subject: GraspedFinger, run: Run, ledger: Ledger, progress: Progress | None):
        self.subject, self.run, self.ledger, self.progress = subject, run, ledger, progress
        self.grasp: GraspModel = subject.grasp
        self.files = [
            (float(row["pumped_volume_ml"]), path)
            for row in ledger.further["grasp"]
            if (path := self._object_path(int(row["step"]))).exists()
        ]

    def walk(self, recorder: Recorder, known: list[Step]) -> SolvedPath:
        """The path through all stations, or up to a named end."""
        settings, model = self.grasp.settings, self.grasp.model
        stride = settings.stride_ml * MODELLED_VOLUME

        def observe(step: Step, wall_s: float) -> str | None:
            return self._observe(recorder, step, wall_s)

        path = SolvedPath(list(known))
        if not known:
            path.steps.append(Step(model.rest(), 0, 0.0, 1.0, model.rest_volumes.copy()))
            observe(path.steps[0], 0.0)
        self.subject.placed = bool(known) and bool(self.ledger.further["grasp"][-1]["placed"])
        if self.subject.placed:
            self.grasp.put_in_place()
        else:
            opened = settings.open_ml * MODELLED_VOLUME
            stop = walk(model, path, [opened], OPENING * stride, observe)
            if stop:
                path.end_reason = stop
                return path
            last = path.steps[-1]
            path.steps[-1] = replace(last, state=self.grasp.placed(last.state))
            self._require_room(path.steps[-1])
            self.subject.placed = True
        path.end_reason = self._approach(path, stride, observe) or ""
        if path.end_reason:
            return path
        done = path.steps[-1].state.parameter
        stations = [q for ml in settings.states_ml if (q := ml * MODELLED_VOLUME) > done + 1e-9]
        path.end_reason = walk(model, path, stations, stride, observe) or "grasp reached"
        return path

    def _approach(self, path: SolvedPath, stride: float, observe: Observer) -> str | None:
        """Close in long steps while the object is far; why the path ended, if it did."""
        goal = self.grasp.settings.states_ml[0] * MODELLED_VOLUME
        before: tuple[float, float] | None = None
        while True:
            here, gap = path.steps[-1].state.parameter, self.grasp.clearance(path.steps[-1].state)
            if gap < NEAR_MM:
                return None
            step = OPENING / 2.0 * stride
            if before is not None and np.isfinite(before[1]) and before[1] > gap:
                step = min(step, (1.0 - LEFT) * gap * (here - before[0]) / (before[1] - gap))
            elif np.isfinite(gap):
                step = min(step, stride)
            target = min(goal, here + step)
            if target <= here + 1e-9 * stride:
                return None
            before = (here, gap)
            if stop := walk(self.grasp.model, path, [target], OPENING * stride, observe):
                return stop

    def _require_room(self, step: Step) -> None:
        gap = self.grasp.clearance(step.state)
        if gap <= self.grasp.settings.reach_mm:
            raise ConfigError(
                f"the object does not fit between the opened fingers: they overlap by {-gap:.2f} mm "
                f"at open_ml = {self.grasp.settings.open_ml:g}; open further, or widen finger_gap_mm"
            )

    def _observe(self, recorder: Recorder, step: Step, wall_s: float) -> str | None:
        low = step.state.pressures.min()
        if low <= -ATMOSPHERE_MPA:
            return "absolute vacuum in a chamber (cavitation) before this state"
        stop = recorder(step, wall_s)
        if stop:
            return stop
        row = {**self.ledger.curve[-1], **self.ledger.further["grasp"][-1]}
        if self.subject.settings.fields != "none" and self.subject.placed and self.grasp.food is not None:
            self._write_object(row, step)
        if self.progress is not None:
            self.progress(row)
        return None

    def _object_path(self, number: int) -> Path:
        return self.run.path(f"fields/object_{number:04d}.vtu")

    def _write_object(self, row: Row, step: Step) -> None:
        assert self.grasp.food is not None
        path = self._object_path(int(row["step"]))
        mesh = self.grasp.finger.mesh
        extra = {"contact_pressure_kpa": self.grasp.contact_pressure(step.state)}
        write_fields(path, mesh, self.grasp.food, step.state, extra=extra)
        self.files.append((float(row["pumped_volume_ml"]), path))
        write_index(self.run.path("object.pvd"), self.files)
