"""`tubefoot grasp` as typed: what it refuses, what it writes, the map."""

import json
from pathlib import Path

import pytest

from tubefoot.cli import grasp_map
from tubefoot.cli.grasp import grasp
from tubefoot.cli.grasp_map import map_rows, map_summary
from tubefoot.cli.grasp_record import verdict_sentence
from tubefoot.cli.person_hands import PersonHands
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.grasp_object import known_object
from tubefoot.records import read_table

KEYS = (
    *("object", "pose", "seed", "held", "slip_mm", "peak_pressure_kpa", "damage_margin", "theta1_deg"),
    *("theta2_deg", "theta1_chord_deg", "theta2_chord_deg", "pulses_after_contact", "end_reason"),
)
"""Of summary.json, as the outer contract has them."""


def test_the_bench_needs_two_calibrations(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--camera is needed twice"):
        grasp("tofu", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_three_ports_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="3 ports and 0 rig files: give one for each finger"):
        grasp("tofu", port=["a", "b", "c"], out=tmp_path)


def test_two_rigs_need_two_ports(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="both rigs are on /dev/ttyACM0"):
        grasp("tofu", port=["/dev/ttyACM0", "/dev/ttyACM0"], out=tmp_path)


def test_three_sources_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="3 sources: give one for each finger"):
        grasp("tofu", source=["0", "1", "2"], camera=[tmp_path, tmp_path], out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_unequal_gaps_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "gripper.toml"
    file.write_text("finger_gap_mm = 20\n")
    with pytest.raises(ConfigError, match="make them equal"):
        grasp("tofu", sim=True, gripper=file, out=tmp_path / "run")


def test_bench_and_population_exclude_each_other(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not both"):
        grasp("tofu", sim=True, bench=tmp_path / "b.toml", population=3, out=tmp_path / "run")


def test_friction_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="friction 0: allowed"):
        grasp("tofu", sim=True, friction=0.0, out=tmp_path / "run")


def test_a_person_is_asked_what_nobody_measures() -> None:
    asked: list[str] = []
    answers = iter(["", "", "y", "0,4", "n"])

    def ask(prompt: str) -> str:
        asked.append(prompt)
        return next(answers)

    hands = PersonHands(82.0, ask)
    hands.place()
    hands.release()
    assert hands.verdict() == {"held": True, "slip_mm": 0.4, "damage_seen": False}
    assert "its middle 82 mm above the base" in asked[0]


def test_a_grasp_that_nobody_attends_ends_in_words() -> None:
    def ask(prompt: str) -> str:
        raise EOFError

    hands = PersonHands(82.0, ask)
    with pytest.raises(LinkError, match="input has ended"):
        hands.place()
    with pytest.raises(LinkError):
        hands.release()
    assert hands.verdict() == {"held": None, "slip_mm": None}
    summary = {"held": None, "end_reason": "link lost"}
    assert verdict_sentence(summary) == ("verdict: not given, nobody said whether it was held (link lost)")


@pytest.mark.parametrize("slip", ["", "nan", "much"])
def test_a_slip_that_is_no_number_is_not_measured(slip: str) -> None:
    answers = iter(["", "y", slip, "n"])
    hands = PersonHands(82.0, lambda prompt: next(answers))
    hands.release()
    assert hands.verdict()["slip_mm"] is None


def test_verdict_sentence_names_the_bound_that_is_broken() -> None:
    summary = {"held": True, "slip_mm": None, "damage_margin": 0.8, "nearest_bound": "tension_kpa"}
    assert verdict_sentence(summary) == (
        "verdict: held, slip not measured, BEYOND the damage bounds (bound over load 0.8, tension_kpa)"
    )


@pytest.mark.slow
def test_a_grasp_leaves_its_record(tmp_path: Path) -> None:
    grasp("blueberry", pose="side", sim=True, quick=True, seed=5, out=tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert all(key in summary for key in KEYS)
    assert summary["held"]
    assert summary["seed"] == 5
    rows = read_table(tmp_path / "grasp.csv")
    assert [rows[0]["phase"], rows[-1]["phase"]] == ["open", "done"]
    for name in (
        "run.toml",
        "angles.png",
        "plane.svg",
        "forces.png",
        "strip.png",
        "grasp.avi",
        "bench-left.mcap",
    ):
        assert (tmp_path / name).stat().st_size > 1000, name


@pytest.mark.slow
def test_theta2_changes_its_sign_with_the_grip_level_on_the_map(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grasp_map, "VOLUMES_ML", (-0.15, 0.0, 0.3))
    monkeypatch.setattr(grasp_map, "HEIGHTS_MM", (70.0,))
    rows = map_rows(known_object("blueberry"))
    summary = map_summary(rows)
    assert 0.0 < summary["theta2_zero_front_force_n"] < 0.05
    wide = [row["theta1_deg"] for row in rows if row["size"] == 1.2 and row["pumped_volume_ml"] == 0.3]
    narrow = [row["theta1_deg"] for row in rows if row["size"] == 0.8 and row["pumped_volume_ml"] == 0.3]
    assert all(one < other for one, other in zip(wide, narrow, strict=True))
