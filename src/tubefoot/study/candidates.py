"""The candidates of a study, made one at a time: named ones, a grid, or scattered points.

A candidate is known by the hash of all that its result depends on; two names for one design are one solve.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from tubefoot import __version__
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.dimensions import Number, Span, flat, grid_values, is_whole, with_values
from tubefoot.study.study_file import StudyFile

BLOCK = 1024
"""Scattered points that are drawn at once."""


@dataclass(frozen=True)
class Candidate:
    """A design to evaluate.

    name : as in the study file, or its number; values : dotted key to value of what varies
    tables : the whole design, not checked yet; its own name is the same for all
    comparison : to which it belongs, if any
    """

    name: str
    values: dict[str, Number]
    tables: dict[str, Any]
    comparison: str = ""

    def key(self, solve: SolveSettings) -> str:
        """Hash of the design, of how it is solved, and of the version; 32 digits.

        solve : settings of the solve
        """
        record = [__version__, self.tables, solve.model_dump(mode="json")]
        return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()[:32]


def candidates_of(study: StudyFile, base: FingerDesign) -> Iterator[Candidate]:
    """The base, the named candidates, then those of the ranges, each design once for each of its names.

    study : the study; base : its base design
    """
    yield make_candidate(base, "base", {})
    for comparison in study.comparison:
        for name, table in comparison.candidates.items():
            yield replace(make_candidate(base, name, flat(table)), comparison=comparison.name)
    for number, values in enumerate(varied(study), 1):
        yield make_candidate(base, str(number), values)


def make_candidate(base: FingerDesign, name: str, values: dict[str, Number]) -> Candidate:
    """The candidate that differs from the base in some dimensions.

    base : the design; name : of the candidate; values : dotted key to value
    """
    whole = {key: round(value) if is_whole(key) else float(value) for key, value in values.items()}
    return Candidate(name, whole, {**with_values(base, whole), "name": "candidate"})


def varied(study: StudyFile) -> Iterator[dict[str, Number]]:
    """The values of each candidate of the ranges, a grid or scattered.

    study : the study
    """
    axes = study.axes
    if not axes:
        return
    if study.sample is None:
        columns = [grid_values(key, axis) for key, axis in axes.items()]
        for row in itertools.product(*columns):
            yield dict(zip(axes, row, strict=True))
        return
    from scipy.stats import qmc

    sobol = qmc.Sobol(len(axes), scramble=True, rng=study.sample.seed)
    for start in range(0, study.sample.count, BLOCK):
        block = sobol.random(BLOCK)
        for point in block[: study.sample.count - start]:
            yield {
                key: _placed(key, axis, share) for (key, axis), share in zip(axes.items(), point, strict=True)
            }


def _placed(key: str, axis: Span | list[Number], share: float) -> Number:
    """The value at a share of the way along an axis."""
    if isinstance(axis, list):
        return axis[min(int(share * len(axis)), len(axis) - 1)]
    if is_whole(key):
        return int(axis.low + share * (axis.high - axis.low + 1 - 1e-9))
    return float(f"{axis.low + share * (axis.high - axis.low):.6g}")


def column_names(study: StudyFile) -> dict[str, str]:
    """Dotted key to table column of all that varies: the bare name where that is unambiguous.

    study : the study
    """
    keys = list(study.axes)
    for comparison in study.comparison:
        for table in comparison.candidates.values():
            keys += flat(table)
    keys = list(dict.fromkeys(keys))
    bare = [key.partition(".")[2] for key in keys]
    return {
        key: key.replace(".", "_") if bare.count(name) > 1 else name
        for key, name in zip(keys, bare, strict=True)
    }


def shown_values(candidate: Candidate, columns: dict[str, str]) -> dict[str, Any]:
    """Cells of the varied dimensions of a candidate; the base's value where it does not differ.

    candidate : whose; columns : dotted key to column
    """
    split = {column: key.partition(".") for key, column in columns.items()}
    return {column: candidate.tables[table][name] for column, (table, _, name) in split.items()}
