"""The demo's stages in processes of their own: order, news, failure, and the runs they leave."""

import json
import os
import signal
import threading
from dataclasses import replace
from multiprocessing import active_children

import pytest

from tubefoot.cli.demo_stages import Stage, stages
from tubefoot.cli.demo_workers import _next, _threads_each, run_side_by_side
from tubefoot.errors import TubefootError
from tubefoot.study.crew import THREAD_VARIABLES


def idle(name, cost, after=()):
    return Stage(name, cost, lambda directory, tell: None, after)


def test_the_longest_begins_first_and_none_before_what_it_needs():
    planned = [idle("short", 1.0), idle("late", 9.0, after=("short", "long")), idle("long", 5.0)]
    assert [stage.name for stage in _next(planned, set(), 3)] == ["long", "short"]
    assert [stage.name for stage in _next(planned, set(), 1)] == ["long"]
    assert [stage.name for stage in _next(planned[:2], {"long"}, 3)] == ["short"]
    assert [stage.name for stage in _next(planned[1:2], {"long", "short"}, 3)] == ["late"]
    assert _next(planned, set(), 0) == []


def test_what_a_stage_needs_is_a_stage_of_the_demo():
    planned = {stage.name: stage for stage in stages(quick=True)}
    needed = {name for stage in planned.values() for name in stage.after}
    assert needed == {"reference-3", "reference-6"}
    assert needed < set(planned)


def test_processors_are_shared_and_what_the_user_set_is_kept(monkeypatch):
    mine, *others = THREAD_VARIABLES
    monkeypatch.setenv(mine, "7")
    for name in others:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    with _threads_each(2):
        assert os.environ[mine] == "7"
        assert {os.environ[name] for name in others} == {"3"}
    assert os.environ[mine] == "7"
    assert not any(name in os.environ for name in others)


def some(*names):
    found = {stage.name: stage for stage in stages(quick=True)}
    return [found[name] for name in names]


@pytest.mark.slow
def test_two_solves_side_by_side_are_those_of_one_process(tmp_path):
    told, ended = [], []
    planned = some("pitch-3-12", "walls-thin")
    run_side_by_side(
        planned,
        True,
        tmp_path,
        2,
        lambda stage, share, line: told.append((stage.name, share)),
        lambda stage: ended.append(stage.name),
    )
    assert sorted(ended) == sorted(stage.name for stage in planned)
    for stage in planned:
        shares = [share for name, share in told if name == stage.name]
        assert len(shares) > 3
        assert shares == sorted(shares)
        assert shares[-1] == 1.0
        found = json.loads((tmp_path / stage.name / "summary.json").read_text())
        assert found["converged"]
    (alone,) = some("walls-thin")
    alone.run(tmp_path / "alone", lambda share, line: None)
    bends = [
        json.loads((tmp_path / name / "summary.json").read_text())["bend_deg"]
        for name in ("alone", "walls-thin")
    ]
    assert bends[0] == pytest.approx(bends[1], rel=1e-6)
    told.clear()
    run_side_by_side(planned, True, tmp_path, 2, lambda *news: told.append(news), lambda stage: None)
    assert told == []  # done already


@pytest.mark.slow
def test_a_stage_that_fails_is_named_and_ends_the_others(tmp_path):
    (tmp_path / "pitch-3-12").write_text("a file where the run's directory would be")
    with pytest.raises(TubefootError, match=r"pitch-3-12: .*"):
        run_side_by_side(
            some("reference-3-filtered", "pitch-3-12"), True, tmp_path, 2, lambda *_: None, lambda _: None
        )
    assert active_children() == []
    assert not (tmp_path / "reference-3-filtered" / "summary.json").exists()


@pytest.mark.slow
def test_a_worker_that_is_killed_is_said(tmp_path):
    def kill(*_):
        victim = next(iter(active_children()))
        threading.Thread(target=os.kill, args=(victim.pid, signal.SIGKILL)).start()

    (stage,) = some("reference-3-filtered")
    with pytest.raises(TubefootError, match="ended from outside"):
        run_side_by_side([replace(stage, cost=1.0)], True, tmp_path, 1, kill, lambda _: None)
