"""The table of candidates on disk: a row appended as each result comes, and the whole rewritten with ranks.

Neither keeps the rows in memory.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

Row = Mapping[str, Any]

REGIONS = (
    "partition",
    "valley_right",
    "valley_left",
    "fold_right",
    "fold_left",
    "side_wall",
    "cap",
)
FIGURES = (
    "bend_deg_at_35kpa",
    "gain_deg_per_kpa",
    "gain_r_squared",
    "pressure_left_kpa",
    "pumped_volume_ml",
    "von_mises_p99_kpa",
    *(f"von_mises_p99_{region}_kpa" for region in REGIONS),
    "von_mises_p99_at_angle_kpa",
    "stress_concentration",
    "hottest_share_central",
    "hottest_share_folds",
    "unit_stress_variation",
    "seam_s33_p99_kpa",
    "seam_opening_force_right_n",
    "seam_peeling_moment_right_n_mm",
    "seam_margin",
    "sealing_width_mm",
    "partition_slenderness",
    "footprint_cm3",
    "printable",
    "broken_rules",
    "end_pressure_right_kpa",
    "end_bend_deg",
)
RANKING = ("score", "rank", "pareto")


def header(varied: Iterable[str]) -> list[str]:
    """Columns of candidates.csv.

    varied : columns of the varied dimensions
    """
    varied = list(varied)
    figures = [name for name in FIGURES if name not in varied]
    return [
        "name",
        "comparison",
        *varied,
        "status",
        *RANKING,
        "source",
        *figures,
        "core_s",
        "reason",
        "folder",
    ]


class LiveTable:
    """candidates.csv while results come: each row is on disk when `append` returns."""

    def __init__(self, path: Path, columns: Sequence[str]):
        """Start the table anew.

        path : the file; columns : its header
        """
        self._file = path.open("w", newline="")
        self._writer = csv.DictWriter(self._file, columns, extrasaction="ignore", lineterminator="\n")
        self._writer.writeheader()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def append(self, row: Row) -> None:
        """Write a row through to the file.

        row : cells by column; others are left out
        """
        self._writer.writerow(cells(row))
        self._file.flush()


def write_rows(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> Path:
    """The path of a table, after it was replaced in one step; rows are written as they are made.

    path : the file; columns : its header; rows : cells by column
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    with beside.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow(cells(row))
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    return path


def cells(row: Row) -> dict[str, Any]:
    """A row as it is written: floats with nine significant digits, missing numbers empty.

    row : cells by column
    """
    return {key: _cell(value) for key, value in row.items()}


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return "" if value != value else f"{value:.9g}"
    return value
