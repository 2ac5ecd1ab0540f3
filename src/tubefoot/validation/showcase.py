"""Claim C9 in small: virtual experiments on 3- and 6-unit fingers with all causes, held against ideal FEA.

For the demo and for a first look; a campaign of two repeats, without holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from tubefoot.config import parse_settings
from tubefoot.reduced.files import reference_file
from tubefoot.validation.attribution import attribute, values_of
from tubefoot.validation.campaign import Campaign
from tubefoot.validation.fit_stage import write_attribution
from tubefoot.validation.lean_bench import LeanBench
from tubefoot.validation.loading import load_recording
from tubefoot.validation.prediction import load_prediction
from tubefoot.validation.stage import Validated, validate_recordings, write_validation
from tubefoot.validation.virtual_experiment import VirtualExperiment, bonded_bench, run_experiment

PULSE_S = {3: 0.12, 6: 0.18}
"""Length of a pulse by the number of units: some ten pulses a stroke."""
STROKES = (("load", "right"), ("unload", "right"), ("load", "left"), ("unload", "left"))


def small_campaign(units: int) -> Campaign:
    """Loading, unloading, reversal, twice.

    units : of the finger, 3 or 6
    """
    blocks = [
        {"kind": kind, "side": side, "until_kpa": 33.0, "duty": 0.35, "pulse_s": PULSE_S[units]}
        for kind, side in STROKES
    ]
    table = {"name": f"small, {units} units", "rest_s": 2.0, "settle_s": 0.85, "repeats": 2, "blocks": blocks}
    return parse_settings(table, Campaign)


def attribute_bonded(directory: Path, units: int) -> None:
    """Write attribution.csv and .json: what each cause explains on the virtual bench, whose truth is known.

    directory : of the run; units : of the finger
    """
    content = reference_file()
    bench = LeanBench(content.to_finger().with_units(units))
    write_attribution(attribute(values_of(bonded_bench()), bench, content.to_prony()), directory)


def validate_virtual(
    directory: Path,
    solves: Mapping[int, Path],
    say: Callable[[str], None] = lambda _: None,
    seed: int = 0,
) -> Validated:
    """What virtual experiments show against solves; tables are in the directory.

    directory : recordings go into `experiment-N` below it; those that are there are not made again
    solves : number of units to the run directory of its solve
    say : told of every block
    seed : of all chance
    """
    records = []
    for units in solves:
        folder = directory / f"experiment-{units}"
        experiment = VirtualExperiment(bonded_bench(), units, small_campaign(units), seed)
        path = folder / "bench.mcap"
        if not (folder / "done").exists():
            say(f"virtual experiment with {units} units")
            for left_over in sorted(folder.glob("*")):
                left_over.unlink()
            run_experiment(experiment, folder, say=say)
            (folder / "done").touch()
        records.append(load_recording(path, name=f"{units}-units"))
    say("what explains the offsets")
    attribute_bonded(directory, min(solves))
    predictions = [load_prediction(path) for path in solves.values()]
    found = validate_recordings(records, predictions, seed=seed, say=say)
    write_validation(found, directory)
    return found
