"""The long pulse under a pressure limit, and the short ones that are tried, on the model alone."""

from functools import cache

import numpy as np
import pytest

from tubefoot.control.bench_model import FORWARD, REVERSE, BenchModel
from tubefoot.control.crowd import MIDDLES
from tubefoot.control.foresight import Planned, foresee
from tubefoot.control.hold_plan import grid
from tubefoot.control.long_pulse import RIDE_S, LongPulses
from tubefoot.control.settings import AdaptiveSettings
from tubefoot.control.short_pulses import short_pulses
from tubefoot.lab.settings import PumpSettings
from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG, KPA

TARGET, PUMP, SETTINGS = 30.0 * DEG, PumpSettings(), AdaptiveSettings()
FLOW = 1500.0 * 0.75 / 0.85
"""At duty 0.9 [mm^3/s]."""


@cache
def model():
    reference = reference_file()
    return BenchModel(reference.to_finger(), reference.to_prony())


def filled(seconds, rest_s=0.0):
    """The bench after it was filled at duty 0.9 and left alone."""
    guess = MIDDLES.copy()
    guess[FORWARD] = guess[REVERSE] = 0.0
    state = model().at_rest(guess[:, None])
    for _ in range(round(seconds / 0.02)):
        state = model().step(state, 0.02, np.array([FLOW * 0.02]))
    for _ in range(round(rest_s / 0.05)):
        state = model().step(state, 0.05, np.zeros(1))
    return state


def pressed(state):
    return float(model().branch_pressures(state).max())


def chosen(state, limit_kpa, measured=None):
    pulses = LongPulses(model(), PUMP, SETTINGS, limit_kpa * KPA)
    return pulses.fastest(state, pressed(state) if measured is None else measured, TARGET, 1, 0.25)


def test_full_duty_far_from_the_limit_and_less_near_it():
    state = filled(0.4)
    free, bound = chosen(state, 200.0), chosen(state, pressed(state) / KPA + 8.0)
    assert free.duty == SETTINGS.fill_duty_max
    assert SETTINGS.fill_duty_max > bound.duty > 0.25
    path = foresee(model(), state, PUMP, [Planned(1, bound.duty, 1.0)], RIDE_S).pressures[0]
    assert path.max() == pytest.approx(pressed(state) + 8.0 * KPA, abs=1.0 * KPA)
    assert bound.duration > free.duration


def test_the_pressure_that_counts_is_the_measured_one():
    """Where a sensor shows more than the model, the duty is lower."""
    state = filled(0.4)
    limit = pressed(state) / KPA + 8.0
    assert chosen(state, limit, pressed(state) + 3.0 * KPA).duty < chosen(state, limit).duty


def test_the_creep_after_the_long_pulse_leads_where_it_should():
    state = filled(0.3)
    pulse = chosen(state, 200.0)
    path = foresee(model(), state, PUMP, [Planned(1, pulse.duty, pulse.duration)])
    after = path.bend_at(pulse.duration + np.linspace(0.0, SETTINGS.arrive_s, 30))[0]
    assert after.max() == pytest.approx(TARGET + SETTINGS.arrive_deg * DEG, abs=0.5 * DEG)
    assert after[0] < TARGET - 2.0 * DEG  # the creep does the rest


def test_short_pulses_answer_either_way_and_the_best_is_the_best():
    state = filled(0.7, 1.5)
    tried = short_pulses(model(), state, PUMP, SETTINGS, 3.0)
    times = grid(2.0)
    here = float(model().bend(state)[0])
    for way in (1, -1):
        answers = tried.answers(way, here, times)
        assert answers.free[0] == pytest.approx(0.0, abs=1e-12)
        assert answers.on[5] > 0 > answers.back[5]
        assert answers.free[-1] * way > 0  # it creeps on
    window = np.linspace(0.1, 2.1, 16)
    best = tried.best(here, window)
    assert best < 0
    errors = [
        np.abs(
            foresee(model(), state, PUMP, [Planned(1 if d > 0 else -1, 0.9, abs(d))]).bend_at(window) - here
        )
        for d in (best, best - 0.03, best + 0.03)
    ]
    assert errors[0].mean() < min(errors[1].mean(), errors[2].mean())
