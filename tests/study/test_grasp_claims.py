"""C13 to C15 on records made for the purpose: each part of a claim can fail it."""

import json
from pathlib import Path
from typing import Any

import pytest

from tubefoot.errors import ConfigError
from tubefoot.study.grasp_claims import GraspRecord, judge_curved, judge_gentleness, judge_planar


def record(directory: Path, theta1: float, theta2: float, **other: Any) -> GraspRecord:
    """The record of a grasp with these angles at the end of the hold."""
    directory.mkdir(parents=True)
    summary = {
        "theta1_deg": theta1,
        "theta2_deg": theta2,
        "theta1_contact_deg": theta1,
        "theta2_contact_deg": theta2,
    }
    summary |= {"held": True, "slip_mm": 0.1, "damage_margin": 3.0, "pulses_after_contact": 3}
    (directory / "summary.json").write_text(json.dumps(summary | other))
    return GraspRecord(directory)


@pytest.mark.parametrize(
    ("front", "side", "verdict"),
    [
        ((-8.0, -1.0), (-5.0, -1.5), "holds"),
        ((-8.0, 1.0), (-5.0, -1.5), "mixed"),
        ((-8.0, -6.0), (-5.0, -1.5), "mixed"),
        ((-5.0, -1.0), (-8.0, -1.5), "mixed"),
        ((-8.0, -0.1), (-6.0, -2.5), "mixed"),
        ((-2.0, 9.0), (-3.0, 5.0), "refuted"),
    ],
)
def test_planar(tmp_path: Path, front: tuple[float, float], side: tuple[float, float], verdict: str) -> None:
    claim = judge_planar(record(tmp_path / "f", *front), record(tmp_path / "s", *side))
    assert claim.verdict == verdict
    assert claim.numbers["theta1_front_hold_deg"] == front[0]


@pytest.mark.parametrize(
    ("front", "side", "verdict"),
    [
        ((-4.0, 3.0), (-3.0, 2.0), "holds"),
        ((-4.0, 2.0), (-3.0, 3.0), "mixed"),
        ((-2.0, -2.0), (-3.0, -3.0), "refuted"),
    ],
)
def test_curved(tmp_path: Path, front: tuple[float, float], side: tuple[float, float], verdict: str) -> None:
    assert judge_curved(record(tmp_path / "f", *front), record(tmp_path / "s", *side)).verdict == verdict


@pytest.mark.parametrize(
    "spoilt",
    [{"held": False}, {"slip_mm": 1.2}, {"slip_mm": None}, {"damage_margin": 0.9}, {"local_margin": 0.6}],
)
def test_gentleness_fails_by_each_part(tmp_path: Path, spoilt: dict[str, Any]) -> None:
    good = record(tmp_path / "good", -4.0, 3.0)
    assert judge_gentleness({"a": good}).verdict == "holds"
    assert (
        judge_gentleness({"a": good, "b": record(tmp_path / "bad", -4.0, 3.0, **spoilt)}).verdict == "mixed"
    )


def test_missing_angle_is_not_computed(tmp_path: Path) -> None:
    one = record(tmp_path / "f", -4.0, 3.0, theta2_deg=None)
    assert judge_curved(one, record(tmp_path / "s", -3.0, 2.0)).verdict == "not computed"


def test_foreign_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="run `tubefoot grasp` first"):
        _ = GraspRecord(tmp_path).summary
    (tmp_path / "summary.json").write_text('{"iterations": 3}')
    with pytest.raises(ConfigError, match="not the summary of a `grasp` run"):
        _ = GraspRecord(tmp_path).summary
