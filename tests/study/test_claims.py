"""Claims are judged by their rule, and the rule can refute them."""

import numpy as np
import pytest

from tubefoot.records import write_table
from tubefoot.study.claims import (
    Claim,
    join_claims,
    judge_filter,
    judge_inverse_pressures,
    judge_length,
    judge_linearity,
    judge_pitch,
    judge_reversal,
    verdict_of,
)
from tubefoot.study.curve import Curve, line_fit


def made_curve(directory, gain=0.5, left=-1.3, bow=0.0, unit_stress=(100.0, 100.0, 100.0)):
    pressure = np.linspace(0, 40, 9)
    bend = gain * pressure + bow * pressure**2
    rows = [
        {
            "step": k,
            "pressure_right_kpa": float(p),
            "pressure_left_kpa": float(left * p),
            "bend_deg": float(b),
        }
        for k, (p, b) in enumerate(zip(pressure, bend, strict=True))
    ]
    write_table(directory / "curve.csv", rows)
    units = [{"step": 8, "unit": k + 1, "von_mises_p99_kpa": s} for k, s in enumerate(unit_stress)]
    write_table(directory / "units.csv", units)
    return Curve(directory)


def test_line_fit_against_a_known_line():
    x = np.array([0.0, 1.0, 2.0, 3.0])
    slope, r_squared, deviation = line_fit(x, 2 * x + np.array([0.1, -0.1, -0.1, 0.1]))
    assert slope == pytest.approx(2.0)
    assert deviation == pytest.approx(0.1)
    assert r_squared == pytest.approx(1 - 0.04 / 20.04)


def test_verdict_of_parts():
    assert verdict_of([True, True]) == "holds"
    assert verdict_of([True, False]) == "mixed"
    assert verdict_of([False, False]) == "refuted"
    assert verdict_of([]) == "not computed"


def test_pitch(tmp_path):
    curves = {p: made_curve(tmp_path / p.replace("/", "-"), g) for p, g in (("3/15", 0.5), ("3/9", 0.4))}
    assert judge_pitch(curves).verdict == "holds"
    curves["3/9"] = made_curve(tmp_path / "better", 0.6)
    assert judge_pitch(curves).verdict == "refuted"


def test_length(tmp_path):
    three = made_curve(tmp_path / "3", 0.5, unit_stress=(80.0, 120.0, 80.0))
    six = made_curve(tmp_path / "6", 1.02, unit_stress=(95.0, 100.0, 105.0) * 2)
    claim = judge_length(three, six)
    assert claim.verdict == "holds"
    assert claim.numbers["bend_per_unit_6_deg"] == pytest.approx(1.02 * 35 / 6)
    assert judge_length(three, made_curve(tmp_path / "stiff", 0.6)).verdict == "mixed"
    uneven = made_curve(tmp_path / "bad", 0.4, unit_stress=(50.0, 150.0) * 3)
    assert judge_length(three, uneven).verdict == "refuted"


def test_inverse_pressures(tmp_path):
    good, bad = made_curve(tmp_path / "a"), made_curve(tmp_path / "b", left=0.2)
    assert judge_inverse_pressures({"a": good}).verdict == "holds"
    assert judge_inverse_pressures({"a": good, "b": bad}).verdict == "mixed"
    assert judge_inverse_pressures({"b": bad}).verdict == "refuted"


def test_linearity(tmp_path):
    claim = judge_linearity({"a": made_curve(tmp_path / "a", bow=0.001)})
    assert claim.verdict == "holds"
    assert claim.numbers["largest_deviation_a_deg"] > 0
    assert judge_linearity({"a": made_curve(tmp_path / "b", bow=-0.02)}).verdict == "refuted"


def test_reversal(tmp_path):
    forward = made_curve(tmp_path / "f", left=-1.0)
    rows = [
        {"step": k, "pressure_right_kpa": -5.0 * k, "pressure_left_kpa": 5.0 * k, "bend_deg": -2.5 * k}
        for k in range(9)
    ]
    write_table(tmp_path / "b" / "curve.csv", rows)
    assert judge_reversal(forward, Curve(tmp_path / "b")).verdict == "holds"
    rows[4]["bend_deg"] = -10.001
    write_table(tmp_path / "c" / "curve.csv", rows)
    assert judge_reversal(forward, Curve(tmp_path / "c")).verdict == "refuted"


def test_filter(tmp_path):
    coupled = made_curve(tmp_path / "coupled")
    claim = judge_filter(made_curve(tmp_path / "near", gain=0.51, left=-1.34), coupled)
    assert claim.verdict == "holds"
    assert claim.numbers["accepted_states"] == 8
    assert claim.numbers["largest_difference_bend_deg_percent"] == pytest.approx(2.0)
    assert claim.numbers["largest_difference_pressure_left_kpa"] == pytest.approx(0.04 * 40)
    assert judge_filter(made_curve(tmp_path / "far", gain=0.51, left=-1.4), coupled).verdict == "mixed"
    assert judge_filter(made_curve(tmp_path / "off", gain=0.6, left=-1.4), coupled).verdict == "refuted"


def test_a_claim_judged_twice_holds_where_both_say_so():
    solved = [Claim("C5", "s", "r", "holds", {"slope": -1.2}, "a"), Claim("C6", "s", "r", "holds")]
    seen = [Claim("C5", "s", "q", "refuted", {"slope": -0.8}, "b"), Claim("C11", "s", "q", "mixed")]
    joined = {claim.id: claim for claim in join_claims(solved, seen)}
    assert list(joined) == ["C5", "C6", "C11"]
    assert joined["C5"].verdict == "mixed"
    assert joined["C5"].numbers == {"slope": -1.2, "bench_slope": -0.8}
    assert joined["C5"].rule == "r; on the bench: q"
    assert join_claims(solved, [solved[0]])[0].verdict == "holds"
