"""How a table of a material test is described: by a TOML file, or by its own headers and comments.

A CSV table may say all of it itself: lines `# kind: uniaxial` (and `# name: ...`, `# strain: 0.05`) above its
header, and a unit in each header: `strain_percent`, `stress_kpa`, `Storage modulus [MPa]`. A table of other
making is described by a TOML file, one `[[test]]` for each table: file, kind, and for each quantity the
column and its unit.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from tubefoot.config import Settings, parse_settings
from tubefoot.errors import ConfigError
from tubefoot.quantities import FACTORS

Kind = Literal["uniaxial", "planar", "equibiaxial", "shear", "dma", "relaxation"]
Measure = Literal["stretch", "strain", "true_strain", "shear"]


class ColumnOf(Settings):
    """Where one quantity stands in a table."""

    column: str
    """its header"""
    unit: str
    """of the numbers: MPa, kPa, psi, N/mm2, %, 1, Hz, rad/s, s, ms, ..."""


class DescribedTest(Settings):
    """One table of a material test."""

    file: str
    """the table, relative to this description"""
    kind: Kind
    """of the test"""
    name: str = ""
    """for messages and figures; the file's name if not given"""
    separator: str = ","
    """between columns; "tab" and "space" (any run of blanks) by name"""
    decimal: Literal[".", ","] = "."
    """mark in numbers"""
    skip_rows: Annotated[int, Field(ge=0)] = 0
    """lines above the header"""
    deformation: ColumnOf | None = None
    """stretch, strain or amount of shear"""
    measure: Measure = "strain"
    """of the deformation: stretch, engineering strain, true_strain, or shear"""
    stress: ColumnOf | None = None
    """stress, in a relaxation test divided by step_strain"""
    stress_measure: Literal["nominal", "true"] = "nominal"
    """force over the first or over the present cross-section"""
    frequency: ColumnOf | None = None
    storage: ColumnOf | None = None
    loss: ColumnOf | None = None
    time: ColumnOf | None = None
    modulus: ColumnOf | None = None
    modulus_of: Literal["tension", "shear"] = "tension"
    """what dynamic and relaxation moduli are: E, or G (times three, incompressible)"""
    step_strain: Annotated[float, Field(gt=0)] | None = None
    """strain of a relaxation test that gives stress"""


class Description(Settings):
    """The tests that a TOML file describes."""

    test: tuple[DescribedTest, ...]


def text_lines(path: Path) -> list[str]:
    """The lines of a text file.

    path : UTF-8, with or without a mark

    Raises ConfigError when it is missing or no text.
    """
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read as text: {error}") from error


HEADER = re.compile(r"^(?P<name>.*?)\s*(?:[\[(](?P<bracket>[^\])]*)[\])])?$")
SUFFIXES = {"mpa": "MPa", "percent": "%", "rad_per_s": "rad/s"} | {
    unit.lower(): unit
    for units in FACTORS.values()
    for unit in units
    if unit and unit not in ("mPa", "MHz", "1", "-")
}
"""Units as endings of a header, in lower case; `mpa` is MPa, as everywhere in Tubefoot."""
ROLES: dict[str, tuple[str, ...]] = {
    "frequency": ("frequency", "freq", "f"),
    "storage": ("storage", "e'", "g'"),
    "loss": ("loss", 'e"', "e''", 'g"', "g''"),
    "time": ("time", "t"),
    "modulus": ("modulus", "relaxation modulus"),
    "deformation": (
        "stretch",
        "true strain",
        "shear",
        "shear strain",
        "strain",
        "engineering strain",
        "nominal strain",
    ),
    "stress": ("stress", "nominal stress", "engineering stress", "true stress", "shear stress"),
}


def described_by_itself(path: Path, kind: str | None) -> DescribedTest:
    """What a table says of itself by its headers and the comments above them.

    path : of the table; kind : of the test where the table does not say it

    Raises ConfigError when nobody says which test it is.
    """
    lines = text_lines(path)
    notes = dict(re.findall(r"(?m)^#\s*(kind|name|strain)\s*[:=]\s*(.+?)\s*$", "\n".join(lines)))
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    separator = max((",", ";", "\t"), key=first.count)
    table: dict[str, object] = {"file": path.name, "separator": separator}
    for title in (cell.strip() for cell in next(csv.reader([first], delimiter=separator), [])):
        name, unit = _split(title)
        for role, words in ROLES.items():
            if role not in table and (
                name in words or (role in ("storage", "loss") and name.startswith(words[0]))
            ):
                table[role] = {"column": title, "unit": unit}
                if role == "deformation":
                    table["measure"] = _measure(name)
                if name.startswith("true stress"):
                    table["stress_measure"] = "true"
                if name[:2] in ("g'", 'g"'):
                    table["modulus_of"] = "shear"
                break
    said = notes.get("kind") or kind or _kind_by_columns(table.keys())
    if said is None:
        raise ConfigError(
            f"{path}: which test is it? Put `# kind: uniaxial` above its header, give --kind, or describe "
            "the table in a TOML file; kinds: uniaxial, planar, equibiaxial, shear, dma, relaxation"
        )
    if said == "shear" and "measure" in table:
        table["measure"] = "shear"
    table |= {"kind": said, "name": notes.get("name", "")}
    if "strain" in notes:
        table["step_strain"] = notes["strain"]
    return parse_settings(table, DescribedTest, source=str(path))


def _split(title: str) -> tuple[str, str]:
    """Name in lower case with blanks, and unit, of a header; stretches and strains may go without a unit."""
    match = HEADER.match(title)
    assert match is not None
    name, unit = match["name"].strip().lower(), match["bracket"]
    if unit is None:
        for ending in sorted(SUFFIXES, key=len, reverse=True):
            if name.endswith("_" + ending):
                return name.removesuffix("_" + ending).replace("_", " "), SUFFIXES[ending]
    return name.replace("_", " "), "1" if unit is None else unit.strip()


def _measure(name: str) -> str:
    if "stretch" in name:
        return "stretch"
    return "true_strain" if "true" in name else "shear" if "shear" in name else "strain"


def _kind_by_columns(roles: Iterable[str]) -> str | None:
    has = set(roles)
    if {"frequency", "storage", "loss"} <= has:
        return "dma"
    return "relaxation" if "time" in has and has & {"modulus", "stress"} else None
