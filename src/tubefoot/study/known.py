"""What is known of each candidate: its job, and its record by a full solve or by the calibrated look."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.records import Run
from tubefoot.study.candidates import Candidate, candidates_of, column_names, shown_values
from tubefoot.study.evaluation import Job, finished
from tubefoot.study.figures_of_merit import design_figures
from tubefoot.study.look import LOOKED, Calibration, look_solve, looked_figures, short_candidate
from tubefoot.study.study_file import StudyFile

Row = dict[str, Any]


@dataclass
class Tally:
    """How far a stage is.

    stage : what is done; total : candidates in it; found : those finished by an earlier run
    counts : by status; core_s : spent on all of them, by earlier runs too
    """

    stage: str
    total: int
    found: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    core_s: float = 0.0
    under_way: int = 0

    @property
    def done(self) -> int:
        """Candidates with a result."""
        return sum(self.counts.values())


Progress = Callable[[Tally, Row], None]


class Known:
    """One study in one directory, and what was evaluated of it."""

    verb = "screen"

    def __init__(
        self, study: StudyFile, base: FingerDesign, directory: Path | str, progress: Progress | None = None
    ):
        """Nothing is solved yet.

        study : the study; base : its base design; directory : of the results; progress : told of each result
        """
        self.study, self.base = study, base
        settings = {"study": study.model_dump(mode="json"), "base": base.model_dump(mode="json")}
        self.run = Run(directory, self.verb, settings)
        self.progress = progress or (lambda tally, row: None)
        self.columns = column_names(study)
        self.calibration: Calibration | None = None

    def candidates(self) -> Iterator[Candidate]:
        """All candidates, in their order."""
        return candidates_of(self.study, self.base)

    def job(self, candidate: Candidate, solve: SolveSettings, units: int | None = None) -> Job:
        """The job that evaluates a candidate.

        candidate : which; solve : how; units : of the whole finger, where the candidate is its short stand-in
        """
        share = candidate.tables["bellows"]["units"] / units if units else 1.0
        rank = self.study.rank
        return Job(
            candidate.name,
            candidate.key(solve),
            str(self.run.directory.resolve() / "designs"),
            candidate.tables,
            solve.model_dump(mode="json"),
            rank.angle_deg * share,
            rank.max_slenderness,
            rank.solve_unprintable,
            self.study.keep_states,
        )

    def look_job(self, candidate: Candidate, solve: SolveSettings) -> Job:
        """The job that looks at a candidate.

        candidate : the whole one; solve : of the look
        """
        return self.job(
            short_candidate(candidate, self.study.look), solve, candidate.tables["bellows"]["units"]
        )

    def look_record(self, candidate: Candidate) -> Row | None:
        """The record of a candidate's look, None where it has none.

        candidate : which
        """
        if not self.study.look.use:
            return None
        return finished(self.look_job(candidate, look_solve(self.study)))

    def looked(self, candidate: Candidate) -> np.ndarray:
        """Figures of a candidate's look, NaN where it gave none.

        candidate : which
        """
        record = self.look_record(candidate)
        if record is None or record["status"] != "solved":
            return np.full(len(LOOKED), np.nan)
        return looked_figures(record, candidate.tables["bellows"]["units"], self.study.look)

    def record(self, candidate: Candidate) -> tuple[Job, Row, str]:
        """Job, record and source (full, look, none) of a candidate: the full solve where there is one.

        candidate : which
        """
        job = self.job(candidate, self.study.solve)
        if (record := finished(job)) is not None:
            return job, record, "full"
        if self.calibration is not None:
            look = self.look_job(candidate, look_solve(self.study))
            if (record := self.look_record(candidate)) is not None:
                return look, self.foretold(candidate, record), "look"
        return (
            job,
            {"status": "error", "reason": "the job broke off; run the study again", "core_s": 0.0},
            "none",
        )

    def foretold(self, candidate: Candidate, record: Row) -> Row:
        """A record as a full solve would give it.

        candidate : whose; record : of its look
        """
        if record["status"] in ("impossible", "unprintable", "error"):
            return record
        assert self.calibration is not None
        whole = design_figures(FingerDesign.model_validate(candidate.tables), self.study.rank.max_slenderness)
        lengths = whole["units"] / self.study.look.units
        kept = {key: record[key] for key in ("status", "reason", "core_s", "end_pressure_right_kpa")}
        kept["end_bend_deg"] = lengths * record["end_bend_deg"]
        if record["status"] != "solved":
            return {**kept, **whole}
        looked = looked_figures(record, whole["units"], self.study.look)
        return {**kept, **whole, **self.calibration.foretell(whole["units"], looked)}

    def row(self, candidate: Candidate, job: Job, record: Row, source: str) -> Row:
        """A row of the table, not ranked yet.

        candidate : whose; job, record, source : as `record` gives them
        """
        return {
            **record,
            **shown_values(candidate, self.columns),
            "name": candidate.name,
            "comparison": candidate.comparison,
            "source": source,
            "folder": str(job.folder.relative_to(self.run.directory.resolve())),
        }


def record_of(outcome: Any) -> Row:
    """A job's record, or that of the error that ended it.

    outcome : a record or an exception
    """
    if isinstance(outcome, BaseException):
        return {"status": "error", "reason": f"{type(outcome).__name__}: {outcome}", "core_s": 0.0}
    return dict(outcome)
