"""Score, rank, Pareto set, shares of weightings, uncertain front."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.study.front import hypervolume, uncertain_front
from tubefoot.study.ranking import (
    CRITERIA,
    criteria_of,
    group_scores,
    pareto_set,
    ranks_of,
    weights_of,
    win_shares,
)
from tubefoot.study.study_file import RankSettings

BASE = dict(zip(CRITERIA, (0.5, 100.0, 6.0, 300.0, 1.5, 5.0), strict=True))


def score(**changes: float) -> float:
    rows = np.array([criteria_of({**BASE, **changes})])
    return float((group_scores(rows, criteria_of(BASE)) @ weights_of(RankSettings()))[0])


def test_the_base_scores_nothing_and_each_figure_counts_in_its_direction() -> None:
    assert score() == 0.0
    # One of four groups; two of the groups hold two figures each.
    assert score(gain_deg_per_kpa=0.5 * math.e) == pytest.approx(1 / 4)
    assert score(von_mises_p99_at_angle_kpa=100 * math.e) == pytest.approx(-1 / 8)
    assert score(seam_s33_p99_kpa=300 / math.e) == pytest.approx(1 / 8)
    assert score(sealing_width_mm=1.5 * math.e) == pytest.approx(1 / 8)
    assert score(footprint_cm3=5 * math.e) == pytest.approx(-1 / 4)


def test_a_base_without_figures_is_refused() -> None:
    with pytest.raises(ConfigError, match="gain_deg_per_kpa"):
        group_scores(np.ones((1, len(CRITERIA))), criteria_of({**BASE, "gain_deg_per_kpa": None}))


def test_equal_scores_share_a_rank_and_what_is_not_eligible_has_none() -> None:
    scores = np.array([0.1, 0.3, 0.1, 0.9, np.nan])
    assert ranks_of(scores, np.array([True, True, True, False, True])).tolist() == [2, 1, 2, 0, 0]


def test_pareto_set_is_what_comparing_all_pairs_gives() -> None:
    costs = np.random.default_rng(3).integers(0, 6, (200, 3)).astype(float)
    costs[5, 1] = np.nan
    known = np.isfinite(costs).all(axis=1)
    beaten = [
        any((other <= one).all() and (other < one).any() for other in costs[known]) or not inside
        for one, inside in zip(costs, known, strict=True)
    ]
    assert pareto_set(costs).tolist() == [not flag for flag in beaten]


def test_a_candidate_better_in_all_groups_wins_under_every_weighting() -> None:
    assert win_shares(np.array([[0.0, 0, 0, 0], [1, 1, 1, 1]])).tolist() == [0.0, 1.0]
    shares = win_shares(np.array([[1.0, 0, 0, 0], [0, 1, 0, 0]]))
    # By symmetry half; 10 000 draws scatter by 0.005.
    assert shares[0] == pytest.approx(0.5, abs=0.02)


def test_hypervolume_of_a_box_and_of_a_staircase() -> None:
    best, worst = np.zeros(2), np.ones(2)
    assert hypervolume(np.array([[0.5, 0.25]]), best, worst) == pytest.approx(0.5 * 0.75, abs=2e-3)
    stairs = np.array([[0.5, 0.25], [0.25, 0.5]])
    assert hypervolume(stairs, best, worst) == pytest.approx(2 * 0.375 - 0.25, abs=2e-3)


def test_known_designs_are_on_the_front_or_not_and_close_ones_perhaps() -> None:
    costs = np.array([[1.0, 2.0], [2.0, 1.0], [2.02, 1.01], [5.0, 5.0]])
    known = uncertain_front(costs, np.zeros_like(costs))
    assert known.probability.tolist() == [1.0, 1.0, 0.0, 0.0]
    assert known.hypervolume[1] == known.hypervolume[2]
    unsure = uncertain_front(costs, np.full_like(costs, 0.02))
    assert 0.1 < unsure.probability[2] < 0.95
    assert unsure.probability[3] == 0.0
    assert unsure.hypervolume[1] < unsure.hypervolume[2]
