"""Tables of other laboratories, read by a column map: any separator, decimal comma, gaps, declared units."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.validation.column_map import QUANTITIES, Column, ColumnMap
from tubefoot.validation.recording import FloatArray, RawSeries

LEAST_ROWS = 20


@dataclass(frozen=True)
class _Sheet:
    """A table as text: header, rows with their line numbers."""

    path: Path
    header: list[str]
    rows: list[tuple[int, list[str]]]


def read_foreign_csv(path: Path, columns: ColumnMap) -> RawSeries:
    """What a foreign table holds.

    path : the file
    columns : how to read it

    Raises ConfigError naming the line and the column where a cell is no number, a column that is not there,
    or time that runs backwards.
    """
    sheet = _sheet(path, columns)
    named = columns.columns
    time = _column(sheet, named.time, "time", columns)
    pressures = np.column_stack(
        [
            _column(sheet, named.pressure_right, "pressure_right", columns),
            _column(sheet, named.pressure_left, "pressure_left", columns),
        ]
    )
    whole = np.isfinite(time) & np.isfinite(pressures).all(axis=1)
    if whole.sum() < LEAST_ROWS:
        raise ConfigError(
            f"{path}: {whole.sum()} rows have time and both pressures, at least {LEAST_ROWS} are needed; "
            "check separator, decimal sign and missing in the column map"
        )
    _demand_order(time[np.isfinite(time)], path)
    drive = _column(sheet, named.drive, "drive", columns)
    drive = np.where(np.abs(drive) < columns.drive_threshold, 0.0, drive)
    # A row without pressures still tells whether the pump ran.
    sampled = whole | (np.isfinite(time) & np.isfinite(drive))
    seen = _angles(path, sheet, columns, time)
    files = [path] if columns.angles is None else [path, _angle_path(path, columns)]
    return RawSeries(
        time[sampled],
        pressures[sampled],
        drive[sampled],
        *seen,
        pulses=(),
        rest_pressures=None,
        units=columns.finger_units,
        provenance={
            "file": path.name,
            "sha256": hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest(),
            "format": "csv",
            **_units_of(columns),
        },
    )


def _angles(
    path: Path, sheet: _Sheet, columns: ColumnMap, time: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, angles and their uncertainties [s, rad]; from the table itself, or from a file of their own."""
    named = columns.columns
    if columns.angles is not None:
        sheet = _sheet(_angle_path(path, columns), columns)
        own = columns.angles
        time = _column(sheet, own.time, "time", columns)
        angle, sigma = own.angle, own.angle_sigma
    elif named.angle is not None:
        angle, sigma = named.angle, named.angle_sigma
    else:
        empty = np.empty(0)
        return empty, empty, empty
    values = _column(sheet, angle, "angle", columns)
    spread = np.abs(_column(sheet, sigma, "angle_sigma", columns))
    # A row without an angle between two with one is a frame in which the marker was lost, or a sample between
    # frames; it says nothing either way.
    there = np.isfinite(time) & np.isfinite(values)
    _demand_order(time[there], sheet.path)
    return time[there], values[there], spread[there]


def _angle_path(path: Path, columns: ColumnMap) -> Path:
    assert columns.angles is not None
    return path.parent / columns.angles.file.replace("{stem}", path.stem)


def _sheet(path: Path, columns: ColumnMap) -> _Sheet:
    try:
        text = path.read_text(encoding=columns.encoding)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError, LookupError) as error:
        raise ConfigError(
            f"{path}: cannot be read as {columns.encoding} text: {error}; set encoding in the column map"
        ) from error
    lines = list(_lines(text, columns))
    parsed = list(csv.reader([line for _, line in lines], delimiter=columns.separator))
    numbered = [
        (number, [cell.strip() for cell in row])
        for (number, _), row in zip(lines, parsed, strict=False)
        if row
    ]
    if columns.header_rows == 0:
        width = len(numbered[0][1]) if numbered else 0
        return _Sheet(path, [str(place) for place in range(1, width + 1)], numbered)
    if len(numbered) < columns.header_rows:
        raise ConfigError(f"{path}: no header after {columns.skip_rows} skipped lines; check skip_rows")
    return _Sheet(path, numbered[0][1], numbered[columns.header_rows :])


def _lines(text: str, columns: ColumnMap) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), start=1):
        comment = bool(columns.comment) and line.startswith(columns.comment)
        if number > columns.skip_rows and line.strip() and not comment:
            yield number, line


def _column(sheet: _Sheet, column: Column | None, key: str, columns: ColumnMap) -> FloatArray:
    """A column in inside units, nan where a cell is empty; all nan where there is no such column."""
    if column is None:
        return np.full(len(sheet.rows), np.nan)
    if column.name not in sheet.header:
        near = get_close_matches(column.name, sheet.header, n=1, cutoff=0.4)
        hint = f"did you mean `{near[0]}`?" if near else f"there are: {', '.join(sheet.header)}"
        raise ConfigError(f"{sheet.path}: no column `{column.name}` for {key}; {hint}")
    place, missing = sheet.header.index(column.name), set(columns.missing)
    values = np.full(len(sheet.rows), np.nan)
    for row, (line, cells) in enumerate(sheet.rows):
        cell = cells[place] if place < len(cells) else ""
        if cell in missing:
            continue
        try:
            values[row] = float(cell.replace(",", ".") if columns.decimal == "," else cell)
        except ValueError:
            raise ConfigError(
                f"{sheet.path}, line {line}, column `{column.name}`: `{cell}` is not a number with the "
                f"decimal sign `{columns.decimal}`; mend it, or add it to missing in the column map"
            ) from None
    return values * column.factor(QUANTITIES.get(key, "drive"))


def _demand_order(time: FloatArray, path: Path) -> None:
    backwards = np.flatnonzero(np.diff(time) < 0)
    if len(backwards):
        at = int(backwards[0])
        raise ConfigError(
            f"{path}: time runs backwards from {time[at]:.6g} to {time[at + 1]:.6g} s after {at + 1} rows; "
            "split the file where a new recording begins"
        )


def _units_of(columns: ColumnMap) -> dict[str, str]:
    """Unit of each column in the source, for the record."""
    found = {}
    for table in (columns.columns, columns.angles):
        for key in type(table).model_fields if table is not None else ():
            column = getattr(table, key)
            if isinstance(column, Column):
                found[f"unit_{key}" if table is columns.columns else f"unit_angles_{key}"] = column.unit
    return found
