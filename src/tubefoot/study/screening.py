"""The screening stage: every candidate evaluated, judged and ranked; what is finished is never done again.

Results lie in `designs/`, one folder a candidate. `candidates.csv` grows while they come; at the end it is
rewritten in the order of the candidates, with scores and ranks: the same whatever the workers did.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.records import write_json
from tubefoot.study.candidates import Candidate
from tubefoot.study.crew import Crew, CrewSettings
from tubefoot.study.evaluation import Job, evaluate, finished
from tubefoot.study.known import Known, Row, Tally, record_of
from tubefoot.study.look import Calibration, Pair, calibrate, look_solve, solved_figures, spread_over
from tubefoot.study.ranking import criteria_of, group_scores, objectives_of, pareto_set, ranks_of, weights_of
from tubefoot.study.study_file import number_of_candidates
from tubefoot.study.table import LiveTable, header, write_rows

BEST_ROWS = 100
"""Rows of best.csv."""


@dataclass
class ScreenResult:
    """What a screening found.

    table : path of candidates.csv; best : rows of the best candidates, best first; counts : by status
    calibration : of the look, where there was one; core_s : of all candidates
    """

    directory: Path
    table: Path
    best: list[Row]
    counts: dict[str, int]
    core_s: float
    calibration: Calibration | None = None


class Screening(Known):
    """The screening of a study."""

    @property
    def table_columns(self) -> list[str]:
        """Header of candidates.csv."""
        return header(self.columns.values())

    def screen(self, crew_settings: CrewSettings) -> ScreenResult:
        """The result of evaluating and ranking all candidates.

        crew_settings : who does the jobs

        Raises ConfigError when the base design gives no figures to compare with.
        """
        total = number_of_candidates(self.study) + 1
        total += sum(len(comparison.candidates) for comparison in self.study.comparison)
        with (
            Crew(crew_settings, evaluate) as crew,
            LiveTable(self.run.path("candidates.csv"), self.table_columns) as live,
        ):
            if self.study.look.use:
                self._look(crew, live, total)
            else:
                self.evaluate(crew, live, self.candidates(), Tally("solve", total))
        return self._ranked()

    def evaluate(self, crew: Crew, live: LiveTable, candidates: Iterator[Candidate], tally: Tally) -> None:
        """Solve candidates in full.

        crew : does it; live : takes a row as each is done; candidates : which; tally : what was done so far
        """
        named: dict[str, list[Candidate]] = {}

        def jobs() -> Iterator[Job]:
            for candidate in candidates:
                job = self.job(candidate, self.study.solve)
                if (record := finished(job)) is not None:
                    tally.found += 1
                    self._note(live, tally, candidate, job, record)
                elif job.key in named:
                    named[job.key].append(candidate)
                else:
                    named[job.key] = [candidate]
                    yield job

        for job, outcome in crew.work_through(jobs()):
            tally.under_way = min(crew.under_way, crew.threads)
            for candidate in named.pop(job.key):
                self._note(live, tally, candidate, job, record_of(outcome))

    def _note(self, live: LiveTable, tally: Tally, candidate: Candidate, job: Job, record: Row) -> None:
        row = self.row(candidate, job, record, "full")
        tally.counts[record["status"]] += 1
        tally.core_s += record["core_s"]
        live.append(row)
        self.progress(tally, row)

    def _look(self, crew: Crew, live: LiveTable, total: int) -> None:
        """Look at all candidates, solve some in full to calibrate, then the best in full."""
        tally, solve = Tally("look", total), look_solve(self.study)

        def jobs() -> Iterator[Job]:
            seen = set[str]()
            for candidate in self.candidates():
                job = self.look_job(candidate, solve)
                if (record := finished(job)) is not None or job.key in seen:
                    tally.found += record is not None
                    tally.counts[record["status"] if record else "twice"] += 1
                    tally.core_s += record["core_s"] if record else 0.0
                else:
                    seen.add(job.key)
                    yield job

        for job, outcome in crew.work_through(jobs()):
            record = record_of(outcome)
            tally.under_way = min(crew.under_way, crew.threads)
            tally.counts[record["status"]] += 1
            tally.core_s += record["core_s"]
            self.progress(tally, {"name": job.name, **record})
        bends = np.array([self.looked(candidate)[0] for candidate in self.candidates()])
        chosen = {0, *spread_over(bends, self.study.look.calibrate)}
        self.evaluate(crew, live, self._picked(chosen), Tally("calibrate", len(chosen)))
        self.calibration = self._calibrated(chosen)
        _, _, ranks = self._scores()
        order = np.argsort(np.where(ranks > 0, ranks, len(ranks) + 1), kind="stable")
        best = {int(k) for k in order[: self.study.look.confirm] if ranks[k] > 0}
        self.evaluate(crew, live, self._picked(best), Tally("confirm", len(best)))

    def _picked(self, numbers: set[int]) -> Iterator[Candidate]:
        return (candidate for k, candidate in enumerate(self.candidates()) if k in numbers)

    def _calibrated(self, chosen: set[int]) -> Calibration:
        pairs = []
        for candidate in self._picked(chosen):
            record = finished(self.job(candidate, self.study.solve))
            looked = self.looked(candidate)
            if record is not None and record["status"] == "solved" and np.isfinite(looked[0]):
                pairs.append(Pair(record["units"], looked, solved_figures(record)))
        if len(pairs) < 3:
            raise ConfigError(
                f"only {len(pairs)} of the candidates chosen to calibrate the look reach 35 kPa, 3 are "
                "needed; raise look.calibrate, narrow the ranges, or set look.use = false"
            )
        return calibrate(pairs, self.study.look)

    def _scores(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Group scores (n, 4), Pareto set (n,) and ranks (n,) of all candidates, in their order."""
        criteria, costs, eligible = [], [], []
        for candidate in self.candidates():
            _, record, _ = self.record(candidate)
            criteria.append(criteria_of(record))
            costs.append(objectives_of(record))
            eligible.append(record["status"] == "solved" and bool(record["printable"]))
        allowed = np.array(eligible)
        groups = group_scores(np.array(criteria), criteria[0])
        front = pareto_set(np.where(allowed[:, None], np.array(costs), np.nan))
        return groups, front, ranks_of(groups @ weights_of(self.study.rank), allowed)

    def _ranked(self) -> ScreenResult:
        """Rewrite the table with scores and ranks, and keep the best rows."""
        groups, front, ranks = self._scores()
        scores = groups @ weights_of(self.study.rank)
        counts: Counter[str] = Counter()
        spent: dict[str, float] = {}
        best: list[Row] = []
        last = np.sort(ranks[ranks > 0])[:BEST_ROWS].max(initial=0)

        def rows() -> Iterator[Row]:
            for k, candidate in enumerate(self.candidates()):
                job, record, source = self.record(candidate)
                row = self.row(candidate, job, record, source)
                row |= {"score": float(scores[k]), "rank": int(ranks[k]) or None, "pareto": bool(front[k])}
                counts[record["status"]] += 1
                spent[job.key] = record["core_s"]
                if source == "full" and (look := self.look_record(candidate)) is not None:
                    spent[f"look {job.key}"] = look["core_s"]
                if 0 < ranks[k] <= last:
                    best.append(row)
                yield row

        table = write_rows(self.run.path("candidates.csv"), self.table_columns, rows())
        best.sort(key=lambda row: row["rank"])
        write_rows(self.run.path("best.csv"), self.table_columns, best[:BEST_ROWS])
        core_s = sum(spent.values())
        summary: Row = {"candidates": len(ranks), "status": dict(counts), "core_hours": core_s / 3600.0}
        if self.calibration is not None:
            summary["look"] = self.calibration.summary()
        write_json(self.run.path("summary.json"), {**summary, "wall_s": self.run.wall_s})
        self.run.finish()
        return ScreenResult(
            self.run.directory, table, best[:BEST_ROWS], dict(counts), core_s, self.calibration
        )
