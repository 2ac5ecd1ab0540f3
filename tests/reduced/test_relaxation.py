"""The wall's memory against closed forms of the generalised Maxwell model."""

from importlib import resources

import numpy as np
import pytest

from made_fingers import linear_finger
from tubefoot.errors import ConfigError
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.relaxation import (
    DECADES_PER_K,
    MEASURED_C,
    NO_RELAXATION,
    ROOM_C,
    Prony,
    RelaxingFinger,
)

ONE_TERM = Prony((3.0,), (2.0,))


def test_a_step_of_angle_relaxes_by_the_prony_series(reference):
    """At no pressure, moments after a sudden turn are the equilibrium ones times G(t)."""
    prony = reference_file().to_prony()
    wall, angles, none = RelaxingFinger(reference, prony), np.full(12, 0.04), np.zeros(2)
    still = reference.respond(angles, none).moments
    sudden = 1e-6
    assert wall.commit(angles, none, sudden).moments == pytest.approx(still * prony.modulus(0.0), rel=1e-4)
    passed = sudden
    for duration in (0.05, 0.45, 2.0, 30.0, 4000.0):
        found = wall.commit(angles, none, duration)
        passed += duration
        assert found.moments == pytest.approx(still * prony.modulus(passed), rel=1e-4)


def test_a_ramp_is_exact_for_any_step():
    """M_e = K r t relaxes to K r (t + sum g tau (1 - exp(-t / tau))), in one step or in many."""
    finger = linear_finger(bending=70.0, n_units=1)
    expected = 70.0 * 0.02 * (5.0 + 3.0 * 2.0 * (1 - np.exp(-5.0 / 2.0)))
    for steps in (1, 50):
        wall = RelaxingFinger(finger, ONE_TERM)
        for k in range(1, steps + 1):
            found = wall.commit(np.array([0.02 * 5.0 * k / steps]), np.zeros(2), 5.0 / steps)
        assert found.moments[0] == pytest.approx(expected, rel=1e-10)


def test_held_pressures_creep_by_the_standard_linear_solid():
    """One term: J(t) = 1 - g / (1 + g) exp(-t / (tau (1 + g))) over the equilibrium compliance."""
    finger = linear_finger(bending=70.0, arm=90.0, n_units=3)
    wall, angles = RelaxingFinger(finger, ONE_TERM), np.zeros(3)
    pressures = np.array([0.02, -0.01])
    final = 90.0 * 0.03 / 70.0
    duration = 0.004
    for k in range(1, 2001):
        found = wall.respond(angles, pressures, duration)
        angles = angles - found.moments / found.stiffness
        wall.commit(angles, pressures, duration)
        if k in (1, 250, 2000):
            creep = 1.0 - 0.75 * np.exp(-k * duration / 8.0)
            assert angles == pytest.approx(np.full(3, final * creep), rel=2e-3)


def test_held_volumes_keep_the_angle_and_relax_the_pressures():
    """Moments stay zero at the equilibrium angles: only the pressures remember."""
    finger = linear_finger(n_units=2)
    still = finger.equilibrium(np.array([60.0, -60.0]))
    wall = RelaxingFinger(finger, ONE_TERM)
    angles, pressures, passed = still.angles, np.zeros(2), 0.0
    for duration in (1e-6, 0.5, 3.0, 100.0):
        for _ in range(4):  # Newton for pressures at the given angles; the law is linear
            found = wall.respond(angles, pressures, duration)
            pressures = pressures + np.linalg.solve(found.compliance, still.volumes - found.volumes)
        found = wall.commit(angles, pressures, duration)
        passed += duration
        assert np.abs(found.moments).max() < 1e-9
        assert pressures == pytest.approx(still.pressures * ONE_TERM.modulus(passed), rel=1e-5)


def test_tangents_of_a_step_are_central_differences(reference):
    wall = RelaxingFinger(reference, reference_file().to_prony())
    angles, pressures = np.linspace(0.01, 0.05, 12), np.array([0.03, -0.05])
    wall.commit(0.5 * angles, 0.3 * pressures, 0.2)
    found = wall.respond(angles, pressures, 0.01)
    steps = 1e-5 * np.eye(2)
    up, down = ([wall.respond(angles, pressures + sign * step, 0.01) for step in steps] for sign in (1, -1))
    for k in range(2):
        volumes, moments = (
            (getattr(up[k], of) - getattr(down[k], of)) / 2e-5 for of in ("volumes", "moments")
        )
        assert found.compliance[:, k] == pytest.approx(volumes, rel=1e-6, abs=1e-3)
        assert -found.coupling[k] == pytest.approx(moments, rel=1e-6, abs=1e-6)


def test_history_can_be_kept_and_forgotten(reference):
    wall = RelaxingFinger(reference, ONE_TERM)
    angles, pressures = np.full(12, 0.03), np.array([0.01, -0.02])
    wall.commit(angles, pressures, 0.1)
    kept = wall.memory()
    after = wall.commit(2 * angles, pressures, 0.1).moments
    wall.recall(kept)
    assert wall.commit(2 * angles, pressures, 0.1).moments == pytest.approx(after, rel=1e-14)
    wall.settle(angles, pressures)
    assert wall.respond(angles, pressures, 0.1).moments == pytest.approx(
        reference.respond(angles, pressures).moments, abs=1e-12
    )


def test_without_terms_the_wall_is_elastic(reference):
    wall = RelaxingFinger(reference, NO_RELAXATION)
    angles, pressures = np.full(12, 0.03), np.array([0.01, -0.02])
    wall.commit(3 * angles, pressures, 0.1)
    assert wall.respond(angles, pressures, 0.1).moments == pytest.approx(
        reference.respond(angles, pressures).moments, rel=1e-14
    )


@pytest.mark.parametrize(
    ("strengths", "times", "told"),
    [
        ((1.0,), (1.0, 2.0), "1 Prony strengths and 2 times"),
        ((-1.0,), (1.0,), "negative"),
        ((1.0,), (0.0,), "positive"),
    ],
)
def test_impossible_series_are_refused(strengths, times, told):
    with pytest.raises(ConfigError, match=told):
        Prony(strengths, times)


def test_a_step_without_duration_is_refused(reference):
    with pytest.raises(ConfigError, match="longer than zero"):
        RelaxingFinger(reference, ONE_TERM).respond(np.zeros(12), np.zeros(2), 0.0)


def test_the_shift_with_temperature_follows_from_the_published_moduli():
    """E'(1 Hz) at 25 and 30 degC equals E' at 20 degC of a lower frequency, by the shift per kelvin."""
    table = resources.files("tubefoot.design") / "data" / "agilus30_dma_20C.csv"
    rows = [line.split(",") for line in table.read_text(encoding="utf-8").splitlines()[1:]]
    frequency, storage = np.array([[float(row[0]), float(row[1])] for row in rows])[::-1].T
    at_20, at_25, at_30 = np.interp(np.log([13.4, 6.4, 3.7]), np.log(storage), np.log10(frequency))
    assert (at_20 - at_25) / 5 == pytest.approx(DECADES_PER_K, abs=0.01)
    assert (at_20 - at_30) / 10 == pytest.approx(DECADES_PER_K, abs=0.01)


def test_a_warmer_wall_is_the_same_wall_in_less_time():
    cold = reference_file().to_prony(MEASURED_C)
    room = reference_file().to_prony()
    assert cold.times_s == reference_file().relaxation.time_s
    share = 10 ** (DECADES_PER_K * (ROOM_C - MEASURED_C))
    for time in (0.0, 0.1, 3.0):
        assert room.modulus(time) == pytest.approx(cold.modulus(time * share), rel=1e-12)
    assert room.modulus(0.5) < 0.8 * cold.modulus(0.5)
