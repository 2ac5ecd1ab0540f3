"""The study file: a base design, what varies, what is solved, and how candidates are ranked.

Dimensions are named as in a design file, `fold_run_mm` or `bellows.fold_run_mm`, `seam.modulus_mpa`, each
with a list of values or a range `{ low = 1.0, high = 2.0, count = 5 }`. Comparisons name their candidates.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings
from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.curve import REFERENCE_KPA

MOST_CANDIDATES = 10_000_000
"""Largest grid or sample that a study may have."""

Number = int | float


class Span(Settings):
    """A range of one dimension: sampled, searched, or cut into `count` even values for a grid."""

    low: float
    high: float
    count: Annotated[int, Field(ge=2, le=100_000)] | None = None

    @model_validator(mode="after")
    def _upwards(self) -> Self:
        if self.high <= self.low:
            raise ValueError(f"high = {self.high:g} must be above low = {self.low:g}")
        return self


class Comparison(Settings):
    """Named candidates side by side, and the claims that they decide."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$")]
    claims: tuple[Literal["C1", "C2", "C3", "C4"], ...] = ()
    candidates: dict[str, dict[str, Any]]
    """Name of each candidate, and the dimensions in which it differs from the base."""


class Sample(Settings):
    """Scattered candidates (scrambled Sobol points) in place of a grid; a larger count only adds to them."""

    count: Annotated[int, Field(ge=1, le=MOST_CANDIDATES)]
    seed: Annotated[int, Field(ge=0)] = 1


class RankSettings(Settings):
    """How candidates are judged: weights of the groups, and what a design must keep."""

    weight_bending: Annotated[float, Field(ge=0.0)] = 1.0
    weight_stress: Annotated[float, Field(ge=0.0)] = 1.0
    weight_sealing: Annotated[float, Field(ge=0.0)] = 1.0
    weight_footprint: Annotated[float, Field(ge=0.0)] = 1.0
    angle_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 9.0
    """Bend angle at which the stress of designs is compared."""
    max_slenderness: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    """Largest free height of the partition over its thickness; at 5.5 it was seen to bulge into the wall."""
    solve_unprintable: bool = True
    """Whether designs that break a rule of printing are solved all the same."""
    selected: str = ""
    """Name of the candidate that is said to be the best, to be confirmed or refuted."""
    among: tuple[str, ...] = ()
    """Comparisons from which it was selected; all when empty."""

    @model_validator(mode="after")
    def _weighted(self) -> Self:
        if self.weight_bending + self.weight_stress + self.weight_sealing + self.weight_footprint == 0.0:
            raise ValueError("all weights are 0; give at least one group a weight")
        return self


class LookSettings(Settings):
    """The fast first look: a short finger on a coarse mesh, calibrated against full solves."""

    use: bool = False
    """Whether candidates are looked at before any is solved in full."""
    units: Annotated[int, Field(ge=1, le=6)] = 2
    element_size_mm: Annotated[float, Field(ge=0.5, le=10.0)] = 5.0
    states: Annotated[int, Field(ge=2, le=50)] = 3
    calibrate: Annotated[int, Field(ge=3, le=1000)] = 8
    """How many candidates, spread over the range of bending, are solved in full to calibrate the look."""
    confirm: Annotated[int, Field(ge=0, le=100_000)] = 5
    """How many of the best by the look are solved in full."""


class SearchSettings(Settings):
    """The multi-objective search for the Pareto front."""

    designs: Annotated[int, Field(ge=10, le=100_000)] = 300
    """How many designs are evaluated."""
    seed: Annotated[int, Field(ge=0)] = 1
    sampler: Literal["tpe", "nsga2", "random"] = "tpe"
    startup: Annotated[int, Field(ge=1, le=10_000)] = 40
    """Random designs before the sampler learns."""
    ahead: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Designs asked for before the oldest is told; as many workers stay busy. Part of the result."""
    confirm: Annotated[int, Field(ge=0, le=10_000)] = 10
    """How many designs, spread over the front, are solved in full at the end."""


class StudyFile(Settings):
    """A study as its file says."""

    name: Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]*$")] = (
        "study"
    )
    design: str = ""
    """File of the base design, from the study file's directory; the reference finger when empty."""
    fix: dict[str, Any] = Field(default_factory=dict)
    """Dimensions of the base that this study sets otherwise."""
    vary: dict[str, Any] = Field(default_factory=dict)
    sample: Sample | None = None
    comparison: tuple[Comparison, ...] = ()
    solve: SolveSettings = SolveSettings(fields="none")
    rank: RankSettings = RankSettings()
    look: LookSettings = LookSettings()
    search: SearchSettings = SearchSettings()
    keep_states: bool = False
    """Whether the solved states, 1 MB a candidate and more, are kept beside the tables."""

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if self.solve.until != "pressure_right_kpa" or self.solve.target < REFERENCE_KPA:
            raise ValueError(
                f"a study compares designs at {REFERENCE_KPA:g} kPa in the right chamber: solve.until must "
                f"be pressure_right_kpa and solve.target at least {REFERENCE_KPA:g}"
            )
        if not self.vary and not self.comparison:
            raise ValueError("nothing to compare; give [vary] or at least one [[comparison]]")
        names = [comparison.name for comparison in self.comparison]
        if len(set(names)) < len(names):
            raise ValueError(f"two comparisons share a name among {', '.join(names)}")
        for key, value in flat(self.vary).items():
            values_of(key, value)
        for table in (self.fix, *(c for k in self.comparison for c in k.candidates.values())):
            flat(table)
        return self

    @cached_property
    def axes(self) -> dict[str, Span | list[Number]]:
        """What varies: dotted key to a range or a list of values."""
        return {key: values_of(key, value) for key, value in flat(self.vary).items()}


def load_study(path: Path | str) -> tuple[StudyFile, FingerDesign]:
    """The study in a TOML file and its base design, `fix` applied.

    path : study file

    Raises ConfigError for a file or key that cannot be used, GeometryError for an impossible base.
    """
    path = Path(path)
    try:
        study = load_settings(path, StudyFile)
    except ConfigError as error:
        known = str(error).startswith(str(path))
        raise ConfigError(str(error) if known else f"{path}: {error}") from None
    base = load_design(path.parent / study.design) if study.design else FingerDesign(name="reference")
    return study, FingerDesign.model_validate(with_values(base, flat(study.fix)))


def with_values(design: FingerDesign, values: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a design with some dimensions replaced, not checked yet.

    design : the base; values : dotted key to value; one of `chamber_gap_mm` and `valley_outside_mm` unsets
        the other
    """
    tables = design.model_dump(mode="json")
    for key, value in values.items():
        table, _, name = key.partition(".")
        tables[table][name] = value
    if values.get("bellows.valley_outside_mm") is not None:
        tables["bellows"]["chamber_gap_mm"] = None
    elif values.get("bellows.chamber_gap_mm") is not None:
        tables["bellows"]["valley_outside_mm"] = None
    return tables


def flat(table: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Nested tables as dotted keys, each a number of a design file; bare dimensions are of the bellows.

    table : as in the study file; above : the key that leads to it

    Raises ConfigError for a key that a design does not have.
    """
    found: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{above}{name}"
        if isinstance(value, Mapping) and key in _tables():
            found |= flat(value, f"{key}.")
            continue
        if "." not in key:
            key = f"bellows.{key}"
        if key not in _dimensions():
            bare = [known.partition(".")[2] for known in _dimensions()]
            near = difflib.get_close_matches(key, _dimensions(), 1, 0.5) or difflib.get_close_matches(
                name, bare, 1
            )
            hint = f"; did you mean `{near[0]}`?" if near else ""
            raise ConfigError(f"`{name}` is no dimension of a design{hint}")
        found[key] = value
    return found


def values_of(key: str, value: Any) -> Span | list[Number]:
    """A range or a list of values.

    key : dotted, for the error; value : as in the study file

    Raises ConfigError when it is neither.
    """
    if isinstance(value, Mapping):
        unknown = value.keys() - Span.model_fields.keys()
        if unknown or not {"low", "high"} <= value.keys():
            raise ConfigError(f"`{key}`: write a list of values or {{ low = 1.0, high = 2.0, count = 5 }}")
        try:
            return Span.model_validate(value)
        except ValueError as error:
            raise ConfigError(f"`{key}`: {error}") from None
    numbers = value if isinstance(value, list | tuple) else [value]
    if not numbers or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        raise ConfigError(f"`{key}` = {value!r}: write numbers in a list, or a range")
    return list(numbers)


def is_whole(key: str) -> bool:
    """Whether a dimension counts something, such as the units.

    key : dotted
    """
    return _dimensions()[key] is int


def grid_values(key: str, axis: Span | list[Number]) -> list[Number]:
    """The values of one axis of a grid.

    key : dotted; axis : its range, with a count, or its values

    Raises ConfigError for a range without a count.
    """
    if isinstance(axis, list):
        return axis
    if axis.count is None:
        raise ConfigError(
            f"`{key}` is a range without count: give a count, or [sample] to scatter candidates"
        )
    values = np.linspace(axis.low, axis.high, axis.count)
    if is_whole(key):
        return sorted({round(value) for value in values})
    return [float(f"{value:.10g}") for value in values]


def number_of_candidates(study: StudyFile) -> int:
    """How many candidates the ranges of a study make, comparisons not counted.

    study : the study

    Raises ConfigError when they are too many.
    """
    if not study.axes:
        return 0
    if study.sample is not None:
        return study.sample.count
    count = math.prod(len(grid_values(key, axis)) for key, axis in study.axes.items())
    if count > MOST_CANDIDATES:
        raise ConfigError(
            f"the grid has {count:.3g} candidates, more than {MOST_CANDIDATES:,}; "
            "use fewer values or [sample]"
        )
    return count


def _tables() -> set[str]:
    return {key.partition(".")[0] for key in _dimensions()}


@cache
def _dimensions() -> dict[str, type]:
    """Dotted keys of all numbers in a design file, and whether int or float."""
    found: dict[str, type] = {}
    for table, field in FingerDesign.model_fields.items():
        kind = field.annotation
        if not (isinstance(kind, type) and issubclass(kind, Settings)):
            continue
        for name, inner in kind.model_fields.items():
            text = str(inner.annotation)
            if "tuple" in text or "Literal" in text:
                continue
            if "float" in text or "int" in text:
                found[f"{table}.{name}"] = float if "float" in text else int
    return found
