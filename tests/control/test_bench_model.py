"""The controller's picture of a bench against the reduced finger, the twin, its mirror image, its volume."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from tubefoot.control.bench_model import (
    FORWARD,
    GASES,
    LAG,
    LEAK,
    PUMPED,
    REVERSE,
    UNKNOWN,
    VOLUMES,
    BenchModel,
)
from tubefoot.control.crowd import MIDDLES
from tubefoot.control.foresight import EDGES_S, Planned, foresee
from tubefoot.lab.settings import PumpSettings
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.relaxation import NO_RELAXATION
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.plant import PumpDrive
from tubefoot.units import ATMOSPHERE_MPA, DEG, KPA

GAS = 800.0
"""Of each side [mm^3]."""


@cache
def reference_model(creeping: bool = True) -> BenchModel:
    reference = reference_file()
    return BenchModel(reference.to_finger(), reference.to_prony() if creeping else NO_RELAXATION)


def nominal(model: BenchModel):
    """A print of stiffness one, without seam, without tube, on a calibrated pump that follows at once."""
    guess = np.zeros((UNKNOWN, 1))
    guess[GASES] = np.log(GAS)
    guess[4], guess[LAG], guess[LEAK] = np.log(1e-9), np.log(1e-3), np.log(1e-9)
    return model.at_rest(guess)


def test_weightless_rest_is_the_equilibrium_of_the_reduced_finger():
    """One angle for all units costs 1 % against the chain, whose end units are softer."""
    finger, model = reference_file().to_finger(), BenchModel(reference_file().to_finger(), NO_RELAXATION)
    model._weight = 0.0
    for volume in (300.0, 900.0, -600.0):
        state = nominal(model)
        for _ in range(10):
            state = model.step(state, 1.0, np.array([volume / 10]))
        state = model.step(state, 1.0, np.zeros(1))
        still = finger.equilibrium(volume * np.array([1.0, -1.0]), (GAS, GAS))
        assert model.bend(state)[0] == pytest.approx(still.bend, rel=0.015)
        assert model.branch_pressures(state)[:, 0] == pytest.approx(still.pressures, rel=0.015)


def test_follows_the_bench_of_the_twin_through_two_pulses():
    """MuJoCo chain, ripple, leaks and millisecond steps against one angle and steps of a frame."""
    make, model = BenchSettings(), reference_model()
    plant, state = BenchPlant(make, 1), nominal(model)
    for row, value in ((GASES.start, 1100.0), (GASES.start + 1, 1200.0), (4, 1.9e-6)):
        state[row] = np.log(value)
    bends, pressures, before = [], [], 0.0
    for frame in range(90):
        direction = 1 if frame < 18 else -1 if 40 <= frame < 46 else 0
        for _ in range(33):
            plant.step(1e-3, PumpDrive(direction, 0.9 * abs(direction)))
        right = plant.hydraulics.sides[0]
        pumped = right.in_branch + right.in_chamber
        state = model.step(state, 0.033, np.array([pumped - before]))
        before, truth = pumped, plant.truth()
        bends.append((truth.bend, model.bend(state)[0]))
        pressures.append((*truth.branch_pressures, *model.branch_pressures(state)[:, 0]))
    bends, pressures = np.array(bends) / DEG, np.array(pressures) / KPA
    assert bends[:, 0].max() > 15
    assert np.abs(bends[:, 0] - bends[:, 1]).max() < 0.3
    assert np.abs(pressures[:, :2] - pressures[:, 2:]).max() < 1.5


def test_liquid_is_kept_and_reversing_mirrors():
    model = reference_model()
    there, back = nominal(model), nominal(model)
    for volume in (120.0, 80.0, 0.0, -50.0):
        there = model.step(there, 0.05, np.array([volume]))
        back = model.step(back, 0.05, np.array([-volume]))
        pressed = model.branch_pressures(there)
        gas = np.exp(there[GASES]) * pressed / (ATMOSPHERE_MPA + pressed)
        stored = there[VOLUMES] + gas
        assert stored[:, 0] == pytest.approx(there[PUMPED, 0] * np.array([1.0, -1.0]), rel=1e-12)
        assert model.bend(back)[0] == pytest.approx(-model.bend(there)[0], rel=1e-6)
        assert model.branch_pressures(back)[::-1] == pytest.approx(pressed, rel=1e-6)


def test_guesses_do_not_disturb_each_other():
    model, chance = reference_model(), np.random.default_rng(5)
    guesses = (
        MIDDLES[:, None]
        + 0.2 * chance.standard_normal((UNKNOWN, 4)) * (np.arange(UNKNOWN) < UNKNOWN - 1)[:, None]
    )
    crowd = model.at_rest(guesses)
    alone = [model.at_rest(guesses[:, [k]]) for k in range(4)]
    for _ in range(5):
        crowd = model.step(crowd, 0.04, np.full(4, 40.0))
        alone = [model.step(state, 0.04, np.full(1, 40.0)) for state in alone]
    np.testing.assert_allclose(model.bend(crowd), [model.bend(state)[0] for state in alone], rtol=2e-3)


def test_foresight_of_a_pulse_is_what_steps_give():
    model, pump = reference_model(), PumpSettings()
    start = nominal(model)
    paths = foresee(model, start, pump, [Planned(1, 0.9, 0.3), Planned(-1, 0.9, 0.1), Planned(1, 0.9, 0.0)])
    flow = 1500.0 * 0.75 / 0.85
    state, bends = start, [0.0]
    for begin, end in pairwise(EDGES_S):
        state = model.step(state, end - begin, np.array([flow * (min(end, 0.3) - min(begin, 0.3))]))
        bends.append(float(model.bend(state)[0]))
    assert paths.bends[0] == pytest.approx(bends, abs=1e-3 * max(bends))
    assert (paths.bends[1][1:] < 0).all()
    assert np.abs(paths.bends[2]).max() < 1e-9
    halfway = 0.5 * (EDGES_S[3] + EDGES_S[4])
    assert paths.bend_at(np.array([halfway]))[0, 0] == pytest.approx(0.5 * (bends[3] + bends[4]), rel=1e-3)


def test_gains_of_the_pump_count_by_direction():
    model, state = reference_model(), nominal(reference_model())
    state[FORWARD], state[REVERSE] = np.log(0.9), np.log(0.7)
    state = model.step(state, 0.5, np.array([100.0]))
    state = model.step(state, 0.5, np.array([-100.0]))
    state = model.step(state, 0.5, np.zeros(1))
    assert state[PUMPED, 0] == pytest.approx(20.0, rel=1e-6)


def test_what_leaks_back_through_the_pump_follows_the_difference_of_the_pressures():
    model = reference_model()
    state = nominal(model)
    state[LEAK] = np.log(50.0)
    state = model.step(state, 0.5, np.array([500.0]))
    state = model.step(state, 0.5, np.zeros(1))
    right, left = model.branch_pressures(state)
    assert right[0] - left[0] > 30 * KPA
    after = model.step(state, 0.1, np.zeros(1))
    assert state[PUMPED, 0] - after[PUMPED, 0] == pytest.approx(5.0 * (right[0] - left[0]), rel=1e-3)
    assert model.bend(after)[0] < model.bend(model.step(nominal_leak_free(state), 0.1, np.zeros(1)))[0]


def nominal_leak_free(state):
    """The same state on a pump that is tight."""
    tight = state.copy()
    tight[LEAK] = np.log(1e-9)
    return tight
