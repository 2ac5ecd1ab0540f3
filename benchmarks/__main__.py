"""`python -m benchmarks [NAME ...]`: run `bench_*.py`, print one table, write `build/bench.json`.

A benchmark is a module `bench_NAME.py` with `run() -> list[Row]`.
"""

import importlib
import sys
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.row import Row
from tubefoot.records import write_json


def main(names: list[str]) -> None:
    here = Path(__file__).parent
    known = sorted(path.stem.removeprefix("bench_") for path in here.glob("bench_*.py"))
    unknown = set(names) - set(known)
    if unknown:
        sys.exit(f"unknown benchmark {', '.join(sorted(unknown))}; known: {', '.join(known)}")
    console = Console(width=140)
    rows: list[Row] = []
    for name in names or known:
        console.print(f"[bold]{name}[/]")
        found = importlib.import_module(f"benchmarks.bench_{name}").run()
        console.print(_table(found))
        rows += found
        write_json(Path("build/bench.json"), [asdict(row) for row in rows])
    console.print("written: build/bench.json")


def _table(rows: list[Row]) -> Table:
    table = Table("measured", "ours", "other", "which", "ratio", "unit", "note")
    for row in rows:
        numbers = ["" if value is None else f"{value:.4g}" for value in (row.ours, row.other, row.ratio)]
        table.add_row(row.name, numbers[0], numbers[1], row.other_name, numbers[2], row.unit, row.note)
    return table


if __name__ == "__main__":
    main(sys.argv[1:])
