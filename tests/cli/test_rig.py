"""The verbs of the bench as a user types them, on the simulated board."""

from __future__ import annotations

import tomllib

import pandas as pd
import pytest

from tubefoot.cli.main import app
from tubefoot.errors import ConfigError
from tubefoot.lab.recording import Recording

STEPS = "time_s,direction,duty,duration_s\n0.2,1,0.8,0.2\n0.6,-1,0.8,0.2\n"


def test_check_passes_on_the_simulated_board(tmp_path, capsys):
    app(["rig", "check", "--sim", "--out", str(tmp_path)])
    table = pd.read_csv(tmp_path / "check.csv")
    assert table["passed"].all()
    assert "pump forward" in table["check"].tolist()
    assert f"results: {tmp_path}" in capsys.readouterr().out
    assert tomllib.loads((tmp_path / "run.toml").read_text())["run"]["verb"] == "rig check"


def test_record_runs_pulses_and_can_be_repeated(tmp_path):
    steps = tmp_path / "steps.csv"
    steps.write_text(STEPS)
    for name in ("bench.mcap", "bench-2.mcap"):
        app(["rig", "record", "--sim", "--pulses", str(steps), "--out", str(tmp_path / "run")])
        recording = Recording(tmp_path / "run" / name)
        assert recording.complete
        assert recording.table("pulse_ends")["reason"].tolist() == ["completed", "completed"]


def test_pulse_beyond_the_limits_is_refused_before_anything_moves(tmp_path):
    with pytest.raises(ConfigError, match=r"duration 9 s is outside 0 to 5 s.*limits.pulse_max_s"):
        app(["rig", "pulse", "forward", "--duration-s", "9", "--sim", "--out", str(tmp_path / "x")])
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,direction,duty\n0,1,1\n", "line 2: needs numbers"),
        ("time_s,direction,duty,duration_s\n0,2,1,0.1\n", "direction is 1 or -1"),
        ("time_s,direction,duty,duration_s\n0,1,1,2\n1,1,1,2\n", "line 3: begins before"),
    ],
)
def test_a_wrong_list_of_pulses_is_refused_by_line(tmp_path, text, message):
    steps = tmp_path / "steps.csv"
    steps.write_text(text)
    with pytest.raises(ConfigError, match=message):
        app(["rig", "record", "--sim", "--pulses", str(steps), "--out", str(tmp_path / "x")])


@pytest.mark.slow
def test_pump_calibration_finds_the_simulated_pump(tmp_path):
    app(["rig", "calibrate", "pump", "--sim", "--out", str(tmp_path)])
    pump = tomllib.loads((tmp_path / "rig.toml").read_text())["pump"]
    for way, flow, dead in (("forward", 1.45, 0.14), ("reverse", 1.38, 0.16)):
        law = pump[way]
        assert law["flow_ml_per_s"] == pytest.approx(flow, abs=max(3 * law["flow_sigma_ml_per_s"], 0.03))
        assert law["dead_duty"] == pytest.approx(dead, abs=max(3 * law["dead_duty_sigma"], 0.02))
