"""The solve stage on a coarse one-unit finger: landing, resuming, refusing, and physical ends."""

import json
import multiprocessing
import os
import signal

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.path import follow
from tubefoot.fea.recorder import CURVE_COLUMNS
from tubefoot.fea.solve import solve_design
from tubefoot.fea.stride import StepControl
from tubefoot.records import read_table

FINGER = FingerDesign().with_bellows(units=1)
COARSE = {"element_size_mm": 3.5, "states": 3, "fields": "none"}


def settings(**keys):
    return SolveSettings(**{**COARSE, **keys})


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    return solve_design(FINGER, tmp_path_factory.mktemp("solve"), settings(target=12.0, fields="last"))


def test_results_are_complete(solved):
    table = read_table(solved.directory / "curve.csv")
    assert list(table[0]) == list(CURVE_COLUMNS)
    assert len(table) == len(solved.curve)
    for name in ("run.toml", "regions.csv", "units.csv", "summary.json", "fields.pvd"):
        assert (solved.directory / name).exists(), name
    summary = json.loads((solved.directory / "summary.json").read_text())
    assert summary["converged"] is True
    assert summary["end_reason"] == "goal reached"


@pytest.mark.parametrize(
    ("until", "target", "column"),
    [
        ("pressure_right_kpa", 12.0, "pressure_right_kpa"),
        ("pressure_left_kpa", -8.0, "pressure_left_kpa"),
        ("pressure_left_kpa", 6.0, "pressure_left_kpa"),
        ("volume_change_right_ml", 0.03, "volume_change_right_ml"),
        ("pumped_volume_ml", -0.02, "pumped_volume_ml"),
        ("bend_deg", 2.0, "bend_deg"),
        ("bend_deg", -1.0, "bend_deg"),
    ],
)
@pytest.mark.parametrize("states", [1, 3])
def test_the_path_lands_exactly_on_the_goal(tmp_path, until, target, column, states):
    result = solve_design(FINGER, tmp_path, settings(until=until, target=target, states=states))
    assert result.summary["end_reason"] == "goal reached"
    assert result.column(column)[-1] == pytest.approx(target, rel=1e-7)


def test_pumping_is_coupled_and_bends_towards_the_left(solved):
    right, left = solved.column("volume_change_right_ml"), solved.column("volume_change_left_ml")
    assert np.allclose(right, -left, atol=1e-9)
    assert np.allclose(right, solved.column("pumped_volume_ml"), atol=1e-9)
    assert (np.diff(solved.column("bend_deg")) > 0).all()
    assert solved.column("tip_x_mm")[-1] < 0
    halves = solved.column("theta1_deg") + solved.column("theta2_deg")
    assert np.allclose(halves, solved.column("bend_deg"))


def test_trapped_air_takes_up_what_the_chambers_do_not(tmp_path):
    result = solve_design(
        FINGER, tmp_path, settings(until="pumped_volume_ml", target=0.05, air_right_ml=1.0, air_left_ml=0.5)
    )
    atmosphere = 101.325
    for hand, volume, sign in (("right", 1.0, 1), ("left", 0.5, -1)):
        pressure = result.column(f"pressure_{hand}_kpa")
        air = volume * pressure / (atmosphere + pressure)
        inflow = result.column(f"volume_change_{hand}_ml") + air
        assert np.allclose(inflow, sign * result.column("pumped_volume_ml"), atol=1e-8)


def test_pressure_and_volume_drives(tmp_path):
    result = solve_design(
        FINGER, tmp_path / "p", settings(cavities="pressure", left_over_right=-0.5, target=8.0)
    )
    assert np.allclose(result.column("pressure_left_kpa"), -0.5 * result.column("pressure_right_kpa"))
    result = solve_design(
        FINGER, tmp_path / "v", settings(cavities="volume", left_over_right=0.25, target=6.0)
    )
    right, left = result.column("volume_change_right_ml"), result.column("volume_change_left_ml")
    assert np.allclose(left, 0.25 * right, atol=1e-9)


def test_a_finished_run_is_not_solved_again(solved):
    calls = []
    again = solve_design(
        FINGER, solved.directory, settings(target=12.0, fields="last"), progress=calls.append
    )
    assert calls == []
    assert again.summary == solved.summary


def test_another_run_is_not_overwritten_unasked(solved):
    before = (solved.directory / "curve.csv").read_bytes()
    with pytest.raises(ConfigError, match="--overwrite"):
        solve_design(FINGER, solved.directory, settings(target=11.0))
    assert (solved.directory / "curve.csv").read_bytes() == before


def _solve_and_die(directory):
    def die_after_two(row):
        if row["step"] == 2:
            os.kill(os.getpid(), signal.SIGKILL)

    solve_design(FINGER, directory, settings(target=12.0), progress=die_after_two)


def test_a_killed_run_goes_on_at_its_last_state(tmp_path, solved):
    worker = multiprocessing.get_context("spawn").Process(target=_solve_and_die, args=(tmp_path,))
    worker.start()
    worker.join()
    assert worker.exitcode == -signal.SIGKILL
    assert len(read_table(tmp_path / "curve.csv")) == 3
    calls = []
    result = solve_design(FINGER, tmp_path, settings(target=12.0), progress=calls.append)
    assert [row["step"] for row in calls] == [row["step"] for row in result.curve[3:]]
    assert result.column("bend_deg")[-1] == pytest.approx(solved.column("bend_deg")[-1], rel=1e-7)
    assert [int(row["step"]) for row in result.curve] == list(range(len(result.curve)))


def test_absolute_vacuum_ends_the_path(tmp_path):
    result = solve_design(FINGER, tmp_path, settings(until="pressure_right_kpa", target=300.0, states=8))
    assert result.summary["end_reason"] != "goal reached"
    assert result.converged
    assert result.column("pressure_left_kpa")[-1] >= -101.325 - 1e-6


def test_a_path_that_breaks_off_is_not_a_result(tmp_path, monkeypatch):
    monkeypatch.setattr("tubefoot.fea.solve.StepControl", lambda states: StepControl(states=states, most=2))
    with pytest.raises(ConvergenceError, match="not reached in 2 states"):
        solve_design(FINGER, tmp_path, settings(target=12.0))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["converged"] is False
    assert len(read_table(tmp_path / "curve.csv")) == summary["states"] == 2


def test_the_error_carries_the_last_good_state():
    finger = build_finger(FINGER, settings(target=12.0))
    with pytest.raises(ConvergenceError) as caught:
        follow(finger.model, finger.goal, stepping=StepControl(states=3, most=3))
    steps = caught.value.last_state.steps
    assert len(steps) == 3
    assert steps[-1].state.pressures[0] > 0


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"target": 0.0}, "at rest"),
        ({"until": "pressure_left_kpa", "target": -150.0}, "absolute vacuum"),
        ({"until": "bend_rad"}, "bend_deg"),
        ({"element_size_mm": 0.01}, "0.2 to 10"),
        ({"states": 0}, "1 to 400"),
        ({"elment_size_mm": 1.0}, "element_size_mm"),
        ({"air_right_ml": -1.0}, "0 to 100"),
    ],
)
def test_bad_settings_are_explained(table, words):
    with pytest.raises(ConfigError, match=words):
        parse_settings(table, SolveSettings)


def test_pumped_volume_is_no_goal_of_a_pressure_drive(tmp_path):
    with pytest.raises(ConfigError, match="drive by volume"):
        solve_design(FINGER, tmp_path, settings(until="pumped_volume_ml", target=0.1, cavities="pressure"))


TALL = FingerDesign().with_bellows(units=1, height_mm=14.0)


def test_a_finger_goes_on_through_the_contact_of_its_walls(tmp_path):
    result = solve_design(TALL, tmp_path, settings(element_size_mm=5.0, target=32.0))
    assert result.summary["end_reason"] == "goal reached"
    gaps = result.column("contact_gap_min_mm")
    reach = SolveSettings().contact_reach_mm
    # The walls lie on each other, and neither has gone through the other by 2 % of the thinnest wall.
    assert gaps[-1] < reach
    assert gaps.min() > -0.02 * 1.5


def test_without_self_contact_the_path_ends_where_walls_touch(tmp_path):
    result = solve_design(TALL, tmp_path, settings(element_size_mm=5.0, target=32.0, self_contact=False))
    assert result.summary["end_reason"].startswith("self-contact: flank inside left")
    assert result.column("pressure_right_kpa")[-1] < 32.0
    assert result.column("contact_gap_min_mm")[-1] > 0.0
