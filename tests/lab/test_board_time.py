"""Board time in host time: drift of the resonator, jitter of the cable, wrap of the counter, hold-ups."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.lab.board_time import WRAP_MS, BoardTime


@pytest.mark.parametrize("drift", [-0.004, 0.0, 0.004])
def test_a_drifting_board_is_followed_through_jitter(drift):
    noise = np.random.default_rng(0)
    board_time, errors = BoardTime(), []
    for millisecond in range(0, 120_000, 5):
        true = 100.0 + millisecond * 1e-3 * (1 + drift)
        arrival = true + 0.002 + noise.exponential(0.004)
        board = board_time.observe(millisecond, arrival)
        errors.append(board_time.host_time(board) - true)
    settled = np.array(errors[4000:])
    assert np.abs(settled - 0.002).max() < 0.004  # the shortest delay itself cannot be seen


def test_the_counter_wraps_after_49_days_without_a_jump():
    board_time = BoardTime()
    before = board_time.observe(WRAP_MS - 10, 50.0)
    after = board_time.observe(5, 50.015)
    assert after - before == pytest.approx(0.015)


def test_after_a_hold_up_the_times_are_right_again_within_three_seconds():
    board_time = BoardTime()
    for millisecond in range(0, 20_000, 5):
        late = 3.0 if millisecond > 10_000 else 0.0  # the board stood still for 3 s
        board = board_time.observe(millisecond, millisecond * 1e-3 + late)
    assert board_time.host_time(board) == pytest.approx(20.0 - 0.005 + 3.0, abs=0.01)
