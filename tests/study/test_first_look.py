"""Calibration of the look: factors recovered, errors of what is left out; the look against full solves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.candidates import make_candidate
from tubefoot.study.evaluation import Job, evaluate
from tubefoot.study.look import (
    LOOKED,
    Pair,
    calibrate,
    look_solve,
    looked_figures,
    short_candidate,
    solved_figures,
    spread_over,
)
from tubefoot.study.study_file import LookSettings, StudyFile

LOOK = LookSettings()


def pairs(noise: float, lengths: tuple[int, ...] = (3, 4, 6)) -> list[Pair]:
    """Full solves that are 0.9 (n / 2)^0.1 times the look, times noise."""
    random = np.random.default_rng(5)
    made = []
    for k in range(12):
        units = lengths[k % len(lengths)]
        looked = random.uniform(1.0, 2.0, len(LOOKED))
        error = np.exp(noise * random.standard_normal(len(LOOKED)))
        made.append(Pair(units, looked, looked * 0.9 * (units / 2) ** 0.1 * error))
    return made


def test_factors_of_exact_pairs_are_recovered_for_any_length() -> None:
    found = calibrate(pairs(0.0), LOOK)
    assert np.allclose(np.exp(found.factors[0]), 0.9)
    assert np.allclose(found.factors[1], 0.1)
    assert np.abs(found.errors).max() < 1e-12
    foretold = found.foretell(12, np.ones(len(LOOKED)))
    assert foretold["bend_deg_at_35kpa"] == pytest.approx(0.9 * 6**0.1)
    assert found.rank_correlation == pytest.approx(1.0)


def test_errors_are_those_of_pairs_left_out() -> None:
    found = calibrate(pairs(0.03, lengths=(3,)), LOOK)
    # Leaving one of twelve out widens the scatter by 12 / 11.
    assert found.spread.mean() == pytest.approx(0.03 * 12 / 11, rel=0.25)
    summary = found.summary()["bend_deg_at_35kpa"]
    assert 0 < summary["median_error_percent"] < summary["largest_error_percent"] < 15


def test_angles_grow_with_length_and_stresses_do_not() -> None:
    figures = dict.fromkeys(LOOKED, 1.0)
    looked = dict(zip(LOOKED, looked_figures(figures, 6, LOOK), strict=True))
    assert looked["bend_deg_at_35kpa"] == 3.0
    assert looked["von_mises_p99_kpa"] == 1.0


def test_chosen_candidates_span_the_range() -> None:
    values = np.array([5.0, np.nan, 1.0, 9.0, 3.0, 7.0, 2.0])
    assert spread_over(values, 3) == [2, 4, 3] or spread_over(values, 3) == [2, 0, 3]
    assert sorted(spread_over(values, 10)) == [0, 2, 3, 4, 5, 6]


@pytest.mark.slow
def test_two_coarse_units_foretell_three(tmp_path: Path) -> None:
    study = StudyFile(
        vary={"fold_run_mm": [5.0]}, solve=SolveSettings(element_size_mm=3.0, states=3, fields="none")
    )
    base = FingerDesign().with_bellows(units=3, valley_outside_mm=6.0)
    found = []
    for changes in ({}, {"fold_run_mm": 3.0}, {"fold_wall_mm": 1.2}, {"partition_mm": 3.0}):
        whole = make_candidate(base, "", {f"bellows.{key}": value for key, value in changes.items()})
        records = []
        for one, solve, share in (
            (short_candidate(whole, LOOK), look_solve(study), 2 / 3),
            (whole, study.solve, 1.0),
        ):
            tables = solve.model_dump(mode="json")
            job = Job("", one.key(solve), str(tmp_path), one.tables, tables, 9.0 * share, 5.0, True, False)
            records.append(evaluate(job))
        found.append(Pair(3, looked_figures(records[0], 3, LOOK), solved_figures(records[1])))
    errors = np.abs(calibrate(found, LOOK).errors).max(axis=0)
    by_name = dict(zip(LOOKED, errors, strict=True))
    # Measured 0.5 % and 3 %.
    assert by_name["bend_deg_at_35kpa"] < 0.02
    assert by_name["von_mises_p99_at_angle_kpa"] < 0.10
