"""The demo's closed loop: stages that go on where they were, and the claims they decide."""

import pytest

from tubefoot.cli import demo_bending
from tubefoot.cli.demo_bending import CASES, bending_stages, judge_bending


def test_nothing_run_decides_nothing(tmp_path):
    assert judge_bending(tmp_path) == []


def test_only_the_papers_controller_takes_frames_and_only_in_full():
    full, quick = ({stage.name: stage.cost for stage in bending_stages(way)} for way in (False, True))
    assert list(full) == list(CASES)
    assert full["bend-paper"] > 2 * quick["bend-paper"]
    assert full["bend-adaptive"] == quick["bend-adaptive"]


@pytest.mark.slow
def test_stages_bend_there_and_back_and_decide_the_claims_of_the_bench(tmp_path, monkeypatch):
    told = []
    for stage in bending_stages(quick=True):
        stage.run(tmp_path / stage.name, lambda share, line: told.append(share))
    assert 0.0 <= min(told) <= max(told) <= 1.0
    claims = {claim.id: claim for claim in judge_bending(tmp_path)}
    assert list(claims) == ["C5", "C10", "C11", "C12"]
    assert {claims[name].verdict for name in ("C5", "C10", "C12")} == {"holds"}
    assert claims["C11"].numbers["iterations_to_30"] <= 11
    again = []
    for stage in demo_bending.bending_stages(quick=True):
        stage.run(tmp_path / stage.name, lambda share, line: again.append(line))
    assert not again
