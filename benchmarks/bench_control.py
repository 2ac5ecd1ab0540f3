"""Closed-loop bending over a population of virtual benches: the paper's controller beside ours.

`python -m benchmarks control` runs the first benches of the verdict; with both controllers on all 200,
`python -m benchmarks.bench_control --all` writes benchmarks/data/control_population.csv in about an hour
(`--controller adaptive` runs one of them and keeps the other's rows, `--resume` goes on where it was
stopped, `--tuning` takes the benches for tuning and writes no table).
Angles come without pixels, the firmware runs as its native core; figures are of the true angle.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.row import Row
from tubefoot.control.choice import step_controller
from tubefoot.control.creep import CreepLaw, creep_law
from tubefoot.control.loop import BendLoop
from tubefoot.control.settings import BendSettings
from tubefoot.control.trace import step_figures
from tubefoot.lab.sensing import measure_neutral
from tubefoot.records import read_table, write_table
from tubefoot.reduced.files import reference_file
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.population import TUNING_SEEDS, VERDICT_SEEDS, drawn_bench
from tubefoot.units import DEG

TABLE = Path(__file__).parent / "data" / "control_population.csv"
FEW = 12
TARGET_DEG = 30.0
CONTROLLERS = ("paper", "adaptive")


def run() -> list[Row]:
    rows = [row for seed in VERDICT_SEEDS[:FEW] for name in CONTROLLERS for row in bench_rows(seed, name)]
    return verdict(rows)


def bench_rows(seed: int, name: str) -> list[dict[str, Any]]:
    """To 30 deg and back on one bench of the population, limits of the rig file; one row a motion."""
    with VirtualBench(drawn_bench(seed), seed, "native") as bench:
        bench.rig.connect()
        measure_neutral(bench.rig)
        bench.angles.open()
        settings = BendSettings()
        controller = step_controller(name, reference_law(), bench.rig_settings, settings)
        loop = BendLoop(
            bench.rig, bench.angles, settings, further=lambda: {"true_deg": bench.truth().bend / DEG}
        )
        rows: list[dict[str, Any]] = []
        for part, target in (("to", TARGET_DEG), ("return", 0.0)):
            controller.aim(target * DEG)
            motion = loop.run(controller, part=part)
            true = true_figures(motion.rows, target)
            figures = step_figures(motion, target) | true
            reason = figures.pop("end_reason").split(":")[0]
            rows.append({"seed": seed, "controller": name, "part": part, **figures, "end_reason": reason})
            if not motion.settled:
                break
    return rows


@cache
def reference_law() -> CreepLaw:
    """What the controllers know of the 12-unit reference finger."""
    reference = reference_file()
    return creep_law(reference.to_finger(), reference.to_prony())


def true_figures(rows: list[dict[str, Any]], target_deg: float) -> dict[str, float]:
    """Overshoot and error in the hold of the finger as it is, which the controller does not see."""
    bends = np.array([row["true_deg"] for row in rows])
    times = np.array([row["time_s"] for row in rows])
    way = 1.0 if bends[0] < target_deg else -1.0
    hold = bends[times > times[-1] - 2.0] - target_deg
    return {
        "true_overshoot_deg": max(0.0, float((way * (bends - target_deg)).max())),
        "true_hold_error_deg": float(np.abs(hold).mean()),
        "true_final_error_deg": float(target_deg - bends[-1]),
    }


def verdict(rows: list[dict[str, Any]]) -> list[Row]:
    """The issue's figures, ours beside the paper's controller."""
    found = []
    for part in ("to", "return"):
        ours, paper = (_of(rows, name, part) for name in ("adaptive", "paper"))
        note = f"{len(ours)} benches, {sum(_settled(row) for row in ours)} settled"
        for what, key, share in (
            ("pulses, median", "iterations", 50),
            ("pulses, 95 %", "iterations", 95),
            ("pulses, most", "iterations", 100),
            ("overshoot, 95 % [deg]", "true_overshoot_deg", 95),
            ("mean error in the hold, median [deg]", "true_hold_error_deg", 50),
            ("mean error in the hold, 95 % [deg]", "true_hold_error_deg", 95),
            ("time to the end of the hold, median [s]", "bench_time_s", 50),
        ):
            a, b = (
                np.percentile([row[key] for row in some if _settled(row)], share) for some in (ours, paper)
            )
            ratio = float(b / a) if a else None
            found.append(
                Row(
                    f"{part} {TARGET_DEG if part == 'to' else 0:g} deg: {what}",
                    a,
                    b,
                    "paper's",
                    ratio,
                    "",
                    note,
                )
            )
    return found


def _of(rows: list[dict[str, Any]], name: str, part: str) -> list[dict[str, Any]]:
    return [row for row in rows if row["controller"] == name and row["part"] == part]


def _settled(row: dict[str, Any]) -> bool:
    return str(row["settled"]).lower() == "true"


def run_all(
    seeds: Sequence[int], path: Path | None, resumed: bool, names: Sequence[str] = CONTROLLERS
) -> None:
    """All given benches, the table written after each; rows of a table that are not asked for anew stay."""
    rows = read_table(path) if path and path.exists() else []
    rows = [row for row in rows if resumed or row["controller"] not in names]
    done = {(row["seed"], row["controller"]) for row in rows}
    for seed in seeds:
        for name in names:
            if (seed, name) in done:
                continue
            rows += bench_rows(seed, name)
            if path:
                write_table(
                    path, sorted(rows, key=lambda row: (row["seed"], CONTROLLERS.index(row["controller"])))
                )
            print(seed, name, flush=True)
    both = set.intersection(
        *({row["seed"] for row in rows if row["controller"] == name} for name in CONTROLLERS)
    )
    for row in verdict([row for row in rows if row["seed"] in both]):
        print(f"{row.name:<55} {row.ours:8.3f} {row.other or 0:8.3f}  {row.note}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    benches = parser.add_mutually_exclusive_group(required=True)
    benches.add_argument("--all", action="store_true", help="the 200 benches of the verdict, with a table")
    benches.add_argument("--tuning", action="store_true", help="some benches for tuning, without a table")
    parser.add_argument("--resume", action="store_true", help="keep the rows that the table has")
    parser.add_argument("--controller", choices=CONTROLLERS, help="only this one")
    chosen = parser.parse_args()
    names = [chosen.controller] if chosen.controller else CONTROLLERS
    seeds, path = (VERDICT_SEEDS, TABLE) if chosen.all else (TUNING_SEEDS[:FEW], None)
    run_all(seeds, path, chosen.resume, names)


if __name__ == "__main__":
    main()
