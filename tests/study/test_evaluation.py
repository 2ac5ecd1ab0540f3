"""One job: statuses, the folder that appears whole, resuming at a converged state, its figures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study import evaluation
from tubefoot.study.candidates import make_candidate
from tubefoot.study.curve import Curve, line_fit
from tubefoot.study.evaluation import RECORD, Job, evaluate, finished

SOLVE = SolveSettings(element_size_mm=8.0, states=2, fields="none")


def job(root: Path, solve: SolveSettings = SOLVE, **dimensions: float) -> Job:
    base = FingerDesign().with_bellows(units=1)
    one = make_candidate(base, "one", {f"bellows.{key}": value for key, value in dimensions.items()})
    tables = solve.model_dump(mode="json")
    return Job("one", one.key(solve), str(root), one.tables, tables, 3.0, 5.0, True, False)


def test_a_solved_candidate_has_its_folder_tables_and_figures(tmp_path: Path) -> None:
    one = job(tmp_path)
    record = evaluate(one)
    assert (record["status"], record["reason"]) == ("solved", "goal reached")
    assert record == finished(one)
    assert not (one.folder / "states").exists()
    assert [path.name for path in one.folder.parent.iterdir()] == [one.key]
    curve = Curve(one.folder)
    pressure, bend = curve.column("pressure_right_kpa"), curve.column("bend_deg")
    assert record["gain_deg_per_kpa"] == pytest.approx(line_fit(pressure, bend)[0])
    assert record["bend_deg_at_35kpa"] == pytest.approx(bend[-1])
    at = np.interp(3.0, bend, curve.column("von_mises_p99_kpa"))
    # A cubic and a chord through four states differ by little.
    assert record["von_mises_p99_at_angle_kpa"] == pytest.approx(at, rel=0.05)
    assert record["footprint_cm3"] == pytest.approx(22 * 9 * 15 / 1000)
    assert record["partition_slenderness"] == pytest.approx(6 / 2)
    assert record["hottest_share_central"] + record["hottest_share_folds"] < 1.0
    assert record["core_s"] > 0


def test_a_finished_candidate_is_only_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = job(tmp_path)
    one.folder.mkdir(parents=True)
    (one.folder / RECORD).write_text(json.dumps({"status": "solved", "mark": 1}))
    monkeypatch.setattr(evaluation, "solve_design", None)
    assert evaluate(one)["mark"] == 1


def test_a_job_that_breaks_leaves_no_folder_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = job(tmp_path)
    rows: list[Any] = []

    def breaks(design: Any, directory: Any, settings: Any) -> Any:
        def stop(row: Any) -> None:
            rows.append(row)
            if len(rows) == 2:
                raise MemoryError

        return real(design, directory, settings, stop)

    real = evaluation.solve_design
    monkeypatch.setattr(evaluation, "solve_design", breaks)
    with pytest.raises(MemoryError):
        evaluate(one)
    assert finished(one) is None
    assert not one.folder.exists()
    after: list[Any] = []
    monkeypatch.setattr(evaluation, "solve_design", lambda d, at, s: real(d, at, s, after.append))
    assert evaluate(one)["status"] == "solved"
    # Rest and the first state were kept by the broken job.
    assert after[0]["step"] == 2


def test_impossible_dimensions_say_why_and_by_how_much(tmp_path: Path) -> None:
    record = evaluate(job(tmp_path, fold_wall_mm=4.5))
    assert record["status"] == "impossible"
    assert "must be" in record["reason"]
    further = evaluate(job(tmp_path, fold_wall_mm=4.9))
    assert 0 < record["rule_violation"] < further["rule_violation"]
    assert evaluate(job(tmp_path, units=99))["reason"].startswith("bellows.units")


def test_what_cannot_be_printed_need_not_be_solved(tmp_path: Path) -> None:
    thin = job(tmp_path, fold_wall_mm=0.5)
    record = evaluate(replace(thin, solve_unprintable=False))
    assert (record["status"], record["core_s"]) == ("unprintable", 0.0)
    assert "sealing width" in record["reason"]


def test_a_path_that_ends_before_35_kpa_is_early(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lower = SOLVE.model_copy(update={"target": 20.0})
    record = evaluate(job(tmp_path, lower))
    assert record["status"] == "early"
    assert record["end_pressure_right_kpa"] == pytest.approx(20.0)
    assert "gain_deg_per_kpa" not in record
