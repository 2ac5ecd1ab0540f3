"""The multi-objective search: gain up, stress at a fixed angle down, footprint down, by ask and tell.

Designs are evaluated by the calibrated first look (`look`). `ahead` of them are under way at a time and
results are told in the order in which they were asked for, so that workers stay busy and the search is the
same whatever their number. Designs whose dimensions make no finger, that cannot be printed, that do not
converge or do not reach the angle are told as infeasible, with how far they are from feasible, and are not
counted among the evaluated.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.records import read_table
from tubefoot.study.candidates import Candidate, column_names, make_candidate
from tubefoot.study.dimensions import Number, Span, is_whole
from tubefoot.study.ranking import OBJECTIVES, objectives_of
from tubefoot.study.study_file import SearchSettings, StudyFile

if TYPE_CHECKING:
    import optuna

Row = dict[str, Any]

WORST = (0.0, 1e4, 1e4)
"""Objectives told for an infeasible design; samplers go by its constraint."""
MOST_TRIALS = 20
"""Designs asked for, over those to evaluate, before a search without feasible designs is given up."""
VIOLATION = "infeasibility"


@dataclass
class Trial:
    """A design of the search, in the order of asking.

    candidate : the design; record : its figures, once they are there; feasible : whether they count
    """

    candidate: Candidate
    asked: Any
    record: Row | None = None
    feasible: bool = False


class Search:
    """Asks for designs and is told their records; knows nothing of how they are solved."""

    def __init__(self, study: StudyFile, base: FingerDesign):
        """Nothing is asked yet.

        study : its ranges are searched; base : the design that they change

        Raises ConfigError when the study has fewer than two ranges.
        """
        import optuna

        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self.study, self.base = study, base
        self.settings = study.search
        self.axes = study.axes
        if len(self.axes) < 2:
            raise ConfigError("a search needs two dimensions at least under [vary]")
        directions = ["maximize" if sign > 0 else "minimize" for sign in OBJECTIVES.values()]
        self._optuna = optuna.create_study(directions=directions, sampler=_sampler(self.settings))
        self._distributions = {key: _distribution(key, axis) for key, axis in self.axes.items()}
        self.trials: list[Trial] = []
        self.counts: Counter[str] = Counter()

    @property
    def evaluated(self) -> int:
        """Designs whose objectives were told."""
        return sum(trial.feasible for trial in self.trials)

    def ask(self) -> Trial:
        """The next design."""
        asked = self._optuna.ask(self._distributions)
        trial = Trial(make_candidate(self.base, str(len(self.trials) + 1), dict(asked.params)), asked)
        self.trials.append(trial)
        return trial

    def tell(self, trial: Trial, record: Row) -> None:
        """Take a design's record.

        trial : asked for before; record : figures as a full solve would give them, status, reason
        """
        values = _values(record)
        trial.record, trial.feasible = record, values is not None
        self.counts[record["status"] if values or record["status"] != "solved" else "angle not reached"] += 1
        distance = 0.0 if values else infeasibility(record, self.study.rank.angle_deg)
        trial.asked.set_constraint(VIOLATION, distance)
        self._optuna.tell(trial.asked, values or WORST)

    def warm_start(self, table: Path) -> int:
        """How many designs of a finished screening were taken over as known.

        table : its candidates.csv; rows outside of the ranges, and those that differ elsewhere, are left out

        Raises ConfigError when it lacks a dimension of this study.
        """
        import optuna

        rows = read_table(table)
        columns = column_names(self.study)
        if rows and (missing := [column for column in columns.values() if column not in rows[0]]):
            raise ConfigError(
                f"{table} has no column {', '.join(missing)}; it is not a screening of these dimensions"
            )
        taken = 0
        for row in rows:
            values = _values(row)
            params = {key: _as_number(key, row[column]) for key, column in columns.items()}
            if values is None or not all(
                self._distributions[key]._contains(value) for key, value in params.items()
            ):
                continue
            self._optuna.add_trial(
                optuna.trial.create_trial(
                    params=params,
                    distributions=self._distributions,
                    values=values,
                    constraints={VIOLATION: 0.0},
                )
            )
            taken += 1
        return taken


def run_search(
    search: Search, evaluate_all: Callable[[Iterator[Trial]], Iterator[tuple[Trial, Row]]]
) -> None:
    """Ask and tell until enough designs are evaluated.

    search : fresh; evaluate_all : yields each trial with its record as they come, in any order, and takes the
        next trials whenever the iterator that it is given has some

    Raises ConfigError when hardly any design is feasible.
    """
    ahead, wanted = search.settings.ahead, search.settings.designs
    told = 0
    waiting: dict[int, Row] = {}
    queue: list[Trial] = [search.ask() for _ in range(min(ahead, wanted))]
    number = {id(trial): k for k, trial in enumerate(queue)}
    feed = _Feed(queue)
    for trial, record in evaluate_all(feed):
        waiting[number[id(trial)]] = record
        while told in waiting:
            search.tell(search.trials[told], waiting.pop(told))
            told += 1
            while (open_ones := len(search.trials) - told) < min(ahead, wanted - search.evaluated):
                fresh = search.ask()
                number[id(fresh)] = told + open_ones
                queue.append(fresh)
            if len(search.trials) > MOST_TRIALS * wanted:
                raise ConfigError(
                    f"of {told} designs only {search.evaluated} are feasible "
                    f"({dict(search.counts)}); narrow the ranges of the study"
                )


class _Feed:
    """The trials that wait to be evaluated; runs dry and fills again."""

    def __init__(self, queue: list[Trial]):
        self._queue = queue

    def __iter__(self) -> Iterator[Trial]:
        return self

    def __next__(self) -> Trial:
        if not self._queue:
            raise StopIteration
        return self._queue.pop(0)


def infeasibility(record: Row, angle_deg: float) -> float:
    """How far a design is from feasible, above 0.

    record : of the design; angle_deg : that it must reach
    """
    if (broken := record.get("rule_violation")) and broken > 0:
        return 1.0 + float(broken)
    reached = record.get("end_bend_deg")
    if isinstance(reached, float) and reached < angle_deg:
        return 1.0 - max(0.0, reached) / angle_deg
    return 1.0


def _values(record: Row) -> tuple[float, ...] | None:
    """The objectives of a feasible design in the order of `OBJECTIVES`, None for any other."""
    if record["status"] != "solved" or record.get("printable") not in (True, "true"):
        return None
    costs = objectives_of(record)
    if not np.isfinite(costs).all():
        return None
    return tuple(-sign * cost for sign, cost in zip(OBJECTIVES.values(), costs.tolist(), strict=True))


def _sampler(settings: SearchSettings) -> optuna.samplers.BaseSampler:
    import optuna

    if settings.sampler == "random":
        return optuna.samplers.RandomSampler(seed=settings.seed)
    if settings.sampler == "nsga2":
        return optuna.samplers.NSGAIISampler(seed=settings.seed)
    return optuna.samplers.TPESampler(
        seed=settings.seed,
        n_startup_trials=settings.startup,
        multivariate=True,
        constant_liar=True,
    )


def _distribution(key: str, axis: Span | list[Number]) -> Any:
    import optuna

    if isinstance(axis, list):
        return optuna.distributions.CategoricalDistribution(axis)
    if is_whole(key):
        return optuna.distributions.IntDistribution(round(axis.low), round(axis.high))
    return optuna.distributions.FloatDistribution(axis.low, axis.high)


def _as_number(key: str, cell: Any) -> Number:
    return round(cell) if is_whole(key) else float(cell)
