"""The study file: a base design, what varies, what is solved, and how candidates are ranked.

Dimensions are named as in a design file, `fold_run_mm` or `bellows.fold_run_mm`, `seam.modulus_mpa`, each
with a list of values or a range `{ low = 1.0, high = 2.0, count = 5 }`. Comparisons name their candidates.
"""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings
from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.curve import REFERENCE_KPA
from tubefoot.study.dimensions import Number, Span, flat, grid_values, values_of, with_values

MOST_CANDIDATES = 10_000_000
"""Largest grid or sample that a study may have."""


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
