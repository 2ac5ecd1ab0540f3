"""`tubefoot fit material` as typed: the shipped examples, files and figures, sentences."""

import json
import tomllib
from pathlib import Path

import pytest

from tubefoot.cli.main import app

EXAMPLES = Path(__file__).parents[2] / "examples" / "materials"


def test_the_shipped_dynamic_test_gives_the_shipped_relaxation(tmp_path, capsys):
    app(["fit", "material", str(EXAMPLES / "agilus30_dma_20C.csv"), "--out", str(tmp_path)])
    said = capsys.readouterr().out
    assert "long-term tensile modulus 1.167 MPa" in said
    assert (tmp_path / "figures/prony.png").stat().st_size > 20_000
    body = tomllib.loads((tmp_path / "material.toml").read_text())["body"]
    assert body["relaxation_time_s"][0] == pytest.approx(0.1)
    assert (tmp_path / "run.toml").exists()


def test_published_data_of_other_making(tmp_path, capsys):
    options = ["--terms", "2", "--stretch-high", "7.6", "--out", str(tmp_path)]
    app(["fit", "material", str(EXAMPLES / "treloar.toml"), *options])
    said = capsys.readouterr().out
    assert "not determined" in said
    record = json.loads((tmp_path / "fit.json").read_text())["ogden"]
    # Treloar's own value of the shear modulus of this rubber is 4 kgf/cm2, from small stretches.
    assert record["shear_modulus_mpa"] == pytest.approx(0.39, abs=0.12)
    assert record["misfit"] < 1.0
    for name in ("ogden", "profiles"):
        assert (tmp_path / f"figures/{name}.svg").exists()
