"""C2 and C8 by their rules, on made tables: each part can fail, and a run that ends early is not judged."""

import numpy as np
import pytest

from tubefoot.records import write_table
from tubefoot.study.curve import Curve
from tubefoot.study.stress_claims import concentration, judge_components, judge_concentration

VOLUME = {
    "near_mid_plane": 0.2,
    "partition": 0.1,
    "valley_right": 0.05,
    "valley_left": 0.05,
    "fold_right": 0.15,
    "fold_left": 0.15,
    "side_wall": 0.5,
}
EVEN = dict(VOLUME)


def made_run(directory, hottest=None, opening=2.0, pull=120.0, end=35.0):
    """A run with two states; at the last one the stresses lie as told: stress to zone to share."""
    pressures = np.array([0.0, end])
    write_table(
        directory / "curve.csv",
        [
            {"step": k, "pressure_right_kpa": float(p), "bend_deg": 0.5 * float(p)}
            for k, p in enumerate(pressures)
        ],
    )
    rows = []
    for step in (0, 1):
        for stress in ("von_mises", "s13", "s23", "s33"):
            shares = EVEN | ((hottest or {}).get(stress, {}) if step else {})
            for number, (zone, volume) in enumerate(VOLUME.items()):
                place = {
                    "peak_kpa": 10.0 * number,
                    "peak_x_mm": 1.0 * number,
                    "peak_y_mm": 2.0,
                    "peak_z_mm": 3.0,
                }
                row = {"step": step, "stress": stress, "zone": zone, "volume_share": volume}
                rows.append({**row, "hottest_share": shares[zone], **place})
    write_table(directory / "hotspots.csv", rows)
    places = {"all": 0.5 * opening, "right": opening, "left": -0.5 * opening, "partition": 0.1}
    write_table(
        directory / "seam.csv",
        [
            {
                "step": step,
                "place": place,
                "opening_force_n": step * force,
                "peeling_moment_n_mm": 3.0 * force,
                "s33_p99_kpa": step * pull,
                "s13_p99_kpa": 1.0,
            }
            for step in (0, 1)
            for place, force in places.items()
        ],
    )
    return Curve(directory)


CENTRAL = {
    "von_mises": {
        "partition": 0.7,
        "valley_right": 0.1,
        "valley_left": 0.1,
        "fold_right": 0.05,
        "fold_left": 0.0,
    }
}
SPREAD = {
    "von_mises": {
        "partition": 0.2,
        "valley_right": 0.1,
        "valley_left": 0.1,
        "fold_right": 0.3,
        "fold_left": 0.2,
    }
}


def test_concentration_of_a_zone(tmp_path):
    zones = made_run(tmp_path, SPREAD).hotspots("von_mises")
    assert concentration(zones, ["fold_right", "fold_left"]) == pytest.approx(0.5 / 0.3)
    assert concentration(zones, ["partition"]) == pytest.approx(2.0)


def test_c2(tmp_path):
    central, spread = made_run(tmp_path / "a", CENTRAL), made_run(tmp_path / "b", SPREAD)
    claim = judge_concentration({"3/15": spread, "3/9": central})
    assert claim.verdict == "holds"
    assert claim.numbers["central_share_3/9"] == pytest.approx(0.9)
    assert claim.numbers["fold_share_3/15"] == pytest.approx(0.5)
    assert judge_concentration({"3/15": central, "3/9": spread}).verdict == "refuted"
    assert judge_concentration({"3/15": central, "3/9": central}).verdict == "mixed"
    early = made_run(tmp_path / "c", CENTRAL, end=30.0)
    assert judge_concentration({"3/15": spread, "3/9": early}).verdict == "not computed"


SEEN = {
    "s23": {"fold_right": 0.3, "fold_left": 0.3},
    "s13": {"partition": 0.6, "near_mid_plane": 0.5},
    "s33": {"partition": 0.5},
}


def test_c8(tmp_path):
    claim = judge_components(made_run(tmp_path / "a", SEEN))
    assert claim.verdict == "holds"
    assert claim.numbers["concentration_s23_in_folds"] == pytest.approx(2.0)
    assert claim.numbers["seam_right_opening_force_n"] == pytest.approx(2.0)
    assert claim.numbers["s13_peak_kpa"] == 60.0
    for number, worse in enumerate(
        (
            {**SEEN, "s23": {"side_wall": 0.9}},
            {**SEEN, "s13": {"partition": 0.6}},
            {**SEEN, "s13": {"near_mid_plane": 0.5}},
        )
    ):
        assert judge_components(made_run(tmp_path / f"b{number}", worse)).verdict == "mixed"
    assert judge_components(made_run(tmp_path / "c", SEEN, opening=-1.0)).verdict == "mixed"
    assert judge_components(made_run(tmp_path / "d", SEEN, pull=-5.0)).verdict == "mixed"
    assert judge_components(made_run(tmp_path / "e", {}, pull=-5.0)).verdict == "refuted"


def test_without_the_tables_nothing_is_judged(tmp_path):
    made_run(tmp_path, SEEN)
    (tmp_path / "seam.csv").unlink()
    assert judge_components(Curve(tmp_path)).verdict == "not computed"
    assert judge_components(made_run(tmp_path / "early", SEEN, end=30.0)).verdict == "not computed"
