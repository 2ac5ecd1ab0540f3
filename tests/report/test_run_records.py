import numpy as np
import pytest
from recorded_run import N_STATES, curve_rows

from tubefoot.errors import ConfigError
from tubefoot.records import Run, write_table
from tubefoot.report.runs import load_run, load_runs


def test_a_solve_is_read_with_its_numbers(recorded):
    run = load_run(recorded)
    assert (run.name, run.verb, run.is_solve) == ("one-unit", "solve", True)
    assert run.last["bend_deg"] == pytest.approx(4.0)
    assert run.last_fields == recorded / f"fields/state_{N_STATES - 1:04d}.vtu"
    assert [row["region"] for row in run.region_rows()] == ["all", "fold_right", "partition"]
    assert run.region_rows()[0]["step"] == N_STATES - 1


def test_text_and_empty_columns_are_no_numbers(recorded):
    assert "contact_gap_where" not in load_run(recorded).curve
    assert "contact_gap_min_mm" not in load_run(recorded).curve


def test_runs_of_one_name_are_told_apart(recorded, reversed_run):
    assert [run.name for run in load_runs([recorded, reversed_run])] == ["one", "reversed"]


def test_a_run_named_twice_is_shown_once(recorded):
    assert len(load_runs([recorded, recorded])) == 1


def test_a_demo_stands_for_its_runs_in_the_order_they_were_begun(tmp_path):
    for name, begun in (("a", "2026-01-02"), ("b", "2026-01-01")):
        run = Run(tmp_path / "solves" / name, "solve", {"design": {"name": name}})
        write_table(run.path("curve.csv"), curve_rows())
        run.finish(started_utc=begun)
    Run(tmp_path, "demo", {}).finish()
    assert [run.name for run in load_runs([tmp_path])] == ["b", "a"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: None, "does not exist"),
        (lambda path: path.write_text(""), "is a file; name the run directory"),
        (lambda path: path.mkdir(), "holds no run"),
    ],
)
def test_a_path_without_a_run_says_so(tmp_path, make, message):
    make(tmp_path / "run")
    with pytest.raises(ConfigError, match=message):
        load_runs([tmp_path / "run"])


def broken_run(tmp_path, edit):
    run = Run(tmp_path / "broken", "solve", {})
    rows = curve_rows()
    write_table(run.path("curve.csv"), edit(rows), columns=list(rows[0]))
    run.finish()
    return run.directory


def test_a_curve_without_states_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no solved state yet"):
        load_run(broken_run(tmp_path, lambda rows: []))


def test_a_curve_with_a_cut_cell_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="column bend_deg has a cell that is no number"):
        load_run(broken_run(tmp_path, lambda rows: [*rows, {**rows[-1], "bend_deg": ""}]))


def test_another_table_is_no_curve(tmp_path):
    run = Run(tmp_path, "solve", {})
    write_table(run.path("curve.csv"), [{"step": 1, "bend_deg": 2.0}])
    run.finish()
    with pytest.raises(ConfigError, match="no column pressure_right_kpa"):
        load_run(tmp_path)


def test_a_run_of_another_verb_needs_no_curve(tmp_path):
    Run(tmp_path, "rig-check", {"port": "sim"}).finish()
    run = load_run(tmp_path)
    assert not run.is_solve
    assert run.name == tmp_path.name
    assert np.size(list(run.states)) == 0


def test_an_interrupted_run_is_to_be_finished_first(tmp_path):
    write_table(tmp_path / "curve.csv", curve_rows())
    with pytest.raises(ConfigError, match="interrupted run; give its command again"):
        load_runs([tmp_path])
