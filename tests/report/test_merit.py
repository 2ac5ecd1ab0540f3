from dataclasses import replace

import numpy as np
import pytest

from tubefoot.report.merit import (
    check_lines,
    energy_error,
    exchange_error,
    pressure_angle_fit,
    summary_lines,
)
from tubefoot.report.runs import load_run


@pytest.fixture
def run(recorded):
    return load_run(recorded)


def edited(run, **columns):
    return replace(run, curve={**run.curve, **columns})


def test_the_gain_of_a_straight_curve_is_its_slope(run):
    fit = pressure_angle_fit(run)
    assert fit.slope == pytest.approx(0.2)
    assert fit.r_squared == pytest.approx(1.0)
    assert fit.deviation == pytest.approx(0.0, abs=1e-9)


def test_a_bent_curve_deviates_from_its_line(run):
    bent = edited(run, bend_deg=run.curve["pressure_right_kpa"] ** 2)
    assert pressure_angle_fit(bent).r_squared < 0.95
    assert pressure_angle_fit(bent).deviation > 10.0


def test_work_equals_energy_whichever_way_the_pump_runs(run, reversed_run):
    # The curve is k q^2, so splines integrate it exactly; CSV keeps nine digits.
    assert energy_error(run) < 1e-6
    assert energy_error(load_run(reversed_run)) < 1e-6


def test_missing_energy_shows(run):
    short = edited(run, strain_energy_mj=0.9 * run.curve["strain_energy_mj"])
    assert energy_error(short) == pytest.approx(100 / 0.9 - 100, rel=1e-6)


def test_a_path_that_turns_back_is_integrated_by_trapezoids(run):
    there_and_back = {key: np.r_[value, value[-2::-1]] for key, value in run.curve.items()}
    stored = there_and_back["strain_energy_mj"].copy()
    stored[-1] = stored.max()
    assert energy_error(edited(run, **{**there_and_back, "strain_energy_mj": stored})) == pytest.approx(100.0)


def test_lost_fluid_shows_in_the_exchange(run):
    assert exchange_error(run) == pytest.approx(0.0, abs=1e-9)
    leaking = edited(run, volume_change_left_ml=0.97 * run.curve["volume_change_left_ml"])
    assert exchange_error(leaking) == pytest.approx(3.0)


def test_a_single_state_has_no_gain(run):
    single = replace(run, curve={key: value[-1:] for key, value in run.curve.items()})
    assert pressure_angle_fit(single) is None
    assert energy_error(single) is None


def test_lines_hold_one_value_a_run(run, reversed_run):
    runs = [run, load_run(reversed_run)]
    lines = {line.name: line for line in [*summary_lines(runs), *check_lines(runs)]}
    assert lines["bend angle"].values == pytest.approx([4.0, -4.0])
    assert lines["smallest volume ratio det F"].values == pytest.approx([0.95, 0.95])
    assert lines["peak memory"].values == [None, None]
