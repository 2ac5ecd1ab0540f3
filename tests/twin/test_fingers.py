"""Fingers between the chambers: closed forms, the reduced law at rest and in creep, prints, seams."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tubefoot.reduced.files import reference_file, reference_finger
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE, UnitLaw
from tubefoot.reduced.relaxation import NO_RELAXATION, Prony
from tubefoot.twin import still_finger
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.bench_settings import FingerMake
from tubefoot.twin.finger import Mounting, SimulatedFinger
from tubefoot.twin.finger_response import LinearFinger
from tubefoot.twin.fingers import finger_of
from tubefoot.twin.plant import PumpDrive
from tubefoot.twin.still_finger import StillFinger
from tubefoot.units import DEG, KPA

UNITS = 12


def linear_law() -> ReducedFinger:
    """The linear finger as a reduced law: Psi = K phi^2 / 2 - A phi (p_R - p_L) - c (p_R^2 + p_L^2) / 2."""
    gain, partition, own = 0.85 * DEG / KPA, 1.5e4, 2e4 / UNITS
    bending, arm = partition / gain**2 * UNITS, partition / gain
    terms = ((2, 0, 0), (1, 1, 0), (0, 2, 0), (0, 0, 2))
    scales = (ANGLE_SCALE**2, ANGLE_SCALE * PRESSURE_SCALE, PRESSURE_SCALE**2, PRESSURE_SCALE**2)
    factors = (bending / 2, -arm, -own / 4, -own / 4)
    law = UnitLaw(terms, tuple(f * s for f, s in zip(factors, scales, strict=True)))
    none = UnitLaw(((2, 0, 0),), (0.0,))
    reference = reference_finger()
    return replace(reference, n_units=UNITS, inner=law, base=none, tip=none)


def follow(finger, right, left, seconds, step=1e-3):
    for _ in range(round(seconds / step)):
        finger.volumes(right, left, step)
        finger.advance(right, left, step)
    return finger


def test_a_linear_law_gives_the_linear_finger():
    still, linear = StillFinger(linear_law(), NO_RELAXATION), LinearFinger()
    for finger in (still, linear):
        follow(finger, 0.02, -0.015, 0.05)
    assert still.bend == pytest.approx(linear.bend, rel=1e-9)
    np.testing.assert_allclose(still.unit_angles, linear.unit_angles, rtol=1e-9)
    np.testing.assert_allclose(still.volumes(0.03, -0.01, 1e-3), linear.volumes(0.03, -0.01, 1e-3), rtol=1e-9)


def test_volumes_have_the_stated_derivatives():
    finger = follow(LinearFinger(memory=((0.5, 0.1),)), 0.01, -0.02, 0.1)
    _, _, rr, rl, ll = finger.volumes(0.01, -0.02, 1e-3)
    up, down = finger.volumes(0.011, -0.02, 1e-3), finger.volumes(0.009, -0.02, 1e-3)
    assert (up[0] - down[0]) / 2e-3 == pytest.approx(rr, rel=1e-9)
    assert (up[1] - down[1]) / 2e-3 == pytest.approx(rl, rel=1e-9)
    up, down = finger.volumes(0.01, -0.019, 1e-3), finger.volumes(0.01, -0.021, 1e-3)
    assert (up[0] - down[0]) / 2e-3 == pytest.approx(rl, rel=1e-9)
    assert (up[1] - down[1]) / 2e-3 == pytest.approx(ll, rel=1e-9)


def test_the_linear_finger_creeps_to_its_equilibrium():
    """One Maxwell term: the angle starts at 1 / (1 + g) of its end and gets there with tau (1 + g)."""
    g, tau, end = 0.5, 0.1, 0.85 * DEG / KPA * 0.03
    finger = LinearFinger(memory=((g, tau),))
    follow(finger, 0.015, -0.015, 1e-5, step=1e-5)
    assert finger.bend == pytest.approx(end / (1 + g), rel=1e-3)
    follow(finger, 0.015, -0.015, tau * (1 + g), step=1e-4)
    assert finger.bend == pytest.approx(end * (1 - g / (1 + g) * np.exp(-1)), rel=1e-3)


def test_at_rest_it_is_the_reduced_finger_in_free_bending():
    law = reference_finger()
    pressures = np.array([25.0, -30.0]) * KPA
    finger = follow(StillFinger(law, NO_RELAXATION), *pressures, 0.1)
    rest = law.free_bending(pressures)
    assert finger.bend == pytest.approx(rest.bend, rel=1e-6)
    np.testing.assert_allclose(finger.volumes(*pressures, 1e-3)[:2], rest.volumes, rtol=1e-6)


def test_a_stiffer_print_needs_as_much_more_pressure_and_a_warm_one_less():
    soft = follow(finger_of(FingerMake(law="still", creep=False)), 15 * KPA, -15 * KPA, 0.05)
    stiff = follow(
        finger_of(FingerMake(law="still", creep=False, stiffness=1.7)), 25.5 * KPA, -25.5 * KPA, 0.05
    )
    assert stiff.bend == pytest.approx(soft.bend, rel=1e-6)
    cold = soft.bend
    soft.scale_stiffness(0.8)
    assert follow(soft, 12 * KPA, -12 * KPA, 0.05).bend == pytest.approx(cold, rel=1e-6)


@pytest.mark.parametrize("law", ["still", "chain"])
def test_a_seam_is_a_share_of_the_print_s_own_stiffness(law):
    """So a print of 1.7 times the moduli bends as far at 1.7 times the pressures, seam and all."""
    ends = []
    for stiffness in (1.0, 1.7):
        make = FingerMake(law=law, creep=False, stiffness=stiffness, seam_stiffening=0.5, units=3, tilt_deg=0)
        finger = follow(finger_of(make), stiffness * 10 * KPA, -stiffness * 10 * KPA, 0.3)
        ends.append(finger.bend)
    # The chain has weight: some thousandths of the angle.
    assert ends[1] == pytest.approx(ends[0], rel=1e-6 if law == "still" else 0.02)


def test_a_seam_costs_angle():
    """Volumes and angles of a seam of the unit's own bending stiffness: less than half the angle is lost."""
    plain = follow(finger_of(FingerMake(law="still", creep=False)), 10 * KPA, -10 * KPA, 0.05).bend
    seamed = follow(
        finger_of(FingerMake(law="still", creep=False, seam_stiffening=0.15)), 10 * KPA, -10 * KPA, 0.05
    ).bend
    assert seamed == pytest.approx(plain / 1.15, rel=0.03)


def test_intervals_are_short_enough(monkeypatch):
    """A pulse and its creep: asking the law every millisecond instead hardly changes the angle."""
    traces = []
    for short, long in ((10e-3, 20e-3), (1e-3, 1e-3)):
        monkeypatch.setattr(still_finger, "SHORT_S", short)
        monkeypatch.setattr(still_finger, "LONG_S", long)
        finger = finger_of(FingerMake(law="still"))
        trace = []
        for step in range(1500):
            pressure = 30 * KPA * min(step / 300, 1.0)
            finger.advance(pressure, -0.8 * pressure, 1e-3)
            if step % 20 == 19:
                trace.append(finger.bend / DEG)
        traces.append(np.array(trace))
    assert traces[0].max() > 5
    assert np.abs(traces[0] - traces[1]).max() < 0.1
    assert np.abs(traces[0] - traces[1])[20:].max() < 0.03


def test_memory_makes_the_finger_stiff_at_first():
    elastic = follow(finger_of(FingerMake(law="still", creep=False)), 20 * KPA, -20 * KPA, 0.02).bend
    slow = finger_of(FingerMake(law="still"))
    follow(slow, 20 * KPA, -20 * KPA, 0.02)
    first = slow.bend
    instant = 1.0 + sum(Prony(*_terms()).strengths)
    assert elastic / instant < first < 0.3 * elastic
    follow(slow, 20 * KPA, -20 * KPA, 5.0, step=5e-3)
    assert first < slow.bend < elastic


def test_still_finger_and_weightless_chain_agree_in_the_whole_loop():
    """Two implementations, NumPy in equilibrium and MuJoCo with inertia and a dashpot, through two pulses.

    The dashpot (0.03 s of the stiffness at once, twenty times that at rest) lets the creeping angle lag.
    """
    law, memory = reference_file().to_finger(), reference_file().to_prony()
    ends = []
    for finger in (StillFinger(law, memory), SimulatedFinger(law, memory, Mounting(gravity=False))):
        plant = BenchPlant(finger=finger, seed=1)
        for on in (1, 0, 1, 0):
            for _ in range(200 if on else 600):
                plant.step(1e-3, PumpDrive(on, 0.6 * on))
        truth = plant.truth()
        ends.append((truth.bend / DEG, *np.array(truth.branch_pressures) / KPA, *truth.column_levels))
    assert ends[0][0] > 3
    np.testing.assert_allclose(ends[0][1:], ends[1][1:], rtol=0.01)
    assert 0 < ends[0][0] - ends[1][0] < 0.5


def _terms():
    prony = reference_file().to_prony()
    return prony.strengths, prony.times_s
