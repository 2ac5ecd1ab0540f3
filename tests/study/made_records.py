"""Candidates evaluated by formula in place of a solve, in this process: to test what surrounds the solver."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import GeometryError
from tubefoot.records import write_json
from tubefoot.study.crew import CrewSettings
from tubefoot.study.evaluation import RECORD, Job, finished
from tubefoot.study.figures_of_merit import design_figures

CALLS: list[Job] = []
"""Jobs that were evaluated, not those that were found done."""


def made_record(job: Job) -> dict[str, Any]:
    """A record whose figures are smooth in the dimensions; a coarse look sees all of them 20 % off."""
    if (found := finished(job)) is not None:
        return found
    CALLS.append(job)
    try:
        design = FingerDesign.model_validate(job.design)
        record = _figures(job, design)
    except (GeometryError, ValidationError) as error:
        record = {"status": "impossible", "reason": str(error), "rule_violation": 0.5, "core_s": 0.0}
    write_json(job.folder / RECORD, record)
    return record


def _figures(job: Job, design: FingerDesign) -> dict[str, Any]:
    bellows = design.bellows
    off = 1.2 if job.solve["element_size_mm"] > 3.0 else 1.0
    gain = off * 0.1 * bellows.fold_run_mm / bellows.fold_wall_mm**1.5 / 3 * bellows.units
    stress = off * 10.0 * job.angle_deg / bellows.units * bellows.partition_mm**-0.5 * bellows.fold_wall_mm
    return {
        "status": "solved",
        "reason": "goal reached",
        "core_s": 2.0,
        **design_figures(design, job.max_slenderness),
        "bend_deg_at_35kpa": 35 * gain,
        "gain_deg_per_kpa": gain,
        "pumped_volume_ml": gain,
        "von_mises_p99_kpa": 3 * stress,
        "von_mises_p99_at_angle_kpa": stress,
        "stress_concentration": 5.0 / bellows.partition_mm,
        "seam_s33_p99_kpa": 300.0 / bellows.partition_mm,
        "end_pressure_right_kpa": 35.0,
        "end_bend_deg": 35 * gain,
    }


class InlineCrew:
    """One worker in this process that returns the newest job first, unlike any order of asking."""

    threads = 1

    def __init__(self, settings: CrewSettings, function: Callable[[Any], Any]):
        self.function = function
        self.waiting: list[Any] = []

    def __enter__(self) -> InlineCrew:
        return self

    def __exit__(self, *error: object) -> None:
        self.waiting.clear()

    @property
    def under_way(self) -> int:
        return len(self.waiting)

    def work_through(self, jobs: Iterator[Any]) -> Iterator[tuple[Any, Any]]:
        while True:
            while self.under_way < 3 and (job := next(jobs, None)) is not None:
                self.waiting.append(job)
            if not self.waiting:
                return
            job = self.waiting.pop()
            yield job, self.function(job)


def study_table(root: Path, **tables: Any) -> dict[str, Any]:
    """A study of two ranges around the reference finger."""
    return {
        "name": root.name,
        "fix": {"valley_outside_mm": 6.0},
        "vary": {
            "fold_run_mm": {"low": 3.0, "high": 6.0, "count": 4},
            "partition_mm": {"low": 1.5, "high": 3.0, "count": 3},
        },
        **tables,
    }
