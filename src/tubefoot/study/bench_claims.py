"""The paper's claims about the working bench, judged on the records of `bend` runs (C5, C10, C11, C12)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.records import read_summary, read_table
from tubefoot.study.claims import Claim, verdict_of
from tubefoot.study.curve import line_fit

FloatArray = NDArray[np.float64]

FORWARD_ITERATIONS, RETURN_ITERATIONS = 11, 7
"""What the paper needed to 30 deg and back (Closed-Loop Tracking)."""
BAND_DEG = 1.0
STROKE_KPA = 2.0
"""Least change of the right pressure by which a run of the pump counts."""
STROKE_MM = 0.5
"""Least change of the right column by which it does."""


@dataclass(frozen=True)
class BendRecord:
    """The directory of a `bend` run."""

    directory: Path

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What is in summary.json; raises ConfigError when it is missing or no summary of `bend`."""
        return read_summary(self.directory, "bend", "iterations")

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of bend.csv."""
        return read_table(self.directory / "bend.csv")

    def column(self, name: str) -> FloatArray:
        """A column of bend.csv, nan where it is empty.

        name : header
        """
        if not self.rows or name not in self.rows[0]:
            raise ConfigError(f"{self.directory / 'bend.csv'}: no column {name}")
        values = [row[name] for row in self.rows]
        return np.array([value if isinstance(value, float) else np.nan for value in values])

    def strokes(self) -> list[slice]:
        """The runs of the pump: rows from the first with it running to the last."""
        runs, start = [], None
        direction = self.column("direction")
        for at, way in enumerate(direction):
            if start is not None and way != direction[start]:
                runs.append(slice(start, at))
                start = None
            if way and start is None:
                start = at
        return [run for run in runs if run.stop - run.start >= 2]


def judge_tracking(run: BendRecord) -> Claim:
    """C11: a step to 30 deg and back with the paper's controller.

    run : `tubefoot bend 30 --controller paper --return` on the 12-unit finger
    """
    parts = []
    numbers: dict[str, float] = {}
    steps = (
        ("to_30", run.summary, FORWARD_ITERATIONS),
        ("return", run.summary.get("return"), RETURN_ITERATIONS),
    )
    for name, figures, most in steps:
        if figures is None:
            parts.append(False)
            continue
        numbers |= {
            f"iterations_{name}": figures["iterations"],
            f"iterations_to_band_{name}": figures["iterations_to_band"],
            f"final_error_{name}_deg": figures["final_error_deg"],
            f"overshoot_{name}_deg": figures["overshoot_deg"],
            f"bench_time_{name}_s": figures["bench_time_s"],
        }
        there = figures["settled"] and abs(figures["final_error_deg"]) <= BAND_DEG
        parts.append(there and figures["iterations"] <= most)
    return Claim(
        "C11",
        "A step to 30 deg on the 12-unit finger settles within 1 deg in 11 iterations, the return to 0 in 7",
        f"after the 2 s hold the error is within {BAND_DEG:g} deg; at most {FORWARD_ITERATIONS} and "
        f"{RETURN_ITERATIONS} runs of the pump",
        verdict_of(parts),
        numbers,
        "bend",
    )


def judge_bench_pressures(run: BendRecord) -> Claim:
    """C5 on the bench: while the pump runs, the branches' pressures move against each other.

    run : a `bend` run
    """
    right, left = run.column("pressure_right_kpa"), run.column("pressure_left_kpa")
    changes = [
        (right[stroke.stop - 1] - right[stroke.start], left[stroke.stop - 1] - left[stroke.start])
        for stroke in run.strokes()
    ]
    counted = [(r, w) for r, w in changes if abs(r) >= STROKE_KPA]
    slope, r_squared, _ = line_fit(right, left)
    numbers = {
        "slope": slope,
        "r_squared": r_squared,
        "strokes": float(len(counted)),
        "opposite": float(sum(r * w < 0 for r, w in counted)),
    }
    return Claim(
        "C5",
        "The two chambers show an inverse pressure relation during cyclic actuation",
        f"in every run of the pump that changes P_right by {STROKE_KPA:g} kPa or more, P_left moves the "
        "other way",
        verdict_of(r * w < 0 for r, w in counted),
        numbers,
        "bend",
    )


def judge_columns(run: BendRecord) -> Claim:
    """C12: the liquid columns move in opposite directions.

    run : a `bend` run with the column levels in its trace
    """
    right, left = run.column("level_right_mm"), run.column("level_left_mm")
    pressed = run.column("pressure_right_kpa")
    parts = []
    for stroke in run.strokes():
        by = [values[stroke.stop - 1] - values[stroke.start] for values in (right, left, pressed)]
        if abs(by[0]) >= STROKE_MM:
            parts.append(bool(by[0] * by[1] < 0 and by[0] * by[2] > 0))
    return Claim(
        "C12",
        "The columns move in opposite directions: the pressurised side's air pocket is compressed",
        f"in every run of the pump that moves the right column by {STROKE_MM:g} mm or more, the left one "
        "moves the other way, and the column that rises is on the side whose pressure rises",
        verdict_of(parts),
        {
            "strokes": float(len(parts)),
            "as_claimed": float(sum(parts)),
            "range_right_mm": float(np.ptp(right)),
            "range_left_mm": float(np.ptp(left)),
        },
        "bend",
    )


def judge_bench_reversal(forward: BendRecord, backward: BendRecord) -> Claim:
    """C10 on the bench: reversing the pump bends the other way.

    forward, backward : `bend` runs to an angle and to its negative
    """
    numbers: dict[str, float] = {}
    parts = []
    for name, run, way in (("forward", forward, 1.0), ("backward", backward, -1.0)):
        strokes = [s for s in run.strokes() if run.column("direction")[s.start] == way]
        first = strokes[0] if strokes else None
        bend, volume = run.column("bend_deg"), run.column("pumped_volume_ml")
        net = float(volume[sum(row["part"] == run.rows[0]["part"] for row in run.rows) - 1])
        turned = float(bend[first.stop - 1] - bend[first.start]) if first else 0.0
        numbers |= {
            f"turn_of_first_pulse_{name}_deg": turned,
            f"final_bend_{name}_deg": float(run.summary["target_deg"] - run.summary["final_error_deg"]),
            f"volume_{name}_ml": net,
        }
        parts.append(bool(way * turned > 0 and run.summary["settled"] and way * net > 0))
    return Claim(
        "C10",
        "Reversing the pump bends the other way, without valves",
        "the first pulse of either direction turns the finger its way, and both targets settle with net "
        "volumes of opposite sign",
        verdict_of(parts),
        numbers,
        "bends",
    )
