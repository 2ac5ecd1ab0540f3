"""How the work of a solve grows with the finger's length: 3, 6, 12 and 24 units, self-contact on, to 35 kPa.

Entries and operations of a factorisation depend on the mesh and the ordering only. Times are CPU times of
whole processes on one thread; beside them stand wall time and memory.
"""

import math
import tempfile
from itertools import pairwise
from pathlib import Path

from benchmarks.measured import Usage
from benchmarks.ours_fea import run_ours
from benchmarks.row import Row

UNITS = (3, 6, 12, 24)
"""Numbers of units of the fingers that are measured."""


def run() -> list[Row]:
    with tempfile.TemporaryDirectory() as directory:
        root = Path(directory)
        work = {units: run_ours(["work", str(units)], root / "work.log", 1)[1] for units in UNITS}
        solves = {units: _solve(units, root) for units in UNITS}
    rows = []
    for units, found in work.items():
        name = f"{units} units, one factorisation"
        note = f"{found['unknowns']} unknowns, {found['nonzeros'] / 1e6:.2f} million entries"
        rows.append(Row(name, found["flops"] / 1e9, None, "", None, "GFLOP", note))
    for what in ("unknowns", "nonzeros", "flops"):
        rows += _growth(what, {units: found[what] for units, found in work.items()})
    for units, (usage, found) in solves.items():
        note = (
            f"{found['bend_deg']:.2f} deg, {found['states']} states, "
            f"{found['newton_iterations']} iterations, wall {usage.wall_s:.0f} s, "
            f"{usage.memory_mb:.0f} MB; {found['end_reason']}"
        )
        rows.append(Row(f"curve with contact, {units} units, CPU", usage.cpu_s, None, "", None, "s", note))
    return rows + _growth("CPU", {units: usage.cpu_s for units, (usage, _) in solves.items()})


def _solve(units: int, root: Path) -> tuple[Usage, dict]:
    return run_ours(["curve", str(units), str(root / f"{units}")], root / f"{units}.log", 1)


def _growth(what: str, values: dict[int, float]) -> list[Row]:
    """Exponents of growth between numbers of units that follow each other; 1 is linear."""
    pairs = list(values.items())
    return [
        Row(f"{what} ~ units^x, {few} to {many}", math.log(b / a) / math.log(many / few), None, "", None, "x")
        for (few, a), (many, b) in pairwise(pairs)
    ]
