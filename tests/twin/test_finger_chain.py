"""The finger in MuJoCo against the law it carries, a continuum rod, and the NumPy wall."""

from dataclasses import replace

import numpy as np
import pytest
from continuum_rod import rod_shape

from made_fingers import linear_finger
from tubefoot.errors import ConvergenceError
from tubefoot.reduced.chain import FingerRange
from tubefoot.reduced.files import reference_file, reference_finger
from tubefoot.reduced.relaxation import NO_RELAXATION, RelaxingFinger
from tubefoot.twin.compiled_wall import CompiledWall
from tubefoot.twin.finger import SimulatedFinger
from tubefoot.twin.finger_body import Mounting
from tubefoot.units import DEG, STANDARD_GRAVITY

LEVEL = Mounting(gravity=False)


def settled(simulated, right=0.0, left=0.0, seconds=2.0):
    for _ in range(round(seconds / 1e-3)):
        simulated.advance(right, left, 1e-3)
    return simulated


@pytest.mark.parametrize("scale", [1.0, 0.6])
def test_compiled_wall_is_the_wall_of_the_reduced_finger(scale):
    """Random steps, some with pressures, then some with angles beyond the range: the same answers each."""
    finger, prony = reference_finger().with_scale(scale), reference_file().to_prony()
    plain, compiled = RelaxingFinger(finger, prony), CompiledWall(finger, prony)
    rng = np.random.default_rng(2)
    moments, stiffness = np.zeros(12), np.zeros(12)
    angles = np.zeros(12)
    for step in range(45):
        duration = (1e-3, 0.02)[step % 2]
        pressed, turned = ((0.04, 0.2), (3.0, 0.2), (0.04, 0.3))[step // 15]
        right, left = rng.uniform(-pressed, pressed, 2)
        compiled.prepare(angles, duration)
        answered = plain.respond(angles, np.array([right, left]), duration)
        volumes = compiled.volumes(right, left)
        assert volumes[:2] == pytest.approx(answered.volumes, rel=1e-9, abs=1e-9)
        compiled.commit(angles, right, left, moments, stiffness)
        found = plain.commit(angles, np.array([right, left]), duration)
        assert moments == pytest.approx(found.moments, rel=1e-9, abs=1e-9)
        assert stiffness == pytest.approx(found.stiffness, rel=1e-9)
        angles = rng.uniform(-turned, turned, 12)


def test_compiled_derivatives_are_central_differences():
    finger, prony = reference_finger(), reference_file().to_prony()
    wall = CompiledWall(finger, prony)
    wall.prepare(np.linspace(-0.02, 0.06, 12), 1e-3)
    right, left, h = 0.2, -0.3, 1e-5
    rr, rl, ll = wall.volumes(right, left)[2:]
    by_right = (np.array(wall.volumes(right + h, left)) - wall.volumes(right - h, left))[:2] / (2 * h)
    by_left = (np.array(wall.volumes(right, left + h)) - wall.volumes(right, left - h))[:2] / (2 * h)
    assert by_right == pytest.approx([rr, rl], rel=1e-6)
    assert by_left == pytest.approx([rl, ll], rel=1e-6)


def test_free_bending_ends_at_the_law_s_equilibrium():
    finger = reference_finger()
    simulated = settled(SimulatedFinger(finger, mounting=LEVEL), 0.02, -0.025)
    expected = finger.free_bending(np.array([0.02, -0.025]))
    assert simulated.bend == pytest.approx(expected.bend, abs=1e-6)
    assert simulated.unit_angles == pytest.approx(expected.angles, abs=1e-7)


def test_volumes_are_the_law_s_at_the_present_angles():
    finger = reference_finger()
    simulated = settled(SimulatedFinger(finger, mounting=LEVEL), 0.02, -0.025, seconds=0.1)
    expected = finger.respond(simulated.unit_angles, np.array([0.01, -0.03])).volumes
    assert simulated.volumes(0.01, -0.03, 1e-3)[:2] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("pressures", "tilt_deg", "tip_force"),
    [
        ((0.0, 0.0), 90.0, (0.0, 0.0)),
        ((0.015, -0.02), 60.0, (0.02, 0.0)),
        ((0.025, -0.03), 180.0, (-0.03, 0.02)),
        ((-0.02, 0.015), 0.0, (0.03, -0.05)),
        ((0.03, -0.04), 0.0, (0.0, 0.0)),
    ],
)
def test_chain_bends_like_a_continuum_rod(pressures, tilt_deg, tip_force):
    """The inner unit's law as a curvature law, gravity and a tip force: 12 hinges within 0.1 deg, 0.1 mm."""
    content = reference_file()
    ends = {name: _without_ends() for name in ("base", "tip")}
    plain = content.model_copy(update={**ends, "shear_compliance_mm_per_n": 0.0})
    finger = plain.to_finger()
    simulated = SimulatedFinger(finger, mounting=Mounting(tilt_deg=tilt_deg))
    simulated.tip_force = tip_force
    settled(simulated, *pressures, seconds=3.0)
    masses = (12 * finger.unit_mass, finger.cap_mass)
    gravity = (-STANDARD_GRAVITY * np.sin(tilt_deg * DEG), -STANDARD_GRAVITY * np.cos(tilt_deg * DEG))
    law = _curvature_law(finger, pressures)
    x, z, theta = rod_shape(law, finger.length, finger.cap, masses, gravity, tip_force)
    assert simulated.bend == pytest.approx(theta[-1], abs=0.1 * DEG)
    assert simulated.tip == pytest.approx((x[-1], z[-1]), abs=0.1)


def _without_ends():
    from tubefoot.reduced.files import LawTable

    return LawTable(exponents=((2, 0, 0),), coefficients_mj=(0.0,))


def _curvature_law(finger, pressures):
    """Curvature at given moments: the unit's moment-angle law inverted by a table."""
    angles = np.linspace(-0.2, 0.2, 2001)
    one = finger.with_units(3)
    moments = np.array([one.respond(np.full(3, a), np.array(pressures)).moments[1] for a in angles])
    return lambda wanted: np.interp(wanted, moments, angles) / finger.pitch


def test_shear_shifts_each_unit_by_its_compliance():
    """A small tip force on a straight finger: beside bending, n times force times compliance."""
    plain = linear_finger(bending=70.0, n_units=6)
    tips = []
    for finger in (plain, replace(plain, shear_compliance=0.9)):
        simulated = SimulatedFinger(finger, mounting=LEVEL)
        simulated.tip_force = (-1e-3, 0.0)
        tips.append(settled(simulated, seconds=1.0).tip[0])
    assert tips[1] - tips[0] == pytest.approx(-6 * 1e-3 * 0.9, rel=1e-3)


def test_longer_steps_end_at_the_same_place():
    finger = reference_finger()
    ends = []
    for duration in (1e-3, 0.25e-3):
        simulated = SimulatedFinger(finger, reference_file().to_prony(), time_step=duration)
        for _ in range(round(0.5 / duration)):
            simulated.advance(0.02, -0.025, duration)
        ends.append(simulated.bend)
    assert ends[0] == pytest.approx(ends[1], rel=5e-3)


def test_wall_creeps_under_held_pressure():
    """Half a second after a step of pressure the finger stands far short of its final bend."""
    finger, prony = reference_finger(), reference_file().to_prony()
    simulated = settled(SimulatedFinger(finger, prony, LEVEL), 0.02, -0.025, seconds=0.5)
    final = finger.free_bending(np.array([0.02, -0.025])).bend
    assert 1.0 / prony.modulus(0.0) < simulated.bend / final < 1.0 / prony.modulus(5.0)


def test_seam_stiffens_by_its_share():
    finger = linear_finger(n_units=12, valid=FingerRange(0.3, -0.1, 0.1))
    without = settled(SimulatedFinger(finger, mounting=LEVEL), 0.01, -0.01).bend
    with_seam = settled(SimulatedFinger(finger, mounting=LEVEL, seam=0.25), 0.01, -0.01).bend
    assert with_seam == pytest.approx(without / 1.25, rel=1e-5)


def test_softer_wall_bends_more_and_reset_begins_anew():
    simulated = SimulatedFinger(linear_finger(n_units=3), mounting=LEVEL)
    stiff = settled(simulated, 0.01, -0.01).bend
    simulated.reset()
    assert simulated.bend == 0.0
    simulated.scale_stiffness(0.5)
    assert settled(simulated, 0.01, -0.01).bend == pytest.approx(2 * stiff, rel=1e-5)


def test_the_same_steps_give_the_same_bits():
    ends = []
    for _ in range(2):
        simulated = SimulatedFinger(reference_finger(), reference_file().to_prony())
        ends.append(settled(simulated, 0.03, -0.04, seconds=0.2).unit_angles.tolist())
    assert ends[0] == ends[1]


def test_a_wild_finger_is_told():
    simulated = SimulatedFinger(reference_finger(), NO_RELAXATION)
    simulated.data.qpos[:] = 1e6
    with pytest.raises(ConvergenceError, match="unstable"):
        simulated.advance(0.0, 0.0, 1e-3)
