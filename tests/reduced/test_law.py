"""Everything follows from one energy: derivatives, reciprocity, symmetry, scale, continuation."""

import numpy as np
import pytest

from made_fingers import VALID, linear_finger, random_finger
from tubefoot.reduced.law import admissible_terms, derivatives_of_terms

STATES = [
    (np.array([0.03, -0.05, 0.11, 0.0, 0.19]), np.array([0.031, -0.044])),
    (np.array([-0.12, 0.02, 0.07, -0.19, 0.1]), np.array([-0.02, 0.045])),
    (np.zeros(5), np.zeros(2)),
]


def central(function, at, step):
    """Derivatives of an array-valued function by each component, first axis."""
    columns = []
    for k in range(len(at)):
        up, down = at.copy(), at.copy()
        up[k] += step
        down[k] -= step
        columns.append((np.asarray(function(up)) - np.asarray(function(down))) / (2 * step))
    return np.array(columns)


@pytest.mark.parametrize(("angles", "pressures"), STATES)
def test_moments_and_volumes_are_derivatives_of_the_energy(angles, pressures):
    finger = random_finger()
    found = finger.respond(angles, pressures)
    moments = central(lambda a: finger.respond(a, pressures).energy, angles, 1e-5)
    volumes = -central(lambda p: finger.respond(angles, p).energy, pressures, 1e-6)
    assert found.moments == pytest.approx(moments, rel=1e-7, abs=1e-6)
    assert found.volumes == pytest.approx(volumes, rel=1e-7, abs=1e-5)


@pytest.mark.parametrize(("angles", "pressures"), STATES)
def test_stiffness_compliance_coupling_are_second_derivatives(angles, pressures):
    finger = random_finger()
    found = finger.respond(angles, pressures)
    by_angle = central(lambda a: finger.respond(a, pressures).moments, angles, 1e-5)
    by_pressure = central(lambda p: finger.respond(angles, p).volumes, pressures, 1e-6)
    turned = central(lambda a: finger.respond(a, pressures).volumes, angles, 1e-5)
    assert np.diag(found.stiffness) == pytest.approx(by_angle, rel=1e-6, abs=1e-4)
    assert found.compliance == pytest.approx(by_pressure, rel=1e-6, abs=1e-2)
    assert found.coupling == pytest.approx(turned.T, rel=1e-6, abs=1e-4)


def test_reciprocity(reference):
    """dM/dp, by central differences of the moments, against -dV/dphi as it is answered."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        angles, pressures = rng.uniform(-0.1, 0.1, 12), rng.uniform(-0.05, 0.04, 2)
        found = reference.respond(angles, pressures)
        by_pressure = central(lambda p, a=angles: reference.respond(a, p).moments, pressures, 1e-6)
        scale = np.abs(found.coupling).max()
        assert np.abs(by_pressure + found.coupling).max() < 1e-7 * scale


def test_work_around_a_loop_is_zero(reference):
    """Of moments and fluids together, on a closed way in angles and pressures: no energy is made."""
    turn = np.linspace(0.0, 2 * np.pi, 4001)
    shape = np.linspace(0.5, 1.5, 12)
    ways = [
        (0.05 * shape * np.sin(t), np.array([0.02 * np.sin(t + 1.0), 0.03 * np.cos(t) - 0.03])) for t in turn
    ]
    found = [reference.respond(angles, pressures) for angles, pressures in ways]
    work = exchanged = 0.0
    for k in range(len(ways) - 1):
        moments = (found[k].moments + found[k + 1].moments) / 2
        pressures = (ways[k][1] + ways[k + 1][1]) / 2
        bent = float(moments @ (ways[k + 1][0] - ways[k][0]))
        filled = float(pressures @ (found[k + 1].volumes - found[k].volumes))
        work, exchanged = work + bent + filled, exchanged + abs(bent) + abs(filled)
    assert abs(work) < 1e-5 * exchanged


def test_mirror_image_has_mirrored_answers():
    finger = random_finger()
    angles, pressures = STATES[0]
    one, other = finger.respond(angles, pressures), finger.respond(-angles, pressures[::-1])
    assert other.moments == pytest.approx(-one.moments, rel=1e-12)
    assert other.volumes == pytest.approx(one.volumes[::-1], rel=1e-12)
    assert other.coupling == pytest.approx(-one.coupling[::-1], rel=1e-12)


def test_a_chain_is_the_sum_of_its_units_and_ends():
    finger = random_finger()
    angles, pressures = STATES[1]
    energy, moments = 0.0, np.zeros(5)
    for unit, angle in enumerate(angles):
        laws = [finger.inner] + [finger.base] * (unit == 0) + [finger.tip] * (unit == 4)
        for law in laws:
            psi, moment, _ = derivatives_of_terms(law.terms, angle, pressures)
            energy += float(psi @ law.coefficients)
            moments[unit] += float(moment @ law.coefficients)
    found = finger.respond(angles, pressures)
    assert found.energy == pytest.approx(energy, rel=1e-12)
    assert found.moments == pytest.approx(moments, rel=1e-12)


def test_linear_finger_has_its_closed_form():
    finger = linear_finger(bending=70.0, arm=90.0, own=2400.0)
    angles, pressures = np.array([0.01, 0.05, -0.02, 0.1]), np.array([0.03, -0.01])
    found = finger.respond(angles, pressures)
    assert found.moments == pytest.approx(70.0 * angles - 90.0 * 0.04, rel=1e-12)
    turned = 90.0 * angles.sum()
    assert found.volumes == pytest.approx([turned + 4 * 2400 * 0.03, -turned - 4 * 2400 * 0.01], rel=1e-12)


def test_stiffer_wall_scales_moments_and_pressures(reference):
    """The energy of g times the moduli at (phi, g p) is g times the energy at (phi, p)."""
    angles, pressures, g = np.linspace(0.01, 0.06, 12), np.array([0.02, -0.03]), 1.6
    soft, stiff = reference.respond(angles, pressures), reference.with_scale(g).respond(angles, g * pressures)
    assert stiff.energy == pytest.approx(g * soft.energy, rel=1e-12)
    assert stiff.moments == pytest.approx(g * soft.moments, rel=1e-9)
    assert stiff.volumes == pytest.approx(soft.volumes, rel=1e-12)
    moments = central(lambda a: reference.with_scale(g).respond(a, g * pressures).energy, angles, 1e-5)
    assert stiff.moments == pytest.approx(moments, rel=1e-6, abs=1e-6)


def test_beyond_the_range_forces_go_on_straight():
    finger = random_finger(n_units=1)
    edge, pressures = np.array([VALID.angle]), np.array([VALID.pressure_high, 0.01])
    at = finger.respond(edge, pressures)
    further = finger.respond(edge + 0.1, pressures + np.array([0.02, 0.0]))
    # The edge itself counts as inside; a hair further the continuation has taken over.
    just = finger.respond(edge + 1e-9, pressures + np.array([1e-10, 0.0]))
    assert just.moments == pytest.approx(at.moments, rel=1e-6)
    assert just.volumes == pytest.approx(at.volumes, rel=1e-6)
    expected = at.moments + 0.1 * at.stiffness - 0.02 * at.coupling[0]
    assert further.moments == pytest.approx(expected, rel=1e-12)
    assert further.volumes == pytest.approx(
        at.volumes + 0.1 * at.coupling[:, 0] + 0.02 * at.compliance[0], rel=1e-12
    )


def test_terms_are_those_that_symmetry_and_rest_allow():
    terms = admissible_terms(3, 2)
    assert set(terms) == {
        (0, 0, 2), (0, 0, 3), (0, 2, 0), (0, 2, 1), (1, 1, 0), (1, 1, 1), (2, 0, 0), (2, 0, 1),
    }  # fmt: skip
