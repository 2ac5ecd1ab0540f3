"""`tubefoot bend` as a user meets it: files, keys, bad input, Ctrl-C."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest

from tubefoot.cli.main import app
from tubefoot.config import read_toml
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.lab.recording import Recording
from tubefoot.records import read_table
from tubefoot.study.bench_claims import (
    BendRecord,
    judge_bench_pressures,
    judge_bench_reversal,
    judge_columns,
    judge_tracking,
)

KEYS = {
    "target_deg",
    "controller",
    "seed",
    "settled",
    "iterations",
    "final_error_deg",
    "overshoot_deg",
    "bench_time_s",
    "end_reason",
}


def bend(*words):
    app(["bend", *map(str, words)])


@pytest.fixture(scope="module")
def there_and_back(tmp_path_factory):
    out = tmp_path_factory.mktemp("bend")
    bend(12, "--sim", "--quick", "--return", "--controller", "paper", "--seed", 3, "--out", out)
    return out


@pytest.fixture(scope="module")
def the_other_way(tmp_path_factory):
    out = tmp_path_factory.mktemp("bend")
    bend(-12, "--sim", "--quick", "--out", out)
    return out


def test_files_and_keys(there_and_back):
    summary = json.loads((there_and_back / "summary.json").read_text())
    assert summary.keys() >= KEYS
    assert summary["return"].keys() >= KEYS - {"controller", "seed"}
    assert summary["settled"]
    assert summary["return"]["settled"]
    assert read_toml(there_and_back / "run.toml")["run"]["seed"] == 3
    assert (there_and_back / "bend.png").stat().st_size > 20_000
    rows = read_table(there_and_back / "bend.csv")
    assert {row["part"] for row in rows} == {"to target", "return"}
    assert rows[-1]["bend_deg"] == pytest.approx(0.0, abs=1.0)
    np.testing.assert_allclose([row["bend_deg"] - row["true_bend_deg"] for row in rows[:10]], 0, atol=0.2)


def test_the_recording_holds_samples_pulses_and_decisions(there_and_back):
    recording = Recording(there_and_back / "bench.mcap")
    summary = json.loads((there_and_back / "summary.json").read_text())
    pulses = summary["iterations"] + summary["return"]["iterations"]
    assert recording.complete
    assert len(recording.rows("pulses")) == pulses
    decided = [row["values"]["command"] for row in recording.rows("decisions")]
    assert decided.count("pulse") == pulses
    assert decided.count("finished") == 2
    assert len(recording.rows("samples")) > 1000


def test_the_recording_holds_the_angles_of_every_frame_and_can_be_validated(there_and_back):
    """Also between decisions, where the finger creeps: 30 frames a second less those that were dropped."""
    from tubefoot.validation.loading import load_recording

    recording = Recording(there_and_back / "bench.mcap")
    angles, rows = recording.rows("angles"), read_table(there_and_back / "bend.csv")
    assert len(angles) == len(rows)
    assert [row["bend_deg"] for row in angles] == pytest.approx([row["bend_deg"] for row in rows], abs=1e-3)
    apart = np.diff([row["time_s"] for row in angles])
    assert np.median(apart) == pytest.approx(1 / 30, rel=0.02)
    record = load_recording(there_and_back / "bench.mcap")
    assert len(record.angle) == len(angles)
    assert record.latency.seconds == pytest.approx(0.0, abs=0.05)


def test_claims_are_judged_on_the_records(there_and_back, the_other_way):
    run, other = BendRecord(there_and_back), BendRecord(the_other_way)
    assert judge_bench_pressures(run).verdict == "holds"
    assert judge_bench_pressures(run).numbers["slope"] < -0.4
    assert judge_columns(run).verdict == "holds"
    assert judge_bench_reversal(run, other).verdict == "holds"
    assert judge_bench_reversal(other, run).verdict == "refuted"
    assert judge_tracking(run).numbers["iterations_to_30"] == run.summary["iterations"]


def test_tracking_is_judged_by_iterations_and_final_error(there_and_back):
    run = BendRecord(there_and_back)
    good = {"settled": True, "iterations": 7, "iterations_to_band": 7, "final_error_deg": 0.9}
    good |= {"overshoot_deg": 0.0, "bench_time_s": 1.0}
    for forward, back, verdict in (
        ({}, {}, "holds"),
        ({}, {"iterations": 8}, "mixed"),
        ({"final_error_deg": -1.1}, {"iterations": 8}, "refuted"),
        ({"iterations": 12}, {}, "mixed"),
    ):
        run.__dict__["summary"] = {**good, **forward, "return": {**good, **back}}
        assert judge_tracking(run).verdict == verdict


def test_a_trajectory_is_followed_and_its_flow_told(tmp_path):
    path = tmp_path / "ramp.csv"
    path.write_text("time_s,bend_deg\n0,0\n4,8\n6,8\n")
    bend("--trajectory", path, "--sim", "--quick", "--out", tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["controller"] == "tracking"
    assert summary["rms_error_deg"] < 1.0
    assert 0.05 < summary["flow_needed_ml_per_s"] < summary["flow_of_pump_ml_per_s"]


def test_an_unsettled_motion_is_an_error_and_is_written(tmp_path):
    settings = tmp_path / "bend.toml"
    settings.write_text("[goal]\ntime_max_s = 1.0\n")
    with pytest.raises(ConvergenceError, match="not settled within 1 s"):
        bend(30, "--sim", "--quick", "--settings", settings, "--out", tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["settled"] is False
    assert summary["end_reason"] == "not settled within 1 s"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--sim"], "target in degrees or --trajectory"),
        ([30], "--camera is missing"),
        ([400, "--sim"], r"outside of the \d+ deg"),
        (["nan", "--sim"], "nan deg is outside"),
        ([30, "--sim", "--controller", "tracking"], "tracking goes with --trajectory"),
    ],
)
def test_bad_input_is_told(words, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        bend(*words, "--out", tmp_path)


def test_ctrl_c_stops_the_pump_and_writes_everything(tmp_path):
    words = ["bend", "30", "--sim", "--quick", "--real-time", "--out", str(tmp_path)]
    # What is started in the background ignores Ctrl-C, and so would what it starts.
    hears = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{hears}; from tubefoot.cli.main import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["end_reason"].startswith("interrupted")
    recording = Recording(tmp_path / "bench.mcap")
    assert recording.rows("pulse_ends")[-1]["reason"] == "stopped"
    assert (tmp_path / "bend.csv").exists()
    assert (tmp_path / "run.toml").exists()
