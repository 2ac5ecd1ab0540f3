"""The dimensions that a study names, `fold_run_mm` or `seam.modulus_mpa`, and the values that it gives them.

Inside they are dotted keys of the design file; bare names are of the bellows.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError

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
