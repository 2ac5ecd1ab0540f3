"""The hottest part of the body: shares of known fields, peaks in their place, rigid parts left out."""

import numpy as np
import pytest

from tubefoot.fea.hotspots import HOTTEST, hotspot_rows
from tubefoot.fea.measures import Stresses


def made(shear=None):
    """Ten cells along x, two points each; the last is of a rigid mount."""
    n = 10
    region = np.array(["partition"] * 4 + ["fold_right"] * 5 + ["mount"])
    weights = np.ones((n, 2))
    points = np.zeros((n, 2, 3))
    points[..., 0] = np.arange(n)[:, None]
    points[:, 1, 1] = 4.0  # the second point of each cell lies at the side
    cauchy = np.zeros((n, 2, 3, 3))
    if shear is not None:
        cauchy[..., 0, 1] = cauchy[..., 1, 0] = shear
    von_mises = np.arange(20.0).reshape(n, 2)
    return Stresses(cauchy, weights, region, von_mises, von_mises), points


def by(rows, stress):
    return {row["zone"]: row for row in rows if row["stress"] == stress}


def test_shares_of_volume_and_of_the_hottest_part():
    stresses, points = made()
    found = by(hotspot_rows(2, stresses, points, 4.0), "von_mises")
    assert set(found) == {"near_mid_plane", "partition", "fold_right"}
    assert found["partition"]["volume_share"] == pytest.approx(8 / 18)
    assert found["near_mid_plane"]["volume_share"] == pytest.approx(0.5)
    # The hottest 5 % of 18 points is 0.9 of the hottest point: a side point of the last soft cell.
    assert pytest.approx(0.9) == HOTTEST * 18
    assert found["fold_right"]["hottest_share"] == pytest.approx(1.0)
    assert found["partition"]["hottest_share"] == 0.0
    assert found["near_mid_plane"]["hottest_share"] == 0.0
    peak = found["fold_right"]
    assert (peak["peak_kpa"], peak["peak_x_mm"], peak["peak_y_mm"]) == (17e3, 8.0, 4.0)
    assert found["partition"]["peak_kpa"] == pytest.approx(7e3)


def test_the_hottest_share_is_cut_within_a_point():
    stresses, points = made()
    stresses.weights[8] = 0.3, 0.4  # hottest point 0.4, then 0.3, then the rest of 5 % of 16.7
    found = by(hotspot_rows(0, stresses, points, 4.0), "von_mises")
    wanted = 0.05 * 16.7
    assert found["near_mid_plane"]["hottest_share"] == pytest.approx(0.3 / wanted)


def test_shear_counts_by_its_size():
    shear = np.zeros((10, 2))
    shear[2, 0] = -5.0
    stresses, points = made(shear)
    found = by(hotspot_rows(0, stresses, points, 4.0), "s13")
    assert found["partition"]["peak_kpa"] == pytest.approx(5e3)
    assert found["partition"]["peak_x_mm"] == 2.0
    assert found["near_mid_plane"]["peak_kpa"] == pytest.approx(5e3)


def test_only_a_pull_counts_across_the_seam():
    stresses, points = made()
    stresses.cauchy[1, 0, 1, 1] = -9.0
    stresses.cauchy[5, 0, 1, 1] = 1.0
    found = by(hotspot_rows(0, stresses, points, 4.0), "s33")
    assert found["fold_right"]["peak_kpa"] == pytest.approx(1e3)
    assert found["partition"]["peak_kpa"] == 0.0
