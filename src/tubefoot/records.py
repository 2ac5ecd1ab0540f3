"""Run directories: tables with units in their headers and `run.toml` beside them.

A kill loses nothing: a file appears under its name only when it is whole (write beside, flush, rename).
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import tomli_w

from tubefoot import __version__
from tubefoot.errors import ConfigError

RECORDED_PACKAGES = (
    "numpy",
    "scipy",
    "numba",
    "mkl",
    "distributed",
    "optuna",
    "opencv-python-headless",
    "mujoco",
    "pyserial",
    "build123d",
    "netgen-mesher",
)
"""Packages whose version a run depends on; those that are installed go into `run.toml`."""


def write_whole(path: Path, content: str | bytes) -> Path:
    """The path, after its content was replaced in one step.

    path : file to write; its directory is created
    content : text (UTF-8) or bytes
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    data = content.encode() if isinstance(content, str) else content
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    return path


def free_path(directory: Path, stem: str, suffix: str) -> Path:
    """A path that is not taken: `stem.suffix`, `stem-2.suffix`, ...

    directory : of the file
    stem : its name
    suffix : its ending with the dot
    """
    path, number = directory / f"{stem}{suffix}", 1
    while path.exists():
        number += 1
        path = directory / f"{stem}-{number}{suffix}"
    return path


def write_json(path: Path, record: Any) -> Path:
    """The path of a JSON file; numbers that are not finite become null.

    path : file to write
    record : mappings, sequences, numbers, text, arrays
    """
    return write_whole(path, json.dumps(_plain(record), indent=2) + "\n")


def write_table(path: Path, rows: Sequence[Mapping[str, Any]], columns: Iterable[str] | None = None) -> Path:
    """The path of a CSV table, floats with nine significant digits.

    path : file to write
    rows : one mapping a row
    columns : header, in order; the keys of the first row if not given
    """
    header = list(columns) if columns is not None else list(rows[0])
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, header, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({key: _cell(value) for key, value in row.items()})
    return write_whole(path, buffer.getvalue())


def read_table(path: Path | str) -> list[dict[str, Any]]:
    """The rows of a CSV table, numbers as float, other cells as text.

    path : file to read

    Raises ConfigError when there is no such file.
    """
    try:
        with Path(path).open(newline="") as file:
            return [{key: _number(cell) for key, cell in row.items()} for row in csv.DictReader(file)]
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such table") from None


def read_summary(directory: Path, verb: str, key: str) -> dict[str, Any]:
    """What is in summary.json of a run.

    directory : of the run; verb : that makes such runs; key : by which its summaries are known

    Raises ConfigError when there is none, or it is of another verb.
    """
    path = directory / "summary.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}; run `tubefoot {verb}` first") from error
    if key not in found:
        raise ConfigError(f"{path}: not the summary of a `{verb}` run")
    return dict(found)


class Run:
    """A run directory with its clock: `run.toml` is written by `finish` beside the tables."""

    def __init__(
        self, directory: Path | str, verb: str, settings: Mapping[str, Any], seed: int | None = None
    ):
        """Create the directory and start the clock.

        directory : where the results go; created with its parents
        verb : the program's verb, for the record
        settings : every resolved setting of the run
        seed : seed of the random numbers, if any were drawn
        """
        self.directory = Path(directory)
        self.verb = verb
        self.settings = settings
        self.seed = seed
        self._started = time.perf_counter()
        self._started_at = datetime.now(UTC)
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(
                f"--out {self.directory}: cannot be made a directory: {error.strerror}"
            ) from error

    @property
    def wall_s(self) -> float:
        """Seconds since the run began."""
        return time.perf_counter() - self._started

    def path(self, name: str) -> Path:
        """Path of a file in the run directory.

        name : file name, may contain sub-directories
        """
        return self.directory / name

    def finish(self, **extra: Any) -> Path:
        """The path of `run.toml`, after writing it.

        extra : further keys for its `[run]` table
        """
        about: dict[str, Any] = {
            "verb": self.verb,
            "started_utc": self._started_at.isoformat(timespec="seconds"),
            "wall_s": round(self.wall_s, 3),
            **extra,
        }
        if self.seed is not None:
            about["seed"] = self.seed
        document = {"run": about, "versions": versions(), "settings": self.settings}
        return write_whole(self.path("run.toml"), tomli_w.dumps(_toml(document)))


def versions() -> dict[str, str]:
    """Versions of Tubefoot, Python and of those packages that results depend on."""
    found = {"tubefoot": __version__, "python": platform.python_version()}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.9g}" if isinstance(value, float) else value


def _number(cell: str | None) -> Any:
    try:
        return float(cell) if cell is not None else None
    except ValueError:
        return cell


def _plain(value: Any) -> Any:
    """The same value in the types that JSON has."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def _toml(value: Any) -> Any:
    """The same value in the types that TOML has; keys without a value are left out."""
    value = _plain(value)
    if isinstance(value, dict):
        return {key: _toml(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list):
        return [_toml(inner) for inner in value if inner is not None]
    return value
