"""From raw series to a recording: baseline, drift, pulses, outliers, latency, states; all of known truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_recordings import PAUSE_S, STEPS, program, raw_series, record

from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.loading import distinct_names, prepared
from tubefoot.validation.settled import creeping_states, last_rest, settled_states, standard_error


def test_baseline_takes_off_what_the_sensors_show_at_rest():
    found = record(offsets_kpa=(3.0, -101.0), cycles=1)
    assert np.array(found.rest.pressures) / KPA == pytest.approx([3.0, -101.0], abs=0.01)
    first = settled_states(found)[0]
    assert (first.right, first.left) == pytest.approx((0, 0), abs=0.02 * KPA)
    assert found.rest.sigma[0] == pytest.approx(0.02 * KPA, rel=0.2)


@pytest.mark.parametrize("line", ["rest", "ends"])
def test_a_drifting_sensor_is_straightened_by_its_line(line):
    drifting = raw_series(drift_kpa_per_s=0.02, noise_kpa=0.005, cycles=1)
    kept = settled_states(prepared(drifting, "kept"))[-1].right
    taken = settled_states(prepared(drifting, "taken", drift=line))[-1].right
    assert kept > 0.6 * KPA
    assert abs(taken) < 0.15 * KPA


def test_a_line_to_the_last_rest_has_the_slope_of_the_drift():
    drifting = raw_series(drift_kpa_per_s=0.02, noise_kpa=0.005, cycles=1)
    found = prepared(drifting, "taken", drift="ends").rest.drift
    # It rises by 0.7 kPa over the recording; the medians of 5 Pa of noise are off by less than 1 Pa.
    assert np.array(found) / KPA == pytest.approx([0.02, 0.02], rel=0.01)


def test_a_line_to_a_rest_that_is_not_there_is_refused():
    raw = raw_series(cycles=1)
    until = raw.time < raw.pulses[-1].end
    cut = replace(raw, time=raw.time[until], pressures=raw.pressures[until], drive=raw.drive[until])
    with pytest.raises(ConfigError, match="drift = ends needs 5 samples of rest"):
        prepared(cut, "cut", drift="ends")


def test_a_recording_that_begins_with_the_pump_running_is_refused():
    raw = raw_series(cycles=1)
    late = raw.time >= 3.9
    cut = replace(
        raw, time=raw.time[late], pressures=raw.pressures[late], drive=raw.drive[late], angle=raw.angle
    )
    with pytest.raises(ConfigError, match=r"baseline needs 0.3 s of rest"):
        prepared(cut, "cut")


def test_recordings_get_distinct_names():
    same = (Path("x/a/bench.mcap"), Path("y/a/bench.mcap"))
    assert distinct_names(same) == ["a-1", "a-2"]


def test_a_recording_without_pulses_is_refused():
    raw = raw_series(cycles=1, top_kpa=0.0)
    with pytest.raises(ConfigError, match="no pulse of the pump"):
        prepared(replace(raw, pulses=(), drive=np.full(len(raw.time), np.nan)), "quiet")


@pytest.mark.parametrize("known", ["drive", "nothing"])
def test_pulses_are_found_from_the_drive_and_from_pressures_alone(known):
    raw = raw_series(cycles=1)
    drive = raw.drive if known == "drive" else np.full(len(raw.time), np.nan)
    found = prepared(replace(raw, pulses=(), drive=drive), "found").pulses
    truth = program(1)
    assert [pulse.direction for pulse in found] == [pulse.direction for pulse in truth]
    tolerance = 0.02 if known == "drive" else 0.1
    for one, true in zip(found, truth, strict=True):
        assert one.start == pytest.approx(true.start, abs=tolerance)
        assert one.end == pytest.approx(true.end, abs=tolerance)


def test_outliers_are_flagged_kept_and_do_no_harm():
    raw = raw_series(cycles=1)
    pressures, angle = raw.pressures.copy(), raw.angle.copy()
    pressures[450, 0] += 40 * KPA
    pressures[500, 1] = np.nan
    angle[130] += 15 * DEG
    spoilt = prepared(replace(raw, pressures=pressures, angle=angle), "spoilt")
    clean = prepared(raw, "clean")
    assert np.flatnonzero(spoilt.pressure_outlier).tolist() == [450, 500]
    assert np.flatnonzero(spoilt.angle_outlier).tolist() == [130]
    assert len(spoilt.time) == len(clean.time)
    assert not clean.pressure_outlier.any()
    assert spoilt.latency.seconds == pytest.approx(clean.latency.seconds, abs=5e-3)
    for one, other in zip(settled_states(spoilt), settled_states(clean), strict=True):
        assert one.right == pytest.approx(other.right, abs=0.02 * KPA)
        assert one.angle == pytest.approx(other.angle, abs=0.02 * DEG)


@pytest.mark.parametrize("lag_s", [0.0, 1.5])
@pytest.mark.parametrize("latency_s", [-0.15, 0.0, 0.08, 0.3])
def test_latency_is_found_also_behind_a_wall_that_creeps(latency_s, lag_s):
    raw = raw_series(latency_s=latency_s, lag_s=lag_s)
    found = prepared(raw, "late")
    assert found.latency.seconds == pytest.approx(latency_s, abs=max(3 * found.latency.sigma, 5e-3))
    assert found.latency.sigma < 0.03
    if abs(latency_s) > 0.05:
        assert found.latency.applied
        shift = raw.angle_time - found.angle_time
        assert shift == pytest.approx(np.full(len(shift), latency_s), abs=0.03)


def test_noise_without_motion_gives_no_latency_that_is_applied():
    raw = raw_series(cycles=1, gain_deg_per_kpa=0.0)
    found = prepared(raw, "still")
    assert not found.latency.applied
    assert found.angle_time == pytest.approx(raw.angle_time)


def test_states_know_their_branch_side_and_cycle():
    states = settled_states(record(cycles=2))
    assert len(states) == 1 + 2 * 4 * STEPS
    assert states[0].branch == "rest"
    first = states[1 : 1 + STEPS]
    assert {(s.branch, s.side, s.cycle) for s in first} == {("loading", 1, 1)}
    back = states[1 + STEPS : 2 * STEPS]
    assert {(s.branch, s.side, s.cycle) for s in back} == {("unloading", 1, 1)}
    other = states[1 + 2 * STEPS : 1 + 3 * STEPS]
    assert {(s.branch, s.side, s.cycle) for s in other} == {("loading", -1, 1)}
    again = states[1 + 4 * STEPS : 1 + 5 * STEPS]
    assert {(s.branch, s.side, s.cycle) for s in again} == {("loading", 1, 2)}


def test_states_are_taken_where_they_are_asked_for():
    found = record(cycles=1)
    for settle in (0.3, 0.7):
        states = settled_states(found, settle)[1:]
        assert {round(s.since_pulse, 2) for s in states} == {round(settle + 0.15, 2)}
    longest = PAUSE_S - 0.3
    cut = settled_states(found, 5.0)[1:-1]
    assert [s.since_pulse for s in cut] == pytest.approx([longest + 0.15] * len(cut), abs=0.02)
    late = creeping_states(found, [0.2, 0.6, 5.0])
    assert {round(s.since_pulse, 2) for s in late if s.pulse} == {0.35, 0.75}


def test_a_window_longer_than_every_pause_is_refused():
    with pytest.raises(ConfigError, match="no pause between pulses lasts 2 s"):
        settled_states(record(cycles=1), 0.1, window=2.0)


def test_the_end_is_a_state_only_where_the_finger_came_back():
    assert last_rest(record(cycles=1)) is not None
    raw = raw_series(cycles=1)
    until = program(1)[STEPS - 1].end + 0.9
    keep, seen = raw.time < until, raw.angle_time < until
    bent = replace(
        raw,
        time=raw.time[keep],
        pressures=raw.pressures[keep],
        drive=raw.drive[keep],
        angle_time=raw.angle_time[seen],
        angle=raw.angle[seen],
        angle_sigma=raw.angle_sigma[seen],
        pulses=raw.pulses[:STEPS],
    )
    assert last_rest(prepared(bent, "bent")) is None


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_standard_error_counts_correlation(memory):
    """Against the scatter of many means; with memory it is three times that of white noise."""
    chance = np.random.default_rng(3)
    means, errors = [], []
    for _ in range(300):
        white, values = chance.standard_normal(400), np.empty(400)
        held = chance.standard_normal() / np.sqrt(1 - memory**2)
        for at, value in enumerate(white):
            held = memory * held + value
            values[at] = held
        means.append(values.mean())
        errors.append(standard_error(values))
    assert np.mean(errors) == pytest.approx(np.std(means), rel=0.2)
