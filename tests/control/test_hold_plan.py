"""Plans of up to two short pulses to the soonest hold, on paths made up here."""

import numpy as np
import pytest

from tubefoot.control.hold_plan import (
    GRID_S,
    LATEST,
    STOPPED,
    Answers,
    Bounds,
    grid,
    hold_cost,
    soonest_hold,
)
from tubefoot.units import DEG

TIMES = grid(2.0)
BOUNDS = Bounds(0.23 * DEG, 0.85 * DEG, 0.7 * DEG, 3, 0.3, 2.5)
ANSWER = 18.0 * DEG * (1.0 - np.exp(-TIMES / 0.15)) + 3.0 * DEG * TIMES
"""Of a second of a short pulse [rad/s]."""


def creeping(start_deg, rate, fade_s=1.5):
    """Answers of a finger that creeps, errors past the target in degrees and degrees per second."""
    free = DEG * (start_deg + rate * fade_s * (1.0 - np.exp(-TIMES / fade_s)))
    return Answers(free, -ANSWER, ANSWER)


def path_after(answers, *pulses):
    """The free path with pulses (begin [s], duration [s]) laid over it."""
    path = answers.free.copy()
    for begin, duration in pulses:
        start = round(begin / GRID_S)
        path[start:] += answers.to(np.array([duration]))[0][: len(path) - start]
    return path


def held(path, begin):
    start = round(begin / GRID_S)
    return np.abs(path[start : start + len(TIMES) - LATEST])


def test_a_still_finger_at_its_target_is_held_at_once():
    plan = soonest_hold(creeping(0.1, 0.0), 0.25, BOUNDS)
    assert (plan.begins, plan.pulses, plan.missed) == (0.0, 0, 0.0)


def test_a_slow_creep_is_waited_for():
    plan = soonest_hold(creeping(-1.0, 0.7), 0.25, BOUNDS._replace(cheap=0))
    assert plan.pulses == 0
    assert 0.2 < plan.begins < 2.0
    assert held(creeping(-1.0, 0.7).free, plan.begins).mean() <= BOUNDS.mean + 0.01 * DEG


def test_a_fast_creep_is_let_down_by_one_pulse_back():
    answers = creeping(-0.6, 2.0)
    plan = soonest_hold(answers, 0.25, BOUNDS)
    assert plan.pulses == 1
    assert plan.duration < 0
    path = path_after(answers, (plan.first, plan.duration))
    assert plan.begins == pytest.approx(plan.first + STOPPED * GRID_S)
    assert held(path, plan.begins).mean() <= BOUNDS.mean + 0.01 * DEG
    assert path[: round(plan.begins / GRID_S)].max() <= BOUNDS.overshoot + 0.01 * DEG


def test_two_pulses_are_sooner_where_one_would_have_to_wait():
    """Shown by forbidding the second, which is what costs a further pulse do."""
    answers = creeping(-0.3, 3.0, 2.5)
    two = soonest_hold(answers, 0.25, BOUNDS)
    one = soonest_hold(answers, 0.25, BOUNDS._replace(cheap=1, further_s=1e3))
    assert (two.pulses, one.pulses) == (2, 1)
    assert two.begins + two.missed + 0.3 < one.begins + one.missed
    lasts = np.linspace(-0.25, 0.25, 51)
    seconds = [path_after(answers, (two.first, two.duration), (two.begins - 0.1, last)) for last in lasts]
    assert min(held(path, two.begins).mean() for path in seconds) <= BOUNDS.mean + DEG * two.missed


def test_a_pulse_on_where_the_finger_falls_short():
    plan = soonest_hold(creeping(-1.5, 0.1), 0.25, BOUNDS)
    assert plan.pulses >= 1
    assert plan.duration > 0


def test_nothing_better_is_found_by_trying_all_single_pulses():
    answers = creeping(-0.6, 2.0)
    plan = soonest_hold(answers, 0.25, BOUNDS._replace(cheap=1, further_s=1e3))
    for start in range(LATEST):
        for duration in np.linspace(-0.25, 0.25, 51):
            path = path_after(answers, (start * GRID_S, duration))
            away = held(path, start * GRID_S + GRID_S)
            good = away.mean() <= BOUNDS.mean and max(away[0], away[-1]) <= BOUNDS.error
            if good and path[: start + 2].max() <= BOUNDS.overshoot:
                assert start * GRID_S + GRID_S >= plan.begins - 1e-9


def test_pulses_beyond_the_cheap_ones_cost_more():
    assert [BOUNDS._replace(cheap=1).pulses_cost(n) for n in (0, 1, 2)] == pytest.approx([0.0, 0.3, 2.8])
    assert BOUNDS._replace(cheap=-2).pulses_cost(1) == 2.5


def test_where_the_pump_is_not_known_a_pulse_is_spent_on_it():
    """A single pulse that may move a third more or less spoils its hold; the second of two mends it."""
    answers = creeping(-0.6, 2.0)
    exact, loose = (soonest_hold(answers, 0.25, BOUNDS._replace(scatter=scatter)) for scatter in (0.0, 0.35))
    assert (exact.pulses, loose.pulses) == (1, 2)
    assert loose.cost > exact.cost


def test_where_pulses_scatter_the_last_one_has_less_to_do():
    """The first one of two does more, and the hold begins later, when the finger creeps less."""
    answers = creeping(-0.3, 3.0, 2.5)
    exact, loose = (
        soonest_hold(answers, 0.25, BOUNDS._replace(known_scatter=scatter)) for scatter in (0.0, 0.3)
    )
    assert (exact.pulses, loose.pulses) == (2, 2)
    assert loose.duration < exact.duration < 0
    assert loose.begins > exact.begins


def test_a_hold_costs_what_it_misses():
    assert hold_cost(0.23 * DEG, 0.85 * DEG, BOUNDS) == 0.0
    assert hold_cost(0.33 * DEG, 0.85 * DEG, BOUNDS) == pytest.approx(2.0)
    assert hold_cost(0.23 * DEG, 0.95 * DEG, BOUNDS) == pytest.approx(1.0)
