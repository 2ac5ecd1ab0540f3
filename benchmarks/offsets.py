"""Claim C9 on the whole virtual bench: each cause alone, all of them, and hidden benches, against ideal FEA.

    python -m benchmarks.offsets --three out/reference-3 --six out/reference-6 --hidden 10

One loading stroke a bench. Rows go to build/offsets.csv as they come, and are not computed again.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from tubefoot.config import load_settings, parse_settings
from tubefoot.records import read_table, write_table
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.validation.campaign import Campaign
from tubefoot.validation.loading import load_recording
from tubefoot.validation.overlay import compare
from tubefoot.validation.prediction import Prediction, load_prediction
from tubefoot.validation.settled import settled_states
from tubefoot.validation.virtual_experiment import (
    VirtualExperiment,
    causeless_bench,
    hidden_bench,
    run_experiment,
)

TABLE = Path("build/offsets.csv")
BONDED = Path("examples/benches/bonded.toml")
CAUSES = {
    "seam": ("finger.seam_stiffening",),
    "relaxation": ("finger.creep",),
    "air columns": ("branches.air_right_ml", "branches.air_left_ml"),
    "bubbles": ("finger.bubble_right_ml", "finger.bubble_left_ml"),
    "tube": ("branches.tube_kpa_s_per_ml",),
}
"""Causes and the settings that switch each on."""
PULSE_S = {3: 0.06, 6: 0.1}
NUMBERS = (
    "angle_offset_high_deg",
    "suction_offset_high_kpa",
    "angle_ratio_high",
    "suction_ratio_high",
    "coupling_slope",
    "angle_r_squared",
)


def stroke(units: int, until_kpa: float = 33.0) -> Campaign:
    """One loading of the right chamber, half a second of settling after each pulse."""
    block = {"kind": "load", "until_kpa": until_kpa, "duty": 0.35, "pulse_s": PULSE_S[units]}
    table = {
        "name": "one stroke",
        "rest_s": 1.5,
        "settle_s": 0.9,
        "repeats": 1,
        "pressure_low_kpa": -59.0,
        "blocks": [block],
    }
    return parse_settings(table, Campaign)


def with_causes(units: int, switched_on: tuple[str, ...]) -> BenchSettings:
    """The bench without any cause, the named settings as on the bonded bench."""
    table = causeless_bench(units).model_dump(mode="json", exclude_none=True)
    bonded = load_settings(BONDED, BenchSettings).model_dump(mode="json", exclude_none=True)
    for key in switched_on:
        part, name = key.split(".")
        table[part][name] = bonded[part][name]
    return parse_settings(table, BenchSettings)


def benches(units: int, hidden: int) -> dict[str, BenchSettings]:
    """Name and bench of every row of a length."""
    every = tuple(key for keys in CAUSES.values() for key in keys)
    found = {"none": with_causes(units, ())}
    found |= {f"only {name}": with_causes(units, keys) for name, keys in CAUSES.items()}
    for name, keys in CAUSES.items():
        found[f"all but {name}"] = with_causes(units, tuple(key for key in every if key not in keys))
    found["all"] = with_causes(units, every)
    return found | {f"hidden {seed}": hidden_bench(seed, units) for seed in range(hidden)}


def offsets(units: int, name: str, bench: BenchSettings, prediction: Prediction) -> dict[str, Any]:
    """One row: what one stroke on a bench shows against the prediction."""
    with tempfile.TemporaryDirectory() as folder:
        path = run_experiment(VirtualExperiment(bench, units, stroke(units)), Path(folder))
        result = compare(name, settled_states(load_recording(path)), prediction)
    row: dict[str, Any] = {"units": units, "bench": name, "states": result.states}
    row |= {key: result.figures[key].value for key in NUMBERS}
    return row | {"stiffness": bench.finger.stiffness, "seam": bench.finger.seam_stiffening}


def main() -> None:
    """Compute what is missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--three", type=Path, default=Path("out/reference-3"))
    parser.add_argument("--six", type=Path, default=Path("out/reference-6"))
    parser.add_argument("--hidden", type=int, default=10)
    given = parser.parse_args()
    rows = read_table(TABLE) if TABLE.exists() else []
    for units, run in ((3, given.three), (6, given.six)):
        prediction = load_prediction(run)
        for name, bench in benches(units, given.hidden).items():
            if any(int(row["units"]) == units and row["bench"] == name for row in rows):
                continue
            rows.append(offsets(units, name, bench, prediction))
            write_table(TABLE, rows)
            print(rows[-1], flush=True)
    for units in (3, 6):
        hidden = [
            row for row in rows if int(row["units"]) == units and str(row["bench"]).startswith("hidden")
        ]
        below = sum(row["angle_offset_high_deg"] < 0 for row in hidden)
        smaller = sum(row["suction_offset_high_kpa"] > 0 for row in hidden)
        print(f"{units} units, {len(hidden)} hidden: angle below in {below}, suction smaller in {smaller}")


if __name__ == "__main__":
    main()
