"""The commented design file that `tubefoot new` writes, made from the record so that it cannot go stale."""

from __future__ import annotations

import textwrap
import typing
from typing import Any

import tomli_w
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tubefoot.design.finger import FingerDesign

UNITS = {
    "mm": "mm",
    "mpa": "MPa",
    "percent": "%",
    "g_per_cm3": "g/cm3",
    "time_s": "s",
}
"""How a key's ending is written."""
WIDTH = 100
UNBROKEN = "\N{NO-BREAK SPACE}"


def design_template(name: str) -> str:
    """A design file with every key: its meaning, unit, range and default.

    name : of the design

    Raises pydantic's ValidationError for a name that no design may have.
    """
    design = FingerDesign(name=name)
    lines = [
        f"# Design of a dual-chamber bellows finger. Solve it with `tubefoot solve {name}.toml`,",
        f"# judge it with `tubefoot check {name}.toml`, make print files with `tubefoot export {name}.toml`.",
        "# Every key has its default; a key that is deleted keeps it. A line like `# key =` is not set.",
        '# `material_file = "material.toml"` in [body], in place of its other keys, takes a fitted material.',
        "",
    ]
    for key, field in FingerDesign.model_fields.items():
        value = getattr(design, key)
        if isinstance(value, BaseModel):
            lines += ["", f"[{key}]", *_comment(type(value).__doc__ or "")]
            for inner, inner_field in type(value).model_fields.items():
                lines += _entry(inner, inner_field, getattr(value, inner))
        else:
            lines += _entry(key, field, value)
    return "\n".join(lines) + "\n"


def _entry(key: str, field: FieldInfo, value: Any) -> list[str]:
    facts = [fact for fact in (_unit(key), _range(field)) if fact]
    meaning = " ".join((field.description or "").split())
    bracket = f" [{'; '.join(facts)}]".replace(" ", UNBROKEN) if facts else ""
    comment = [line.replace(UNBROKEN, " ") for line in _comment(meaning + bracket.replace(UNBROKEN, " ", 1))]
    if value is None:
        return [*comment, f"# {key} ="]
    return [*comment, _assignment(key, value)]


def _assignment(key: str, value: Any) -> str:
    """One line of TOML."""
    plain = list(value) if isinstance(value, tuple) else value
    return " ".join(tomli_w.dumps({key: plain}).split()).replace("[ ", "[").replace(", ]", "]")


def _unit(key: str) -> str:
    for ending, unit in UNITS.items():
        if key.endswith(f"_{ending}"):
            return unit
    return ""


def _range(field: FieldInfo) -> str:
    """The allowed range as text; it may hide inside an optional or repeated type."""
    bounds: dict[str, float] = {}
    for holder in (field.metadata, *_inner_metadata(field.annotation)):
        for constraint in holder:
            for name in ("ge", "gt", "le", "lt"):
                if (limit := getattr(constraint, name, None)) is not None:
                    bounds.setdefault(name, limit)
    low = f"{bounds['ge']:g}" if "ge" in bounds else f"above {bounds['gt']:g}" if "gt" in bounds else ""
    high = f"{bounds['le']:g}" if "le" in bounds else f"below {bounds['lt']:g}" if "lt" in bounds else ""
    if low and high:
        return f"{low} to {high}"
    return f"at least {low}".replace("at least above", "above") if low else f"at most {high}" if high else ""


def _inner_metadata(annotation: Any) -> list[tuple[Any, ...]]:
    found = [tuple(getattr(annotation, "__metadata__", ()))]
    for inner in typing.get_args(annotation):
        found += _inner_metadata(inner)
    return [_flat(metadata) for metadata in found if metadata]


def _flat(metadata: tuple[Any, ...]) -> tuple[Any, ...]:
    """Constraints by themselves and those held by a nested `Field`."""
    return tuple(
        part for item in metadata for part in (item.metadata if isinstance(item, FieldInfo) else [item])
    )


def _comment(text: str) -> list[str]:
    first = " ".join(text.split("\n\n")[0].split(" ")).replace("\n", " ").strip()
    return textwrap.wrap(first, WIDTH, initial_indent="# ", subsequent_indent="# ") if first else []
