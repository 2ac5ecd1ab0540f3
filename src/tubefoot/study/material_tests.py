"""Tests of a material as files: what was deformed how, in which units, read into stretches and MPa."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.config import load_settings
from tubefoot.errors import ConfigError
from tubefoot.quantities import factor
from tubefoot.study.material_headers import (
    ColumnOf,
    DescribedTest,
    Description,
    described_by_itself,
    text_lines,
)

FloatArray = NDArray[np.float64]
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
            found.append(_read(described_by_itself(path, kind), path))
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
    lines = text_lines(path)[test.skip_rows :]
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


def _number(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(".", "").replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return float("nan")
