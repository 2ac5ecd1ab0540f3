"""The rollers' ripple: its form against the twin's pump; that the crowd learns where the rollers stand."""

import numpy as np
import pytest
from tests.control.bends import reference_law

from tubefoot.control.bench_model import AHEAD, LAG, LEAK, PUMPED, ROLLERS, TURNED, UNKNOWN
from tubefoot.control.contract import Measurement
from tubefoot.control.crowd import Crowd
from tubefoot.control.rollers import ROLLER_MM3, ahead
from tubefoot.lab.sensing import measure_neutral
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import PumpMake
from tubefoot.twin.population import drawn_bench
from tubefoot.twin.pump import Pump

STEP_S = 1e-3


def turned_and_ahead(pump, directions):
    """Volume turned either way and moved beyond that, after each millisecond [mm^3]."""
    rows, moved, turned = [], 0.0, 0.0
    for direction in directions:
        flow = pump.step(STEP_S, direction, 0.9)
        moved += flow * STEP_S
        turned += pump.flow * STEP_S
        rows.append((pump.turned, moved - turned))
    return np.array(rows).T


def fitted(turned, beyond):
    """Amplitudes by least squares, and what they leave [mm^3]."""
    none = np.zeros((4, len(turned)))
    shapes = []
    for k in range(4):
        unit = none.copy()
        unit[k] = 1.0
        shapes.append(ahead(turned, unit) - ahead(np.zeros(1), unit[:, :1]))
    amplitudes = np.linalg.lstsq(np.array(shapes).T, beyond, rcond=None)[0]
    return amplitudes, beyond - amplitudes @ np.array(shapes)


@pytest.mark.parametrize("phase", [0.0, 1.7, 4.0])
def test_two_harmonics_are_the_ripple_of_the_pump_but_for_a_microlitre(phase):
    """ROLLER_MM3 is that of the twin's head: with another one the form would not fit."""
    turned, beyond = turned_and_ahead(Pump(PumpMake(), phase), [1] * 1500)
    _, left = fitted(turned, beyond)
    assert np.ptp(beyond) > 10.0
    assert left.std() < 1.0
    assert fitted(1.1 * turned, beyond)[1].std() > 2.0


def test_a_step_of_the_model_moves_what_the_pump_does_also_back():
    """The same volume told, forward and then back: the ripple counts on, with the other sign."""
    pump = Pump(PumpMake(lag_s=0.002), 0.4)
    turned, beyond = turned_and_ahead(pump, [1] * 900 + [0] * 50)
    amplitudes, _ = fitted(turned, beyond)
    rest = turned_and_ahead(pump, [-1] * 80 + [0] * 50)[1]
    model = reference_law().model
    guess = np.zeros((UNKNOWN, 1))
    guess[: ROLLERS.start, 0] = [
        0.0,
        0.0,
        np.log(800.0),
        np.log(800.0),
        np.log(1e-9),
        0,
        0,
        np.log(2e-3),
        0,
        0,
    ]
    guess[ROLLERS, 0], guess[LEAK] = amplitudes, np.log(1e-9)
    state = model.at_rest(guess)
    assert np.exp(state[LAG, 0]) == pytest.approx(0.002)
    back = pump.turned - turned[-1]
    for volume in np.repeat([turned[-1] / 30, 0.0, -back / 4], [30, 4, 4]):
        state = model.step(state, 0.05, np.array([volume]))
    state = model.step(state, 0.5, np.zeros(1))
    assert state[PUMPED, 0] == pytest.approx(turned[-1] - back, abs=1e-6)
    assert state[TURNED, 0] == pytest.approx(turned[-1] + back, abs=1e-6)
    assert abs(rest[-1]) > 4.0  # of about 100 mm^3
    assert state[AHEAD, 0] == pytest.approx(beyond[-1] + rest[-1], abs=2.0)


@pytest.mark.parametrize("seed", [1001, 1003])
def test_the_crowd_learns_where_the_rollers_stand(seed):
    """After one long pulse: what a short one forward or back would move, against the twin's rollers."""
    crowd = Crowd(reference_law().model)
    with VirtualBench(drawn_bench(seed), seed, "native") as bench:
        bench.rig.connect()
        measure_neutral(bench.rig)
        bench.angles.open()
        bench.rig.pulse(1, 0.9, 0.7)
        begin = bench.clock.now()
        while bench.clock.now() - begin < 1.5:
            angle, sample, now = bench.angles.read(), bench.rig.read(), bench.clock.now()
            volume, pressures = sample.pumped_volume, sample.gauge_pressures[:2]
            seen = Measurement(
                now, angle.time_s, angle.bend, angle.sigma, pressures, volume, sample.time, sample.direction
            )
            crowd.observe(seen)
        pump, state = bench.plant.pump, crowd.present(seen)
        assert state[TURNED, 0] == pytest.approx(pump.turned, rel=0.05)
        volumes = np.linspace(0.0, ROLLER_MM3, 61)
        learnt = ahead(state[TURNED, 0] + volumes, state[ROLLERS]) - ahead(state[TURNED], state[ROLLERS])
        truth = np.array([_ahead_of(pump, volume) for volume in volumes])
    assert np.ptp(truth) > 6.0
    assert np.corrcoef(learnt, truth)[0, 1] > 0.9
    assert (learnt - truth).std() < 0.5 * truth.std()


def _ahead_of(pump, volume):
    """What the twin's rollers would move beyond a volume that the motor turns from now on [mm^3]."""
    phase = pump._phase + np.linspace(0.0, volume, 200) / ROLLER_MM3 * 2.0 * np.pi
    dip = np.maximum(np.cos(phase), 0.0) ** 4
    return -pump._make.ripple * volume * float(dip.mean() - 3.0 / 16.0)
