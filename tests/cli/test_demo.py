"""The verbs `demo` and `report` as a user runs them."""

import json
from functools import partial
from pathlib import Path

import pytest

from tubefoot.cli import demo as demo_module
from tubefoot.cli import demo_bending, demo_grasps, demo_stages, demo_validation
from tubefoot.cli.demo import Progress, demo, remove_run
from tubefoot.cli.demo_stages import Case, Stage, cases
from tubefoot.cli.report import report
from tubefoot.config import read_toml
from tubefoot.errors import ConfigError

EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"


def test_the_demo_solves_the_reference_fingers_both_ways_and_the_pitches():
    planned = {case.name: case for case in cases(quick=False)}
    assert [case.design.bellows.units for case in planned.values()] == [3, 6, 3, 3, 3, 3, 3, 3]
    assert planned["reference-3"].design == planned["reference-3-reversed"].design
    assert planned["reference-3-reversed"].settings.until == "pressure_left_kpa"
    # tan(alpha) = rise / run = 3/12 and 3/9.
    for name, slope in (("pitch-3-12", 3 / 12), ("pitch-3-9", 3 / 9)):
        bellows = planned[name].design.bellows
        assert bellows.fold_rise_mm / bellows.fold_run_mm == pytest.approx(slope)
    assert all(case.settings.target == 35.0 for case in planned.values())


def test_the_embedded_fingers_are_the_examples():
    from tubefoot.design.finger import load_design

    for case in cases(quick=False)[:2]:
        assert load_design(EXAMPLES / f"{case.name}.toml").bellows == case.design.bellows


def test_quick_is_coarser():
    for quick, full in zip(cases(True), cases(False), strict=True):
        assert quick.settings.element_size_mm > full.settings.element_size_mm
        assert quick.design == full.design


def test_walls_are_those_of_the_paper_s_study():
    from tubefoot.study.candidates import make_candidate
    from tubefoot.study.dimensions import flat
    from tubefoot.study.study_file import load_study

    study, base = load_study(EXAMPLES.parent / "studies" / "paper.toml")
    walls = next(comparison for comparison in study.comparison if comparison.name == "walls")
    planned = {case.name: case for case in cases(quick=False)}
    for name in ("thin", "uniform"):
        tables = make_candidate(base, name, flat(walls.candidates[name])).tables
        assert planned[f"walls-{name}"].design.model_dump(mode="json")["bellows"] == tables["bellows"]


def test_time_left_follows_the_pace_since_the_start(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(demo_module.time, "perf_counter", lambda: now[0])
    three, six = (
        Stage("three", 3.0, lambda directory, tell: None),
        Stage("six", 6.0, lambda directory, tell: None),
    )
    progress = Progress([three, six])
    tell = partial(progress.note, three)
    tell(0.0, "begins")
    assert "left" not in capsys.readouterr().out
    now[0] = 10.0
    tell(0.5, "17.50 kPa")
    # Half of the 3 took 10 s; 7.5 of 9 are to come.
    assert "[1 of 2] three: 17.50 kPa, about 50 s left" in capsys.readouterr().out
    progress.finished(three)
    progress.finished(six)
    assert "six: done already" in capsys.readouterr().out


def test_time_left_does_not_count_what_an_interrupted_run_had(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(demo_module.time, "perf_counter", lambda: now[0])
    stage = Stage("long", 10.0, lambda directory, tell: None)
    tell = partial(Progress([stage]).note, stage)
    tell(0.5, "goes on")
    now[0] = 5.0
    tell(0.75, "goes on")
    # A quarter took 5 s, another quarter is to come.
    assert "about 5 s left" in capsys.readouterr().out


def test_doing_again_removes_runs_only(tmp_path):
    run, other = tmp_path / "run", tmp_path / "other"
    for directory, name in ((run, "run.toml"), (other, "thesis.tex")):
        directory.mkdir()
        (directory / name).touch()
        remove_run(directory)
    remove_run(tmp_path / "missing")
    assert not run.exists()
    assert (other / "thesis.tex").exists()


def test_report_wants_a_run(tmp_path):
    with pytest.raises(ConfigError, match="no run named"):
        report(out=tmp_path)


@pytest.mark.slow
def test_a_demo_is_judged_reported_and_not_repeated(tmp_path, monkeypatch, capsys):
    planned = [
        Case(
            case.name,
            case.design.with_bellows(units=min(case.design.bellows.units, 4) - 2),
            case.settings.model_copy(update={"element_size_mm": 6.0, "states": 3}),
        )
        for case in cases(quick=True)
    ]
    monkeypatch.setattr(demo_stages, "cases", lambda quick: planned)
    monkeypatch.setattr(demo_grasps, "grasp_stages", lambda quick: [])
    monkeypatch.setattr(demo_bending, "bending_stages", lambda quick: [])
    monkeypatch.setattr(demo_validation, "validation_stages", lambda: [])
    demo(out=tmp_path, quick=True, workers=1)
    judged = json.loads((tmp_path / "claims.json").read_text())
    assert [claim["id"] for claim in judged] == ["C1", "C2", "C3", "C4", "C5", "C6", "C7", "C8", "C10"]
    assert {claim["id"]: claim["verdict"] for claim in judged}["C10"] == "holds"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'id="claims"' in page
    for claim in judged:
        assert f'href="#{claim["figure"]}"' in page
        assert f'id="{claim["figure"]}"' in page
    assert read_toml(tmp_path / "run.toml")["run"]["verb"] == "demo"
    states = sorted((tmp_path / "quick").glob("*/states/*.npz"))
    solved = [path.stat().st_mtime_ns for path in states]
    assert len(states) > 10
    capsys.readouterr()

    demo(out=tmp_path, quick=True, workers=1)
    assert capsys.readouterr().out.count("done already") == len(planned) + 1
    assert [path.stat().st_mtime_ns for path in states] == solved
