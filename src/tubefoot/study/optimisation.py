"""The optimise stage: a first look that calibrates, the search, the front and its confirmation.

In the directory: `first/` holds the screening that calibrates the look (none where a finished one is given to
start from), `designs/` all that was evaluated, `evaluations.csv` every design of the search in the order of
asking, `front.csv` the Pareto front with its uncertainty. An interrupted search goes on: it asks again for
the same designs and finds those that were evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.config import parse_settings, read_toml
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.records import write_json
from tubefoot.study.candidates import shown_values
from tubefoot.study.crew import Crew, CrewSettings
from tubefoot.study.evaluation import evaluate
from tubefoot.study.front import Front, uncertain_front
from tubefoot.study.known import Row, Tally, record_of
from tubefoot.study.look import LOOKED, Calibration, look_solve, spread_over
from tubefoot.study.ranking import OBJECTIVES, FloatArray, objectives_of
from tubefoot.study.screening import Screening
from tubefoot.study.search import Search, Trial, run_search
from tubefoot.study.study_file import Sample, StudyFile
from tubefoot.study.table import LiveTable, header, write_rows

FIRST_LOOKS = 4
"""Designs of the first screening over those that calibrate."""
UNCERTAIN = ("probability", "gain_sd_percent", "stress_sd_percent", "confirmed")
SOROFORGE_CORE_HOURS = 304.0
"""Published cost of one front of soft actuators by finite elements (SoRoForge)."""


@dataclass
class OptimiseResult:
    """What a search found.

    table : front.csv; front : its rows; evaluated : designs of the search; core_s : of all that was solved
    look_error : ln(look / full) of gain and stress on the designs of the front that were confirmed, (n, 2)
    """

    directory: Path
    table: Path
    front: list[Row]
    evaluated: int
    core_s: float
    uncertainty: Front
    look_error: FloatArray


class Optimisation(Screening):
    """The search of one study in one directory."""

    verb = "optimise"

    def optimise(self, crew_settings: CrewSettings, warm_start: Path | None = None) -> OptimiseResult:
        """The front.

        crew_settings : who does the jobs; warm_start : directory of a finished screening of these dimensions

        Raises ConfigError when too few designs are feasible.
        """
        search = Search(self.study, self.base)
        found = self._first(warm_start).screen(crew_settings)
        self.calibration = found.calibration
        taken = search.warm_start(found.table)
        columns = ["number", *header(self.columns.values())]
        with (
            Crew(crew_settings, evaluate) as crew,
            LiveTable(self.run.path("evaluations.csv"), columns) as live,
        ):
            tally = Tally("search", self.study.search.designs)
            run_search(search, lambda trials: self._evaluations(crew, live, tally, trials))
            designs = [trial for trial in search.trials if trial.feasible]
            chosen = self._front_of(designs)
            with LiveTable(self.run.path("confirmed.csv"), header(self.columns.values())) as confirmed:
                picked = iter([trial.candidate for trial in chosen])
                self.evaluate(crew, confirmed, picked, Tally("confirm", len(chosen)))
        ordered = (self._trial_row(k, trial) for k, trial in enumerate(search.trials, 1) if trial.record)
        write_rows(self.run.path("evaluations.csv"), columns, ordered)
        own = sum(trial.record["core_s"] for trial in search.trials if trial.record)
        return self._written(designs, chosen, own, found.core_s, taken)

    def _first(self, warm_start: Path | None) -> Screening:
        """The screening that calibrates the look: the given one, or a small one of this study's ranges."""
        if warm_start is not None:
            table = read_toml(warm_start / "run.toml").get("settings", {})
            study = parse_settings(table.get("study", {}), StudyFile, source=f"{warm_start}/run.toml")
            base = parse_settings(table.get("base", {}), FingerDesign, source=f"{warm_start}/run.toml")
            if not study.look.use:
                raise ConfigError(f"{warm_start} has no first look to start from; screen it with --look")
            if _foundations(study) != _foundations(self.study):
                raise ConfigError(
                    f"{warm_start} was looked at, solved or ranked by other settings than this study; "
                    "start from a screening with the same [look], [solve] and [rank]"
                )
            look = study.look.model_copy(update={"confirm": 0})
            return Screening(study.model_copy(update={"look": look}), base, warm_start, self.progress)
        count = FIRST_LOOKS * self.study.look.calibrate
        changes: dict[str, Any] = {
            "sample": Sample(count=count, seed=self.study.search.seed),
            "look": self.study.look.model_copy(update={"use": True, "confirm": 0}),
            "comparison": (),
        }
        return Screening(
            self.study.model_copy(update=changes), self.base, self.run.path("first"), self.progress
        )

    def _evaluations(
        self, crew: Crew, live: LiveTable, tally: Tally, trials: Iterator[Trial]
    ) -> Iterator[tuple[Trial, Row]]:
        """Each trial with its record as a full solve would give it."""
        solve = look_solve(self.study)
        by_key: dict[str, list[Trial]] = {}

        def job(trial: Trial) -> Any:
            asked = self.look_job(trial.candidate, solve)
            by_key.setdefault(asked.key, []).append(trial)
            return asked

        for done, outcome in crew.work_through(map(job, trials)):
            trial = by_key[done.key].pop(0)
            looked = record_of(outcome)
            record = self.foretold(trial.candidate, looked)
            tally.under_way = min(crew.under_way, crew.threads)
            tally.core_s += record["core_s"]
            tally.counts[record["status"]] += 1
            tally.total += record["status"] != "solved"
            live.append(self._trial_row(int(trial.candidate.name), trial, record))
            self.progress(tally, {"name": trial.candidate.name, **record})
            yield trial, record

    def _trial_row(self, number: int, trial: Trial, record: Row | None = None) -> Row:
        found = record or trial.record or {}
        return {"number": number, **found, **shown_values(trial.candidate, self.columns), "source": "look"}

    def _front_of(self, designs: list[Trial]) -> list[Trial]:
        """Some designs of the front, spread over its range of gain."""
        front = self._uncertain(designs, [False] * len(designs))
        members = [trial for trial, inside in zip(designs, front.inside, strict=True) if inside]
        gains = np.array([float((trial.record or {})["gain_deg_per_kpa"]) for trial in members])
        return (
            [members[k] for k in spread_over(gains, self.study.search.confirm)]
            if self.study.search.confirm
            else []
        )

    def _uncertain(self, designs: list[Trial], known: list[bool]) -> Front:
        costs = np.array([objectives_of(trial.record or {}) for trial in designs])
        sd = np.array([spread_of(self.calibration, name) for name in OBJECTIVES])
        return uncertain_front(costs, np.where(np.array(known)[:, None], 0.0, sd), self.study.search.seed)

    def _written(
        self, designs: list[Trial], chosen: list[Trial], own_s: float, first_s: float, taken: int
    ) -> OptimiseResult:
        """Front and summary on disk; designs that were solved in full stand with what that gave."""
        errors, confirmed_s, known = [], 0.0, []
        for trial in designs:
            known.append(False)
            if trial not in chosen or trial.record is None:
                continue
            _, record, source = self.record(trial.candidate)
            if source != "full":
                continue
            confirmed_s += record["core_s"]
            solved = objectives_of(record)
            if record["status"] == "solved" and np.isfinite(solved).all():
                errors.append(np.log(np.abs(objectives_of(trial.record)[:2]) / np.abs(solved[:2])))
                known[-1] = True
            trial.record = record
        front = self._uncertain(designs, known)
        rows = self._front_rows(designs, front, known)
        table = write_rows(self.run.path("front.csv"), [*header(self.columns.values()), *UNCERTAIN], rows)
        look_error = np.array(errors).reshape(-1, 2)
        core_s = own_s + first_s + confirmed_s
        median, low, high = front.hypervolume
        write_json(
            self.run.path("summary.json"),
            {
                "evaluated": len(designs),
                "warm_started_from": taken,
                "front": len(rows),
                "confirmed": len(errors),
                "core_hours": core_s / 3600.0,
                "core_hours_soroforge": SOROFORGE_CORE_HOURS,
                "core_hours_looks": own_s / 3600.0,
                "core_hours_first": first_s / 3600.0,
                "core_hours_confirming": confirmed_s / 3600.0,
                "hypervolume_median": median,
                "hypervolume_5_percent": low,
                "hypervolume_95_percent": high,
                "look": self.calibration.summary() if self.calibration else {},
                "look_error_on_front_percent": 100.0 * np.expm1(np.abs(look_error)).max(axis=0, initial=0.0),
                "wall_s": self.run.wall_s,
            },
        )
        self.run.finish()
        return OptimiseResult(self.run.directory, table, rows, len(designs), core_s, front, look_error)

    def _front_rows(self, designs: list[Trial], front: Front, known: list[bool]) -> list[Row]:
        rows = []
        gain_sd, stress_sd = (100.0 * spread_of(self.calibration, name) for name in list(OBJECTIVES)[:2])
        for k in np.flatnonzero(front.inside):
            trial = designs[k]
            record = trial.record or {}
            rows.append(
                {
                    **record,
                    **shown_values(trial.candidate, self.columns),
                    "name": trial.candidate.name,
                    "pareto": True,
                    "source": "full" if known[k] else "look",
                    "probability": float(front.probability[k]),
                    "gain_sd_percent": 0.0 if known[k] else gain_sd,
                    "stress_sd_percent": 0.0 if known[k] else stress_sd,
                    "confirmed": known[k],
                }
            )
        return sorted(rows, key=lambda row: -row["gain_deg_per_kpa"])


def _foundations(study: StudyFile) -> Any:
    """What two studies must share for figures of one to hold in the other."""
    look = (study.look.units, study.look.element_size_mm, study.look.states)
    return look, study.solve, study.rank


def spread_of(calibration: Calibration | None, name: str) -> float:
    """Standard deviation of the logarithm of a foretold figure; 0 for one that follows from the design.

    calibration : of the look; name : of the figure
    """
    return float(calibration.spread[LOOKED.index(name)]) if calibration and name in LOOKED else 0.0
