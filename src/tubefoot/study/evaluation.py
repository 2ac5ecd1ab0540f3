"""One job of a study: solve a candidate in a folder of its own, and read its figures.

The folder appears under its name, the candidate's hash, only when it is whole; until then it is `HASH.part`,
where a job that is run again goes on at the last converged state. What a job gets and returns is small and
plain, for it travels between machines.
"""

from __future__ import annotations

import fcntl
import json
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tubefoot.config import parse_settings
from tubefoot.design.finger import Bellows, FingerDesign
from tubefoot.design.hardware import Ports
from tubefoot.design.profile import Profile
from tubefoot.design.rules import broken, geometry_rules
from tubefoot.errors import ConfigError, ConvergenceError, GeometryError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.solve import solve_design
from tubefoot.records import write_json
from tubefoot.study.figures_of_merit import design_figures, solve_figures, violation

Row = dict[str, Any]

RECORD = "candidate.json"


@dataclass(frozen=True)
class Job:
    """What a worker needs to evaluate a candidate.

    name, key : of the candidate; root : directory of all folders, seen by every worker
    design, solve : tables; angle_deg, max_slenderness, solve_unprintable : of the ranking
    keep_states : whether the states stay on disk
    """

    name: str
    key: str
    root: str
    design: dict[str, Any]
    solve: dict[str, Any]
    angle_deg: float
    max_slenderness: float
    solve_unprintable: bool
    keep_states: bool

    @property
    def folder(self) -> Path:
        """Where the result lies; two digits of the hash spread folders over 256 directories."""
        return Path(self.root) / self.key[:2] / self.key


def finished(job: Job) -> Row | None:
    """The record of a job that was done before, None where there is none.

    job : which
    """
    try:
        return json.loads((job.folder / RECORD).read_text())
    except FileNotFoundError:
        return None


def evaluate(job: Job) -> Row:
    """The record of a candidate: status, reason, figures, seconds of one core.

    job : what to do; one that was done before is only read

    `status` is solved (35 kPa were reached), early (the path ended before, at a physical limit), failed (no
    convergence), unprintable (not solved) or impossible (the dimensions make no finger).
    """
    if (record := finished(job)) is not None:
        return record
    part = job.folder.with_name(f"{job.key}.part")
    part.mkdir(parents=True, exist_ok=True)
    with _alone(job.folder.with_name(f"{job.key}.lock")):
        if (record := finished(job)) is not None:
            return record
        record = _evaluated(job, part)
        if not job.keep_states:
            shutil.rmtree(part / "states", ignore_errors=True)
        write_json(part / RECORD, record)
        part.replace(job.folder)
    return record


def _evaluated(job: Job, part: Path) -> Row:
    started = time.process_time()
    try:
        design = FingerDesign.model_validate(job.design)
    except (GeometryError, ValidationError, ConfigError) as error:
        return {
            "status": "impossible",
            "reason": _reason(error),
            "rule_violation": _how_impossible(job),
            "core_s": 0.0,
        }
    figures = design_figures(design, job.max_slenderness)
    if not figures["printable"] and not job.solve_unprintable:
        return {"status": "unprintable", "reason": figures["broken_rules"], "core_s": 0.0, **figures}
    settings = parse_settings(job.solve, SolveSettings, source="solve")
    before = _spent_before(part)
    try:
        status, reason = "solved", solve_design(design, part, settings).summary["end_reason"]
    except ConvergenceError as error:
        status, reason = "failed", str(error)
    except GeometryError as error:
        spent = time.process_time() - started
        return {"status": "impossible", "reason": str(error), "core_s": spent, **figures}
    figures |= solve_figures(part, job.angle_deg)
    if status == "solved" and "bend_deg_at_35kpa" not in figures:
        status = "early"
    core_s = before + time.process_time() - started
    return {"status": status, "reason": reason, "core_s": core_s, **figures}


def _spent_before(part: Path) -> float:
    """Processor time that a killed job spent on its converged states [s]."""
    marker = part / "states/key.json"
    return float(json.loads(marker.read_text()).get("cpu_s", 0.0)) if marker.exists() else 0.0


def _reason(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return "; ".join(f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors())
    return str(error)


def _how_impossible(job: Job) -> float:
    """Sum of the broken geometry rules as shares of their limits; 1 where not even a profile can be drawn."""
    try:
        profile = Profile.of(Bellows.model_validate(job.design["bellows"]))
        faults = broken(geometry_rules(profile, Ports.model_validate(job.design["ports"])))
    except (ValueError, ZeroDivisionError):
        return 1.0
    return violation(faults) or 1.0


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """A lock that another job for the same folder waits for; a worker that is killed lets go of it.

    On a file system without locks two workers could solve one candidate; the folders they make are equal.
    """
    with path.open("w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
    path.unlink(missing_ok=True)
