"""The pump: what it moves, how evenly, and from which duty on."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.twin.bench_settings import PumpMake
from tubefoot.twin.pump import Pump
from tubefoot.units import ML

STEADY = PumpMake(ripple=0.0, stiction_duty=0.0)


def pulse(make, duty, duration, direction=1, after=2.0):
    pump = Pump(make)
    flows = [pump.step(1e-3, direction, duty) for _ in range(round(duration * 1e3))]
    return np.array(flows + [pump.step(1e-3, 0, 0.0) for _ in range(round(after * 1e3))])


def test_a_pulse_moves_what_the_law_says_lag_or_not():
    """Start and stop lag alike, so the volume is flow (duty - dead) / (1 - dead) duration."""
    for lag in (0.02, 0.2):
        make = STEADY.model_copy(update={"lag_s": lag})
        moved = pulse(make, 0.6, 0.5).sum() * 1e-3
        assert moved == pytest.approx(1.45 * ML * (0.6 - 0.14) / (1 - 0.14) * 0.5, rel=2e-3)
    assert pulse(STEADY, 1.0, 0.5, -1).sum() * 1e-3 == pytest.approx(-1.38 * ML * 0.5, rel=2e-3)


def test_ripple_dips_once_a_roller_and_keeps_the_mean():
    make = PumpMake(ripple=0.35, lag_s=0.001)
    flows = pulse(make, 1.0, 20.0, after=0.0)[100:]
    mean = 1.45 * ML
    assert flows.mean() == pytest.approx(mean, rel=5e-3)
    assert flows.min() == pytest.approx(mean * (1 - 0.35 * (1 - 3 / 16)), rel=1e-3)
    below = flows < mean * 0.85
    dips = np.count_nonzero(below[1:] & ~below[:-1])
    assert dips == pytest.approx(3 * mean * 19.9 / (0.9 * ML), abs=1.5)


def test_it_stands_in_its_dead_zone_and_needs_more_to_start():
    make = PumpMake(dead_duty_forward=0.2, stiction_duty=0.05)
    assert not pulse(make, 0.24, 0.5).any()
    assert pulse(make, 0.26, 0.5).any()
    pump = Pump(make)
    for _ in range(300):
        pump.step(1e-3, 1, 0.5)
    for _ in range(500):
        pump.step(1e-3, 1, 0.22)
    assert pump.flow == pytest.approx(1.45 * ML * 0.02 / 0.8, rel=0.01)  # running, it goes on


def test_a_worn_tube_moves_less():
    fresh = pulse(STEADY, 1.0, 1.0).sum()
    worn = pulse(STEADY.model_copy(update={"wear": 0.2}), 1.0, 1.0).sum()
    assert worn == pytest.approx(0.8 * fresh, rel=1e-3)
    pump = Pump(STEADY.model_copy(update={"wear_per_l": 0.1, "lag_s": 0.001}))
    pump.turned = 2e6
    for _ in range(100):
        pump.step(1e-3, 1, 1.0)
    assert pump.flow == pytest.approx(0.8 * 1.45 * ML, rel=1e-4)
