"""C3 and the selection, judged on numbers whose verdict is known."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from tubefoot.study.curve import Curve
from tubefoot.study.ranking import weights_of
from tubefoot.study.study_file import RankSettings
from tubefoot.study.wall_claims import judge_selection, judge_walls


class Hotspots:
    """A curve of which only the hottest zones are asked; each holds 10 % of the volume."""

    def __init__(self, valley: float, web: float):
        self.shares = {"valley_right": valley, "valley_left": valley, "partition": web}

    def hotspots(self, stress: str) -> dict[str, dict[str, float]]:
        assert stress == "von_mises"
        return {zone: {"hottest_share": share, "volume_share": 0.1} for zone, share in self.shares.items()}


def figures(bend: float, valley: float, web: float) -> dict[str, Any]:
    zones = dict.fromkeys(("valley_right", "valley_left"), valley) | {"partition": web}
    stress = {f"von_mises_p99_{zone}_kpa": value for zone, value in zones.items()}
    return {"bend_deg_at_35kpa": bend, "stress_concentration": 3.0, **stress}


PAPER = {"thin": figures(20, 300, 300), "uniform": figures(15, 200, 200), "mixed": figures(19, 250, 250)}


def judged(changes: dict[str, dict[str, Any]] | None = None, valley: float = 0.2, web: float = 0.3) -> Any:
    table = PAPER | (changes or {})
    curves = {name: cast(Curve, Hotspots(valley, web)) for name in table}
    return judge_walls(curves, table)


def test_the_papers_numbers_would_hold() -> None:
    assert judged().verdict == "holds"


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"mixed": figures(20.1, 250, 250)}, "thin_bends_most"),
        ({"uniform": figures(15, 200, 310)}, "uniform_lowers_stress"),
        ({"mixed": figures(17.9, 250, 250)}, "mixed_angle_near_thin"),
        ({"mixed": figures(19, 250, 320)}, "mixed_lowers_stress"),
    ],
)
def test_each_part_fails_by_itself(changes: dict[str, dict[str, Any]], part: str) -> None:
    claim = judged(changes)
    assert claim.verdict == "mixed"
    assert [name for name, value in claim.numbers.items() if name.startswith("part_") and not value] == [
        f"part_{part}"
    ]


def test_stress_that_does_not_heap_in_the_valleys_is_seen() -> None:
    claim = judged(valley=0.11)
    assert claim.numbers["part_thin_concentrates_at_valleys_and_web"] == 0.0
    assert claim.numbers["concentration_valley_thin"] == pytest.approx(1.1)


def test_a_missing_design_is_not_computed() -> None:
    assert judge_walls({}, {"thin": PAPER["thin"]}).verdict == "not computed"


def test_the_selection_is_refuted_by_a_better_one_with_the_reason() -> None:
    weights = weights_of(RankSettings())
    groups = np.array([[0.0, 0.0, 0.0, 0.0], [0.1, 0.2, -0.1, 0.0]])
    claim, reason = judge_selection("ours", ["ours", "other"], groups, weights)
    assert claim.verdict == "refuted"
    assert "other scores +0.050 against ours: bending +0.025, stress +0.050, sealing -0.025" in reason
    assert claim.numbers["wins_ours"] + claim.numbers["wins_other"] == pytest.approx(1.0)
    confirmed, reason = judge_selection("other", ["ours", "other"], groups, weights)
    assert confirmed.verdict == "holds"
    assert reason.startswith("other scores best, before ours")
