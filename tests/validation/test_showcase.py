"""The verb validate and the demo's virtual experiments, from files to claims."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pandas as pd
import pytest

from tubefoot.cli.main import app
from tubefoot.cli.validate import validate
from tubefoot.config import load_settings
from tubefoot.errors import ConfigError
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.validation.campaign import load_campaign
from tubefoot.validation.showcase import validate_virtual
from tubefoot.validation.virtual_experiment import bonded_bench

EXAMPLES = Path(__file__).parents[2] / "examples"
FOREIGN = EXAMPLES / "recordings" / "foreign-lab.csv"


def solved(folder, units, gain):
    """A run directory with a curve like that of the reference finger, and a run.toml that names its units."""
    folder.mkdir(parents=True)
    rows = [(step, 3.5 * step, -3.5 * step - 0.15 * step**2, gain * 3.5 * step) for step in range(11)]
    text = "".join(",".join(f"{value:.6g}" for value in row) + "\n" for row in rows)
    (folder / "curve.csv").write_text("step,pressure_right_kpa,pressure_left_kpa,bend_deg\n" + text)
    (folder / "run.toml").write_text(f"[settings.design.bellows]\nunits = {units}\n")
    return folder


@pytest.fixture(scope="module")
def validated(tmp_path_factory):
    """Directory of `validate` on the example of a foreign laboratory."""
    root = tmp_path_factory.mktemp("foreign")
    run = solved(root / "reference-3", 3, 0.53)
    columns = FOREIGN.with_suffix(".toml")
    app(
        ["validate", str(FOREIGN), "--columns", str(columns), "--against", str(run), "--out", str(root / "v")]
    )
    return root / "v"


def test_a_foreign_recording_is_validated_as_typed(validated):
    record = json.loads((validated / "validation.json").read_text())
    (recording,), (comparison,) = record["recordings"], record["comparisons"]
    assert recording["units"] == comparison["units"] == 3
    assert recording["source"]["unit_pressure_left"] == "psi"
    # README.md of the example: stamps 120 ms late, three spikes, pressures absolute.
    assert recording["latency_ms"] == pytest.approx(120, abs=3 * recording["latency_sigma_ms"])
    assert recording["latency_sigma_ms"] < 25
    assert recording["latency_applied"]
    assert recording["flagged_samples"] == 3
    assert recording["rest_right_kpa"] == pytest.approx(101.8, abs=0.5)
    assert comparison["figures"]["angle_offset_high_deg"]["high"] < -5
    assert {claim["id"]: claim["verdict"] for claim in record["claims"]} == {
        "C5": "holds",
        "C6": "refuted",
        "C9": "holds",
    }


def test_every_table_has_its_units_and_the_run_its_record(validated):
    for name in ("states", "comparison", "bands", "loops"):
        assert len(pd.read_csv(validated / f"{name}.csv")) > 0
    states = pd.read_csv(validated / "states.csv")
    assert states["sigma_bend_deg"].median() < 0.05
    run = tomllib.loads((validated / "run.toml").read_text())
    assert run["run"]["verb"] == "validate"
    assert run["run"]["C9"] == "holds"
    assert run["settings"]["columns"]["columns"]["time"]["unit"] == "ms"
    assert (validated / "validation.png").stat().st_size > 20_000


def test_a_recording_without_a_run_of_its_length_is_refused(tmp_path):
    run, columns = solved(tmp_path / "six", 6, 1.0), FOREIGN.with_suffix(".toml")
    with pytest.raises(ConfigError, match=r"has 3 units; no run of that length among six \(6\)"):
        app(
            [
                "validate",
                str(FOREIGN),
                "--columns",
                str(columns),
                "--against",
                str(run),
                "--out",
                str(tmp_path),
            ]
        )


def test_examples_are_what_they_say():
    assert load_settings(EXAMPLES / "benches" / "bonded.toml", BenchSettings) == bonded_bench()
    for path in (EXAMPLES / "campaigns").glob("*.toml"):
        assert load_campaign(path).repeats >= 1


@pytest.mark.slow
def test_virtual_experiments_show_the_offsets_of_the_paper(tmp_path):
    """C9 in sign, and the same recordings again without running the bench anew."""
    solves = {n: solved(tmp_path / f"reference-{n}", n, gain) for n, gain in ((3, 0.53), (6, 1.02))}
    said: list[str] = []
    found = validate_virtual(tmp_path / "v", solves, said.append)
    assert {claim.id: claim.verdict for claim in found.claims}["C9"] == "holds"
    assert any("repeat 2/2" in line for line in said)
    said.clear()
    again = validate_virtual(tmp_path / "v", solves, said.append)
    assert not any("repeat" in line for line in said)
    assert again.claims == found.claims


def test_validate_shows_the_attribution_of_a_fit(validated, tmp_path, capsys):
    from tubefoot.validation.showcase import attribute_bonded

    attribute_bonded(tmp_path / "fit", 3)
    found = json.loads((tmp_path / "fit" / "attribution.json").read_text())
    run, columns = validated.parent / "reference-3", FOREIGN.with_suffix(".toml")
    files = ["--columns", str(columns), "--against", str(run)]
    app(["validate", str(FOREIGN), *files, "--fit", str(tmp_path / "fit"), "--out", str(tmp_path / "v")])
    told = capsys.readouterr().out
    assert f"bend_deg: offset {found['offset']['bend_deg']:+.2f}, mainly by relaxation" in told
    assert (tmp_path / "v" / "figures" / "attribution.png").stat().st_size > 10_000
    with pytest.raises(ConfigError, match="no such file; name the --out of a `tubefoot fit`"):
        validate(FOREIGN, against=[run], fit=tmp_path)
