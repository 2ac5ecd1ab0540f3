"""Comparison with a prediction: slopes, offsets and loops against closed forms; verdicts go both ways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import record

from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.loops import loops_of, repeatability
from tubefoot.validation.overlay import compare, line_within
from tubefoot.validation.prediction import Prediction, load_prediction, prediction_for
from tubefoot.validation.settled import SettledState, settled_states
from tubefoot.validation.spread import with_confidence
from tubefoot.validation.stage import validate_recordings
from tubefoot.validation.verdicts import falling_share, judge_recordings


def straight(coupling=-1.0, gain=0.5, top=40.0, units=3, name="fea"):
    """A prediction whose lines are known, kPa and degrees."""
    pressed = np.linspace(0.0, top, 9) * KPA
    return Prediction(name, units, pressed, coupling * pressed, gain * pressed / KPA * DEG)


def state(pulse, right, left, bend, branch="loading", cycle=1, side=1):
    return SettledState(
        pulse,
        cycle,
        branch,
        side,
        float(pulse),
        0.5,
        0.3,
        right * KPA,
        left * KPA,
        bend * DEG,
        0,
        0,
        0,
        30,
        False,
    )


def test_slopes_and_offsets_are_those_of_the_truth():
    found = record(cycles=3, coupling=-0.8, gain_deg_per_kpa=0.4, top_kpa=30.0)
    result = compare("made", settled_states(found), straight())
    figures = {name: estimate.value for name, estimate in result.figures.items()}
    assert (result.states, result.strokes, result.whole_strokes) == (3 * 2 * 6, 6, True)
    assert figures["coupling_slope"] == pytest.approx(-0.8, abs=2e-3)
    assert figures["angle_slope_deg_per_kpa"] == pytest.approx(0.4, abs=2e-3)
    assert figures["angle_r_squared"] > 0.9999
    # Levels are 5 to 30 kPa, 17.5 on average; whether 20 kPa is a high load is up to the noise.
    assert figures["angle_offset_deg"] == pytest.approx((0.4 - 0.5) * 17.5, abs=0.02)
    assert figures["suction_offset_kpa"] == pytest.approx((-0.8 + 1.0) * 17.5, abs=0.02)
    assert (0.4 - 0.5) * 27.6 < figures["angle_offset_high_deg"] < (0.4 - 0.5) * 24.9
    assert figures["angle_ratio_high"] == pytest.approx(0.8, abs=2e-3)
    assert result.predicted["angle_slope_deg_per_kpa"] == pytest.approx(0.5, rel=1e-9)
    assert result.band["angle_deg"][12] == pytest.approx(0.4 * result.band["pressed_kpa"][12], abs=0.05)


def test_intervals_hold_the_truth_as_often_as_they_say():
    """Strokes with errors of their own: 95 % intervals of the mean of 8 strokes, 80 recordings."""
    chance, inside = np.random.default_rng(1), 0
    strokes = [np.arange(5 * k, 5 * k + 5) for k in range(8)]
    for _ in range(80):
        values = np.repeat(chance.standard_normal(8), 5) + 0.1 * chance.standard_normal(40)
        (estimate,) = with_confidence(lambda chosen, v=values: np.array([v[chosen].mean()]), strokes, 0)
        inside += estimate.low <= 0.0 <= estimate.high
    # Percentile intervals of 8 strokes cover 89 %; drawing single states would cover about 58 %.
    assert 0.82 <= inside / 80 <= 0.97


def test_lines_with_an_offset_for_each_stroke():
    x = np.array([1.0, 2.0, 3.0, 1.0, 2.0, 3.0])
    stroke = np.array([0, 0, 0, 1, 1, 1])
    y = 2.0 * x + np.where(stroke == 1, 10.0, 0.0)
    assert line_within(stroke, x, y) == pytest.approx((2.0, 1.0, 0.0))
    bent = y + np.array([0.0, 0.3, 0.0, 0.0, 0.3, 0.0])
    slope, r_squared, deviation = line_within(stroke, x, bent)
    # About its mean each stroke is 2 (x - 2) + (-0.1, 0.2, -0.1): 8 + 8 of the line, 0.06 + 0.06 beside it.
    assert (slope, r_squared, deviation) == pytest.approx((2.0, 1 - 0.12 / 16.12, 0.2))


def test_states_beyond_the_prediction_are_counted_and_left_out():
    result = compare("made", settled_states(record(cycles=2)), straight(top=22.0))
    assert (result.states, result.beyond) == (2 * 2 * 4, 2 * 2 * 2)
    assert result.top == pytest.approx(20 * KPA, rel=0.01)
    with pytest.raises(ConfigError, match=r"lie within the 3.0 kPa of `fea`"):
        compare("made", settled_states(record(cycles=1)), straight(top=3.0))


@pytest.mark.parametrize(
    ("gain", "coupling", "verdict"),
    [(0.4, -0.8, "holds"), (0.6, -0.8, "mixed"), (0.4, -1.1, "mixed"), (0.6, -1.1, "refuted")],
)
def test_offsets_are_judged_by_their_signs(gain, coupling, verdict):
    found = record(cycles=2, gain_deg_per_kpa=gain, coupling=coupling, top_kpa=25.0)
    states = {"made": settled_states(found)}
    comparison = compare("made", states["made"], straight())
    verdicts = {claim.id: claim.verdict for claim in judge_recordings([comparison], states)}
    assert verdicts == {"C5": "holds", "C6": "holds", "C9": verdict}


def test_pressures_that_rise_together_refute_the_inverse_relation():
    states = {"made": settled_states(record(cycles=2, coupling=0.3))}
    comparison = compare("made", states["made"], straight())
    assert falling_share(states["made"]) == 0.0
    assert judge_recordings([comparison], states)[0].verdict == "refuted"


def test_a_bent_curve_is_not_linear():
    states = [s for s in settled_states(record(cycles=2)) if s.side]
    curved = [replace(s, angle=s.angle * abs(s.angle) / (6 * DEG)) for s in states]
    comparison = compare("made", curved, straight())
    claim = judge_recordings([comparison], {"made": curved})[1]
    assert claim.verdict == "refuted"
    assert claim.numbers["r_squared_made"] < 0.97


def test_area_of_a_loop_is_that_of_its_parallelogram():
    """Up along 0.5 deg/kPa, down 3 deg above it, from 0 to 30 kPa; suction 2 kPa deeper on the way back."""
    up = [state(i, 5.0 * i, -4.0 * i, 2.5 * i) for i in range(1, 7)]
    down = [
        state(6 + i, 35.0 - 5 * i, -4.0 * (7 - i) - 2, 2.5 * (7 - i) + 3, "unloading") for i in range(1, 7)
    ]
    (loop,) = loops_of([*up, *down])
    assert loop.angle_area == pytest.approx(3.0 * 25.0)
    assert loop.angle_width == pytest.approx(3.0)
    assert loop.pressure_area == pytest.approx(-2.0 * 25.0)
    assert loop.share == pytest.approx(3.0 / 12.5)
    # The last two differences are 20 and 11 kPa, the angles 8 and 5.5 deg.
    assert loop.rest_angle == pytest.approx(5.5 - 11 * 2.5 / 9)


def test_a_finger_without_memory_has_no_loops_and_repeats_to_the_noise():
    states = settled_states(record(cycles=4))
    assert [loop.angle_width for loop in loops_of(states)] == pytest.approx([0.0] * 8, abs=0.03)
    steady = repeatability(states)
    assert steady["angle_scatter_deg"] < 0.02
    assert abs(steady["angle_drift_deg_per_cycle"]) < 0.01


def test_a_finger_that_creeps_has_loops():
    states = settled_states(record(cycles=2, lag_s=4.0))
    assert min(loop.angle_width for loop in loops_of(states)) > 0.5


def test_drift_from_cycle_to_cycle_is_found():
    states = [
        replace(s, angle=s.angle + 0.3 * s.cycle * s.side * DEG) for s in settled_states(record(cycles=4))
    ]
    assert repeatability(states)["angle_drift_deg_per_cycle"] == pytest.approx(0.3, abs=0.01)


def test_a_recording_is_held_against_the_finger_of_its_length(tmp_path):
    three, six = straight(name="three"), straight(units=6, name="six")
    assert prediction_for(6, [three, six], "r").name == "six"
    with pytest.raises(
        ConfigError, match=r"r: its finger has 12 units; no run of that length among three \(3\)"
    ):
        prediction_for(12, [three, six], "r")
    with pytest.raises(ConfigError, match="give --units"):
        prediction_for(None, [three, six], "r")
    with pytest.raises(ConfigError, match=r"holds no curve.csv"):
        load_prediction(tmp_path)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_curve_of_a_solve_is_read_either_way_round(tmp_path, mirrored):
    head = "step,pressure_right_kpa,pressure_left_kpa,bend_deg\n"
    rows = [(0, 0, 0, 0), (1, 10, -12, 5), (2, 20, -26, 10)]
    if mirrored:
        rows = [(step, left, right, -bend) for step, right, left, bend in rows]
    (tmp_path / "curve.csv").write_text(head + "".join(",".join(map(str, row)) + "\n" for row in rows))
    found = load_prediction(tmp_path)
    assert found.other_at(np.array([15.0 * KPA])) / KPA == pytest.approx([-19.0])
    assert found.angle_at(np.array([15.0 * KPA])) / DEG == pytest.approx([7.5])
    assert found.units is None


def test_a_recording_without_angles_is_refused():
    found = record(cycles=1)
    blind = replace(found, angle=np.full(len(found.angle), np.nan))
    with pytest.raises(ConfigError, match="no angles in this recording"):
        validate_recordings([blind], [straight()])
