"""Validation as a stage: recordings and solves in, tables, verdicts and a record out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tubefoot.errors import ConfigError
from tubefoot.records import write_json, write_table
from tubefoot.study.claims import Claim
from tubefoot.units import DEG, KPA
from tubefoot.validation.loops import Loop, loops_of, repeatability
from tubefoot.validation.overlay import Comparison, compare
from tubefoot.validation.prediction import Prediction, prediction_for
from tubefoot.validation.recording import BenchRecord
from tubefoot.validation.settled import SETTLE_S, SettledState, last_rest, settled_states
from tubefoot.validation.verdicts import judge_recordings

Say = Callable[[str], None]


@dataclass(frozen=True)
class Validated:
    """What validation found.

    records : the recordings; states, loops : of each, by name
    comparisons : of each with its prediction; claims : judged; steadiness : repeatability and drift, by name
    """

    records: Sequence[BenchRecord]
    states: Mapping[str, Sequence[SettledState]]
    loops: Mapping[str, Sequence[Loop]]
    comparisons: Sequence[Comparison]
    steadiness: Mapping[str, Mapping[str, float]]
    claims: Sequence[Claim]


def validate_recordings(
    records: Sequence[BenchRecord],
    predictions: Sequence[Prediction],
    settle: float = SETTLE_S,
    seed: int = 0,
    say: Say = lambda _: None,
) -> Validated:
    """Recordings held against predictions of fingers of the same length.

    records : with distinct names
    predictions : of as many lengths as the recordings have
    settle : from a pulse's end to the state that is compared [s]
    seed : of the bootstrap
    say : told of each recording

    Raises ConfigError where a recording finds no prediction, or has no angles.
    """
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise ConfigError(f"recordings share a name: {', '.join(names)}; rename a file")
    states, loops, steadiness, comparisons = {}, {}, {}, []
    for record in records:
        say(f"{record.name}: {len(record.pulses)} pulses in {record.duration:.0f} s")
        if not record.has_angles:
            raise ConfigError(
                f"{record.name}: no angles in this recording; record with a camera, or name the angles' file "
                "in the column map"
            )
        prediction = prediction_for(record.units, list(predictions), record.name)
        found = settled_states(record, settle)
        states[record.name], loops[record.name] = found, loops_of(found)
        steadiness[record.name] = {**repeatability(found), **_left_over(record)}
        comparisons.append(compare(record.name, found, prediction, seed))
    return Validated(records, states, loops, comparisons, steadiness, judge_recordings(comparisons, states))


def write_validation(found: Validated, directory: Path) -> None:
    """Write states.csv, comparison.csv, bands.csv, loops.csv, validation.json and claims.json.

    found : by `validate_recordings`
    directory : of the run
    """
    write_table(
        directory / "states.csv",
        [{"recording": name, **state.row()} for name, states in found.states.items() for state in states],
    )
    rows = [{**one.row(), **found.steadiness[one.recording]} for one in found.comparisons]
    write_table(directory / "comparison.csv", rows)
    bands = [
        {"recording": one.recording, **{key: float(column[row]) for key, column in one.band.items()}}
        for one in found.comparisons
        for row in range(len(one.band["pressed_kpa"]))
    ]
    write_table(directory / "bands.csv", bands)
    loops = [{"recording": name, **loop.row()} for name, mine in found.loops.items() for loop in mine]
    write_table(directory / "loops.csv", loops, None if loops else ["recording", "cycle", "side"])
    claims = [claim.as_record() for claim in found.claims]
    write_json(directory / "claims.json", claims)
    record = {
        "recordings": [_about(one) for one in found.records],
        "comparisons": [_comparison(one, found.steadiness[one.recording]) for one in found.comparisons],
        "claims": claims,
    }
    write_json(directory / "validation.json", record)


def _left_over(record: BenchRecord) -> dict[str, float]:
    """What is left of pressures and angle when the finger was brought back at the end; nan if it was not."""
    state = last_rest(record)
    nan = float("nan")
    return {
        "end_right_kpa": state.right / KPA if state else nan,
        "end_left_kpa": state.left / KPA if state else nan,
        "end_bend_deg": state.angle / DEG if state else nan,
    }


def _about(record: BenchRecord) -> dict[str, Any]:
    rest, latency = record.rest, record.latency
    return {
        "name": record.name,
        "units": record.units,
        "duration_s": record.duration,
        "samples": len(record.time),
        "angles": len(record.angle),
        "pulses": len(record.pulses),
        "flagged_samples": record.odd_samples,
        "flagged_angles": int(record.angle_outlier.sum()),
        "rest_right_kpa": rest.pressures[0] / KPA,
        "rest_left_kpa": rest.pressures[1] / KPA,
        "rest_bend_deg": rest.angle / DEG,
        "noise_right_kpa": rest.sigma[0] / KPA,
        "noise_left_kpa": rest.sigma[1] / KPA,
        "noise_bend_deg": rest.sigma[2] / DEG,
        "drift_taken_off_right_kpa_per_min": rest.drift[0] * 60 / KPA,
        "drift_taken_off_left_kpa_per_min": rest.drift[1] * 60 / KPA,
        "latency_ms": 1e3 * latency.seconds,
        "latency_sigma_ms": 1e3 * latency.sigma,
        "latency_correlation": latency.correlation,
        "latency_applied": latency.applied,
        "source": dict(record.provenance),
    }


def _comparison(one: Comparison, steadiness: Mapping[str, float]) -> dict[str, Any]:
    return {
        "recording": one.recording,
        "units": one.units,
        "run": one.run,
        "states": one.states,
        "strokes": one.strokes,
        "states_beyond_prediction": one.beyond,
        "top_pressure_kpa": one.top / KPA,
        "confidence": "bootstrap of strokes"
        if one.whole_strokes
        else "bootstrap of single states: too narrow",
        "figures": {name: asdict(estimate) for name, estimate in one.figures.items()},
        "predicted": one.predicted,
        "steadiness": dict(steadiness),
    }
