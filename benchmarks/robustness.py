"""`python -m benchmarks.robustness [--count 200] [--seed 7]`: do random designs solve, or end with a reason?

Draws designs far wider than the reference finger, leaves out those that the geometry rules refuse, and
solves each to P_right = 35 kPa with self-contact, on a coarse mesh. Rows go to build/robustness.csv one by
one, and a second call goes on where the first was stopped; delete a row to have its design solved again.
`--part 1/2` and `--part 2/2` share the list between two processes, each with a table of its own.
Prints how many ended how. A design that takes longer than `--limit-s` of CPU time is a failure.
"""

import argparse
import contextlib
import signal
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConvergenceError, GeometryError
from tubefoot.fea.finger_model import SolveSettings, build_finger, largest_stretch
from tubefoot.fea.measures import percentile
from tubefoot.fea.path import follow
from tubefoot.fea.step import Step
from tubefoot.fea.stride import StepControl
from tubefoot.records import read_table, write_table
from tubefoot.units import DEG, KPA

BUILD = Path("build")
SETTINGS = SolveSettings(element_size_mm=3.0, states=6, fields="none")
REACHED = "goal reached"
PHYSICAL = ("absolute vacuum", "full collapse", "rupture strain", "instability")
LIMIT_S = 180.0


def random_table(rng: np.random.Generator) -> dict[str, Any]:
    """Settings of a design, drawn evenly."""

    def between(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 3)

    return {
        "bellows": {
            "units": int(rng.integers(1, 5)),
            "fold_run_mm": between(1.5, 9.0),
            "fold_rise_mm": between(0.0, 2.5),
            "crest_flat_mm": between(2.0, 8.0),
            "valley_flat_mm": between(0.5, 3.0),
            "fold_wall_mm": between(0.5, 2.5),
            "valley_wall_mm": between(0.5, 3.0),
            "partition_mm": between(0.6, 4.0),
            "chamber_gap_mm": between(0.5, 5.0),
            "height_mm": between(5.0, 16.0),
            "side_wall_mm": between(0.6, 3.0),
            "cap_mm": between(2.0, 6.0),
            "fillet_outside_mm": float(rng.choice([0.0, between(0.1, 0.5)])),
            "fillet_chamber_mm": float(rng.choice([0.0, between(0.1, 0.5)])),
        },
        "body": {"scale": between(0.4, 1.7)},
    }


def designs(seed: int, count: int) -> list[tuple[int, FingerDesign]]:
    """The first designs of a seed that the rules accept, with their number in the sequence."""
    rng = np.random.default_rng(seed)
    found: list[tuple[int, FingerDesign]] = []
    number = 0
    while len(found) < count:
        table = random_table(rng)
        with contextlib.suppress(GeometryError):
            found.append((number, FingerDesign.model_validate({"name": f"random-{number}", **table})))
        number += 1
    return found


def solve(design: FingerDesign, limit_s: float = LIMIT_S) -> dict[str, Any]:
    """How a design's path ended, and where."""
    started, began = time.perf_counter(), time.process_time()
    signal.signal(signal.SIGVTALRM, _too_slow)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit_s)
    row: dict[str, Any] = {"end": "", "bend_deg": "", "pressure_right_kpa": "", "pressure_left_kpa": ""}
    last: Step | None = None
    snaps = 0
    deepest = np.inf
    rupture = 1.0 + design.body.elongation_at_break_percent / 100.0

    def watch(step: Step, wall_s: float) -> str | None:
        nonlocal last, deepest, snaps
        stretch = percentile(largest_stretch(finger.solid, step.state.unknowns), finger.solid.weights, 0.999)
        if stretch > rupture:
            return f"rupture strain: the largest stretch passes {rupture:.2f}"
        last, deepest, snaps = step, min(deepest, step.min_gap), snaps + bool(step.event)
        return None

    try:
        finger = build_finger(design, SETTINGS)
        row["end"] = follow(
            finger.model, finger.goal, finger.limits, StepControl(states=SETTINGS.states), watch
        ).end_reason
    except (GeometryError, ConvergenceError) as error:
        row["end"] = f"{type(error).__name__}: {error}".splitlines()[0]
    except _TooSlowError:
        row["end"] = f"not done in {limit_s:g} s of CPU time"
    except Exception as error:
        row["end"] = f"exception {type(error).__name__}: {error} ({traceback.format_exc().splitlines()[-3]})"
    if last is not None:
        row["bend_deg"] = finger.tip(last.state.unknowns)[0] / DEG
        row["pressure_right_kpa"], row["pressure_left_kpa"] = (float(p) / KPA for p in last.state.pressures)
        row["gap_mm"] = deepest if np.isfinite(deepest) else ""
    else:
        row["gap_mm"] = ""
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    row["snaps"] = snaps
    row["wall_s"], row["cpu_s"] = time.perf_counter() - started, time.process_time() - began
    return row


class _TooSlowError(Exception):
    """A design took more CPU time than it may."""


def _too_slow(*_: object) -> None:
    raise _TooSlowError


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--limit-s", type=float, default=LIMIT_S)
    parser.add_argument("--part", default="1/1", help="K/N: every N-th design from the K-th on, rows apart")
    arguments = parser.parse_args()
    part, parts = (int(number) for number in arguments.part.split("/"))
    table = BUILD / ("robustness.csv" if parts == 1 else f"robustness-{part}-of-{parts}.csv")
    rows = read_table(table) if table.exists() else []
    done = {(int(float(row["seed"])), int(float(row["number"]))) for row in rows}
    for number, design in designs(arguments.seed, arguments.count)[part - 1 :: parts]:
        if (arguments.seed, number) in done:
            continue
        row = {
            "seed": arguments.seed,
            "number": number,
            "units": design.bellows.units,
            **solve(design, arguments.limit_s),
        }
        rows.append(row)
        write_table(table, rows)
        print(f"{len(rows):4d}  design {number}: {row['end']}", flush=True)
    mine = [row for row in rows if int(float(row["seed"])) == arguments.seed]
    ends = Counter(_kind(str(row["end"])) for row in mine)
    for kind, count in ends.most_common():
        print(f"{count:4d} of {len(mine)}  {kind}")


def _kind(end: str) -> str:
    """The end of a path without its numbers."""
    return next((known for known in (REACHED, *PHYSICAL) if end.startswith(known)), end)


if __name__ == "__main__":
    main()
