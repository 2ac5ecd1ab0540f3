"""Recordings that no bench can have made are refused in words; what is only missing is passed over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import raw_series

from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.loading import prepared
from tubefoot.validation.pulses import pulse_doubt
from tubefoot.validation.windows import observe

NOT_KNOWN = {"pulses": ()}


def stuck(raw):
    pressures = raw.pressures.copy()
    pressures[1000:, 1] = pressures[1000, 1]
    return {"pressures": pressures}


WRONG = [
    (lambda raw: {"time": 1e3 * raw.time}, r"samples are 10 s apart: allowed are 0.0002 to 5 s.*time\.unit"),
    (lambda raw: {"time": 1e-3 * raw.time}, r"samples are 1e-05 s apart"),
    (lambda raw: {"drive": 100 * raw.drive}, r"drive reaches 50: it is a share.*columns\.drive\.unit"),
    (lambda raw: {"angle_time": raw.angle_time + 3600.0}, r"angles run from 3600\.\d to .*on one clock"),
    (lambda raw: {"pressures": 6.9 * raw.pressures}, r"pressure changes by -165\.\d kPa: allowed are -101"),
    (
        lambda raw: {"pressures": np.abs(1e3 * raw.pressures)},
        r"changes by 3\.\d+e\+04 kPa.* to 300 kPa; check its unit",
    ),
    (lambda raw: {"angle": raw.angle / DEG}, r"bends by 68\d\.\d deg: allowed are 180 deg"),
    (lambda raw: {"pressures": raw.pressures[:, ::-1]}, r"in 24 of 24 pulses right less left pressure falls"),
    (lambda raw: {"angle": -raw.angle}, r"angle falls where right less left.*correlation -1\.00.*sign = -1"),
    (stuck, r"left pressure shows \S+ kPa without change from 10\.0 to 40\.0 s, over 20 pulses"),
]


@pytest.mark.parametrize(("spoil", "message"), WRONG)
def test_what_no_bench_shows_is_refused_with_what_to_do(spoil, message):
    raw = raw_series(cycles=1)
    with pytest.raises(ConfigError, match="^monday: .*" + message):
        prepared(replace(raw, **spoil(raw)), "monday")


def test_spikes_and_a_bench_at_its_limits_are_no_wrong_units():
    raw = raw_series(cycles=1, top_kpa=95.0, gain_deg_per_kpa=1.8)
    pressures = raw.pressures.copy()
    pressures[250::500, 0] += 900 * KPA
    assert prepared(replace(raw, pressures=pressures), "hard").pressure_outlier.sum() == 8


def test_a_finger_without_weight_on_its_angle_or_motion_is_no_wrong_sign():
    assert prepared(raw_series(cycles=1, gain_deg_per_kpa=0.0), "still").has_angles


def test_a_hole_in_the_samples_may_hide_pulses_and_is_not_fitted():
    raw = raw_series(cycles=1)
    kept = (raw.time < 12.0) | (raw.time > 20.0)
    hole = replace(raw, time=raw.time[kept], pressures=raw.pressures[kept], drive=raw.drive[kept])
    assert observe(prepared(hole, "listed")).count > 100
    unlisted = prepared(replace(hole, **NOT_KNOWN), "hole")
    with pytest.raises(ConfigError, match=r"hole: no samples from 12\.0 to 20\.0 s"):
        observe(unlisted)


def test_samples_too_slow_for_the_pulses_are_not_fitted():
    raw = raw_series(cycles=1)
    slow = replace(
        raw, time=raw.time[::15], pressures=raw.pressures[::15], drive=raw.drive[::15], **NOT_KNOWN
    )
    with pytest.raises(ConfigError, match=r"samples are 0\.15 s apart and pulses 0\.\d+ s long"):
        observe(prepared(slow, "slow"))
    assert observe(prepared(replace(slow, pulses=raw.pulses), "listed")).count > 50


def test_pulses_are_doubted_where_only_samples_tell_them():
    raw = raw_series(cycles=1)
    assert pulse_doubt(prepared(raw, "listed")) == 0.0
    assert pulse_doubt(prepared(replace(raw, **NOT_KNOWN), "seen")) == pytest.approx(0.05, rel=0.05)
