"""The crowd of possible benches on benches of the twin: it learns them, and foresees what they will do."""

import numpy as np
import pytest
from tests.control.bends import reference_law

from tubefoot.control.contract import Measurement
from tubefoot.control.crowd import Crowd
from tubefoot.lab.sensing import measure_neutral
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.population import drawn_bench
from tubefoot.units import DEG

AHEAD_S = (0.5, 1.5)


def followed(make, plan, last_s):
    """Of each frame: time [s], true bend now, that of the crowd, what it foresees with the pump standing."""
    model = reference_law().model
    crowd, rows = Crowd(model), []
    with VirtualBench(make, 3, "native") as bench:
        bench.rig.connect()
        measure_neutral(bench.rig)
        bench.angles.open()
        start, pulses = bench.clock.now(), list(plan)
        while bench.clock.now() - start < last_s:
            if pulses and bench.clock.now() - start >= pulses[0][0]:
                bench.rig.pulse(*pulses.pop(0)[1:])
            angle, sample, now = bench.angles.read(), bench.rig.read(), bench.clock.now()
            seen = Measurement(
                now,
                angle.time_s,
                angle.bend,
                angle.sigma,
                sample.gauge_pressures[:2],
                sample.pumped_volume,
                sample.time,
                sample.direction,
            )
            crowd.observe(seen)
            state = crowd.present(seen)
            row = [now - start, bench.truth().bend, float(model.bend(state)[0])]
            passed = 0.0
            for ahead in AHEAD_S:
                for _ in range(5):
                    state = model.step(state, (ahead - passed) / 5, np.zeros(1))
                passed = ahead
                row.append(float(model.bend(state)[0]))
            rows.append(row)
    return np.array(rows), crowd


@pytest.mark.parametrize("seed", [1002, 1006])
def test_learns_a_bench_from_its_first_pulses_and_foresees_its_creep(seed):
    make = drawn_bench(seed)
    rows, crowd = followed(make, [(0.1, 1, 0.9, 0.5), (1.4, -1, 0.9, 0.08)], 4.5)
    times, truth, now = rows[:, 0], rows[:, 1], rows[:, 2]
    quiet = (times > 1.9) & (times < 2.9)
    assert np.abs(now - truth)[quiet].max() < 0.15 * DEG
    for column, ahead in enumerate(AHEAD_S, start=3):
        later = np.interp(times + ahead, times, truth)
        assert np.abs(rows[:, column] - later)[quiet].max() < 0.25 * DEG
    creep = np.interp(times + 1.5, times, truth) - truth
    assert np.abs(creep[quiet]).max() > 0.6 * DEG  # it foresees a change, it does not repeat the present
    learnt = crowd.learnt
    warm = 1.0 + make.climate.stiffness_per_k * make.climate.start_k
    assert learnt["stiffness"] == pytest.approx(make.finger.stiffness * warm, rel=0.3)
    gas = 1e3 * (make.branches.air_right_ml + make.finger.bubble_right_ml)
    assert learnt["gas_right"] == pytest.approx(gas, rel=0.3)


def test_the_present_angle_does_not_leap():
    """A stiff print with much gas: benches drawn near a frame are out of balance, would leap by 0.5 deg."""
    rows, _ = followed(drawn_bench(1062), [(0.1, 1, 0.9, 0.9)], 3.0)
    times, truth, now = rows[:, 0], rows[:, 1], rows[:, 2]
    resting = times > 1.6
    assert np.abs(now - truth)[resting].mean() < 0.15 * DEG


def test_latency_is_made_up_for():
    """In mid-stroke what the crowd says of now is far better than the newest frame."""
    rows, _ = followed(None, [(0.1, 1, 0.9, 0.6)], 1.0)
    times, truth, now = rows[:, 0], rows[:, 1], rows[:, 2]
    stroke = (times > 0.4) & (times < 0.7)
    behind = truth - np.interp(times - 0.055, times, truth)
    assert np.abs(behind[stroke]).mean() > 1.0 * DEG
    assert np.abs(now - truth)[stroke].mean() < 0.3 * np.abs(behind[stroke]).mean()


def test_the_same_frames_give_the_same_crowd_to_the_bit():
    first, one = followed(None, [(0.1, 1, 0.9, 0.2)], 0.5)
    second, other = followed(None, [(0.1, 1, 0.9, 0.2)], 0.5)
    np.testing.assert_array_equal(first, second)
    assert one.learnt == other.learnt
