"""Tests of a material as files: what was deformed how, in which units, read into stretches and MPa.

A CSV table may say all of it itself: lines `# kind: uniaxial` (and `# name: ...`, `# strain: 0.05`) above its
header, and a unit in each header: `strain_percent`, `stress_kpa`, `Storage modulus [MPa]`. A table of other
making is described by a TOML file, one `[[test]]` for each table: file, kind, and for each quantity the
column and its unit.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tubefoot.config import Settings, load_settings, parse_settings
from tubefoot.errors import ConfigError
from tubefoot.quantities import FACTORS, factor

FloatArray = NDArray[np.float64]
Kind = Literal["uniaxial", "planar", "equibiaxial", "shear", "dma", "relaxation"]
Measure = Literal["stretch", "strain", "true_strain", "shear"]
STRETCHED = ("uniaxial", "planar", "equibiaxial", "shear")
"""Kinds with a curve of stress over deformation."""


@dataclass(frozen=True)
class StressTest:
    """A curve of stress over deformation.

    name : for messages and figures; kind : of deformation, one of STRETCHED
    deformation : (n,) stretch, or amount of shear; stress : (n,) nominal [MPa]
    """

    name: str
    kind: str
    deformation: FloatArray
    stress: FloatArray


@dataclass(frozen=True)
class DynamicTest:
    """Dynamic tensile moduli. frequency : (n,) [Hz]; storage, loss : (n,) [MPa]."""

    name: str
    frequency: FloatArray
    storage: FloatArray
    loss: FloatArray


@dataclass(frozen=True)
class RelaxationTest:
    """Tensile modulus after a step of strain. time : (n,) since the step [s]; modulus : (n,) [MPa]."""

    name: str
    time: FloatArray
    modulus: FloatArray


MaterialTest = StressTest | DynamicTest | RelaxationTest


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


def load_material_tests(paths: Iterable[Path], kind: str | None = None) -> list[MaterialTest]:
    """The tests in some files.

    paths : CSV tables that say their units, or TOML descriptions of tables
    kind : of the tables that do not say it; one of uniaxial, planar, equibiaxial, shear, dma, relaxation

    Raises ConfigError for a file, unit or number that cannot be used.
    """
    found: list[MaterialTest] = []
    for path in paths:
        if path.suffix == ".toml":
            description = load_settings(path, Description)
            found += [_read(test, path.parent / test.file) for test in description.test]
        else:
            found.append(_read(_described_by_itself(path, kind), path))
    if not found:
        raise ConfigError("no material test given; name CSV tables or TOML descriptions of them")
    return found


def _read(test: DescribedTest, path: Path) -> MaterialTest:
    name = test.name or path.stem
    columns = _columns(path, test)

    def values(what: ColumnOf | None, key: str, quantity: str) -> FloatArray:
        if what is None:
            raise ConfigError(f"{path}: a {test.kind} test needs `{key}`: its column and unit")
        if what.column not in columns:
            raise ConfigError(f"{path}: no column `{what.column}`; there are {', '.join(columns)}")
        return columns[what.column] * factor(quantity, what.unit)

    if test.kind == "dma":
        times_three = 3.0 if test.modulus_of == "shear" else 1.0
        frequency = values(test.frequency, "frequency", "frequency")
        storage, loss = values(test.storage, "storage", "stress"), values(test.loss, "loss", "stress")
        table = _whole(path, frequency, times_three * storage, times_three * loss)
        _need(path, bool((table > 0).all()), "frequencies and dynamic moduli must be positive")
        return DynamicTest(name, *table)
    if test.kind == "relaxation":
        time = values(test.time, "time", "time")
        if test.modulus is None:
            _need(
                path,
                test.step_strain is not None,
                "relaxation of a stress needs `step_strain`; or give a modulus",
            )
            modulus = values(test.stress, "stress", "stress") / (test.step_strain or 1.0)
        else:
            modulus = values(test.modulus, "modulus", "stress")
        table = _whole(path, time, (3.0 if test.modulus_of == "shear" else 1.0) * modulus)
        _need(
            path,
            bool((table[0] >= 0).all() and (table[1] > 0).all()),
            "times must not be negative, moduli positive",
        )
        return RelaxationTest(name, *table)
    deformation = _deformation(path, test, values(test.deformation, "deformation", "ratio"))
    stress = values(test.stress, "stress", "stress")
    if test.stress_measure == "true":
        _need(path, test.kind != "shear", "give the shear stress itself, which is nominal and true at once")
        stress = stress / deformation
    return StressTest(name, test.kind, *_whole(path, deformation, stress))


def _deformation(path: Path, test: DescribedTest, given: FloatArray) -> FloatArray:
    """Stretch, or the amount of shear, from what was given."""
    sheared = test.kind == "shear"
    if sheared != (test.measure == "shear"):
        raise ConfigError(
            f"{path}: a {test.kind} test with the measure `{test.measure}`; "
            + ("give `shear`, the tangent of the angle" if sheared else "give stretch, strain or true_strain")
        )
    stretch = given
    if test.measure == "strain":
        stretch = 1.0 + given
    elif test.measure == "true_strain":
        stretch = np.exp(given)
    sound = stretch[np.isfinite(stretch)]
    if not sheared and sound.size and (sound.min() <= 0.0 or sound.max() > 20.0):
        raise ConfigError(
            f"{path}: stretches from {sound.min():.4g} to {sound.max():.4g}; allowed are above 0 to 20: "
            f"check that `{test.measure}` is the measure and its unit is right"
        )
    return np.asarray(stretch, float)


def _whole(path: Path, *columns: FloatArray) -> FloatArray:
    """The rows in which every column has a number, (n_columns, n_rows)."""
    table = np.array(columns)
    table = table[:, np.isfinite(table).all(axis=0)]
    _need(path, table.shape[1] >= 3, f"{table.shape[1]} rows with all numbers; three are the least")
    return table


def _need(path: Path, condition: bool, words: str) -> None:
    if not condition:
        raise ConfigError(f"{path}: {words}")


def _columns(path: Path, test: DescribedTest) -> dict[str, FloatArray]:
    """Every column by its header; cells that are empty or no number are nan."""
    lines = _lines(path)[test.skip_rows :]
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    mark = {"tab": "\t", "space": " "}.get(test.separator, test.separator)
    if len(mark) != 1:
        raise ConfigError(f"{path}: separator {test.separator!r}; one character, `tab` or `space`")
    rows = [line.split() for line in lines] if mark == " " else list(csv.reader(lines, delimiter=mark))
    if len(rows) < 2:
        raise ConfigError(f"{path}: no rows under a header; check `skip_rows` ({test.skip_rows})")
    header = [cell.strip() for cell in rows[0]]
    table = {}
    for at, title in enumerate(header):
        cells = [row[at].strip() if at < len(row) else "" for row in rows[1:]]
        table[title] = np.array([_number(cell, test.decimal) for cell in cells])
    return table


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read as text: {error}") from error


def _number(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(".", "").replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return float("nan")


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


def _described_by_itself(path: Path, kind: str | None) -> DescribedTest:
    """What a table says of itself by its headers and the comments above them."""
    lines = _lines(path)
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


def _kind_by_columns(roles: Sequence[str] | Iterable[str]) -> str | None:
    has = set(roles)
    if {"frequency", "storage", "loss"} <= has:
        return "dma"
    return "relaxation" if "time" in has and has & {"modulus", "stress"} else None
