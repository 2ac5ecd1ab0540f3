"""Run directories as the report reads them: settings, summary, curve, stresses by region, field files.

Only files are read, so that every figure can be redrawn later, elsewhere, and without the solver.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.config import read_toml
from tubefoot.errors import ConfigError
from tubefoot.records import read_table

FloatArray = NDArray[np.float64]

CURVE_NEEDS = ("step", "pressure_right_kpa", "pressure_left_kpa", "pumped_volume_ml", "bend_deg")
"""Columns of `curve.csv` without which a solve cannot be drawn."""
COLLECTING_VERBS = ("demo", "report")
"""Verbs whose directory stands for the runs below it."""


@dataclass(frozen=True)
class RunRecord:
    """One run directory.

    name : short name, unique among the runs of a report
    verb : the verb that made it; about, settings, versions : the tables of `run.toml`
    summary : `summary.json`, empty where there is none
    curve : columns of `curve.csv`, (n_states,) each; empty for runs that are no solve
    regions, seam : rows of `regions.csv` and `seam.csv`
    states : number of each recorded state and its VTU file
    """

    directory: Path
    name: str
    verb: str
    about: Mapping[str, Any]
    settings: Mapping[str, Any]
    versions: Mapping[str, Any]
    summary: Mapping[str, Any]
    curve: Mapping[str, FloatArray]
    regions: Sequence[Mapping[str, Any]]
    states: Mapping[int, Path]
    seam: Sequence[Mapping[str, Any]] = ()

    @property
    def is_solve(self) -> bool:
        """Whether the run has a curve of solved states."""
        return bool(self.curve)

    @property
    def last(self) -> dict[str, float]:
        """The last row of the curve; columns that are empty throughout are left out."""
        return {key: float(column[-1]) for key, column in self.curve.items()}

    def region_rows(self) -> list[Mapping[str, Any]]:
        """Rows of `regions.csv` for the last state of the curve."""
        return [row for row in self.regions if row["step"] == self.curve["step"][-1]]

    def seam_rows(self) -> list[Mapping[str, Any]]:
        """Rows of `seam.csv` for the last state of the curve."""
        return [row for row in self.seam if row["step"] == self.curve["step"][-1]]

    @property
    def last_fields(self) -> Path | None:
        """The field file of the curve's last row, None where it was not kept."""
        return self.states.get(int(self.curve["step"][-1])) if self.is_solve else None


def load_runs(paths: Sequence[Path]) -> list[RunRecord]:
    """The runs in the named directories, in their order, with distinct short names.

    paths : run directories; a demo's, or one without a `run.toml`, stands for the runs below it

    Raises ConfigError for a path that holds no run, or a run that cannot be read.
    """
    found = [load_run(directory) for path in paths for directory in _run_directories(path)]
    unique = {run.directory.resolve(): run for run in found}
    return _with_distinct_names(list(unique.values()))


def load_run(directory: Path) -> RunRecord:
    """One run.

    directory : a directory with a `run.toml`

    Raises ConfigError when a file is missing, broken, or lacks a column that the figures need.
    """
    record = read_toml(directory / "run.toml")
    about, settings = record.get("run", {}), record.get("settings", {})
    design = settings.get("design", {})
    name = design.get("name") if isinstance(design, dict) else None
    curve = _curve(directory / "curve.csv")
    return RunRecord(
        directory,
        name or directory.resolve().name,
        str(about.get("verb", "run")),
        about,
        settings,
        record.get("versions", {}),
        read_json(directory / "summary.json") or {},
        curve,
        _table(directory / "regions.csv"),
        _states(directory / "fields"),
        _table(directory / "seam.csv"),
    )


def _table(path: Path) -> list[dict[str, Any]]:
    return read_table(path) if path.exists() else []


def read_json(path: Path) -> Any:
    """The content of a JSON file, None where there is no such file.

    path : file to read

    Raises ConfigError when it is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: not readable as JSON: {error}") from error


def _run_directories(path: Path) -> list[Path]:
    if not path.is_dir():
        what = "is a file; name the run directory that holds it" if path.exists() else "does not exist"
        raise ConfigError(f"{path} {what}")
    own = path / "run.toml"
    if own.exists() and read_toml(own).get("run", {}).get("verb") not in COLLECTING_VERBS:
        return [path]
    if not own.exists() and (path / "curve.csv").exists():
        raise ConfigError(f"{path} holds an interrupted run; give its command again, then report")
    below = [file.parent for file in sorted(path.glob("*/run.toml")) + sorted(path.glob("*/*/run.toml"))]
    if not below:
        raise ConfigError(
            f"{path} holds no run: neither it nor the directories in it have a run.toml; "
            "name the directory that `tubefoot solve --out DIR` or another verb wrote"
        )
    return sorted(below, key=_begun)


def _begun(directory: Path) -> str:
    return str(read_toml(directory / "run.toml").get("run", {}).get("started_utc", ""))


def _curve(path: Path) -> dict[str, FloatArray]:
    if not path.exists():
        return {}
    rows = read_table(path)
    if not rows:
        raise ConfigError(f"{path} has no rows: the run has no solved state yet; let it go on, then report")
    missing = [column for column in CURVE_NEEDS if column not in rows[0]]
    if missing:
        raise ConfigError(f"{path} has no column {', '.join(missing)}; it is not the curve of a solve")
    curve = {}
    for column in rows[0]:
        cells = [row[column] for row in rows]
        numbers = [cell if isinstance(cell, float) else math.nan for cell in cells]
        if column in CURVE_NEEDS and not np.isfinite(numbers).all():
            raise ConfigError(f"{path}: column {column} has a cell that is no number; was the table edited?")
        if any(isinstance(cell, float) for cell in cells):
            curve[column] = np.array(numbers)
    return curve


def _states(directory: Path) -> dict[int, Path]:
    numbered = {}
    for path in sorted(directory.glob("state_*.vtu")):
        if match := re.fullmatch(r"state_(\d+)", path.stem):
            numbered[int(match.group(1))] = path
    return numbered


def _with_distinct_names(runs: list[RunRecord]) -> list[RunRecord]:
    """The runs, those that share a name renamed after their directory, and numbered if need be."""
    count = Counter(run.name for run in runs)
    named = [replace(run, name=run.directory.resolve().name) if count[run.name] > 1 else run for run in runs]
    count, seen = Counter(run.name for run in named), Counter[str]()
    result = []
    for run in named:
        seen[run.name] += 1
        twice = count[run.name] > 1
        result.append(replace(run, name=f"{run.name} ({seen[run.name]})") if twice else run)
    return result
