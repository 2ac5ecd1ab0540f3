"""Run directories: whole files or none, tables that read back, `run.toml` with settings and versions."""

import json
import tomllib

import pytest

from tubefoot.errors import ConfigError
from tubefoot.records import Run, read_table, write_json, write_table, write_whole


def test_a_table_reads_back(tmp_path):
    rows = [{"step": 0, "angle_deg": 1 / 3, "where": "tip"}, {"step": 1, "angle_deg": -2.5e-7, "where": ""}]
    write_table(tmp_path / "t.csv", rows)
    back = read_table(str(tmp_path / "t.csv"))
    assert back[0]["where"] == "tip"
    assert back[0]["angle_deg"] == pytest.approx(1 / 3, rel=1e-8)
    assert back[1]["angle_deg"] == pytest.approx(-2.5e-7, rel=1e-8)
    with pytest.raises(ConfigError, match="no such table"):
        read_table(tmp_path / "none.csv")


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = write_whole(tmp_path / "a.txt", "old")

    with pytest.raises(TypeError):
        write_whole(path, 3)
    assert path.read_text() == "old"
    write_whole(path, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert path.read_text() == "new"


def test_json_has_null_for_what_is_not_finite(tmp_path):
    path = write_json(tmp_path / "a.json", {"a": float("nan"), "b": [1.0, float("inf")]})
    assert json.loads(path.read_text()) == {"a": None, "b": [1.0, None]}


def test_run_toml_holds_settings_versions_and_seed(tmp_path):
    run = Run(tmp_path / "deep" / "run", "solve", {"a": {"b": 1.5, "none": None}}, seed=7)
    record = tomllib.loads(run.finish(end_reason="goal").read_text())
    assert record["settings"] == {"a": {"b": 1.5}}
    assert record["run"]["seed"] == 7
    assert record["run"]["end_reason"] == "goal"
    assert record["run"]["wall_s"] >= 0
    assert "numpy" in record["versions"]


def test_an_out_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(ConfigError, match="cannot be made a directory"):
        Run(tmp_path / "file", "solve", {})
