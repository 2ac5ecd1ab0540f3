"""First contact and the force after it, against a finger of known statics."""

import numpy as np
import pytest

from tubefoot.control.first_contact import ContactSense, Pause, grip_lever
from tubefoot.control.grasp_settings import ContactSettings
from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG, KPA

FINGER = reference_file().to_finger()
HEIGHT = 66.0


def resting(volume: float, force: float) -> Pause:
    """The finger at rest with a pumped volume [mm^3] and a force outward at HEIGHT [N]."""
    middles = FINGER.cap + FINGER.pitch * (np.arange(12) + 0.5)
    moments = -force * np.maximum(HEIGHT - middles, 0.0)
    state = FINGER.equilibrium(np.array([volume, -volume]), moments=moments)
    lower, upper = float(state.angles[:6].sum()), float(state.angles[6:].sum())
    return Pause(lower, upper, state.bend, float(state.pressures[0] - state.pressures[1]))


def closing(forces: list[float]) -> tuple[ContactSense, list[bool]]:
    """A sense after pulses of 60 mm^3 from -600 mm^3 on, with a force in each pause."""
    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    return sense, [sense.observe(resting(-600.0 + 60.0 * n, force)) for n, force in enumerate(forces)]


def test_free_finger_never_touches() -> None:
    assert not any(closing([0.0] * 20)[1])


def test_contact_is_found_within_a_pulse() -> None:
    _, found = closing([0.0] * 8 + [0.01, 0.02, 0.03])
    assert found.index(True) in (8, 9)


@pytest.mark.parametrize("force", [0.02, 0.05, 0.1])
def test_force_is_that_of_the_statics(force: float) -> None:
    """Within 15 %: the law is not linear, and pressures couple to the force through the volumes."""
    sense, _ = closing([0.0] * 8 + [0.01, 0.02])
    assert sense.touching
    assert sense.force(resting(0.0, force)) == pytest.approx(force, rel=0.15)


def test_stiffness_of_the_print_drops_out() -> None:
    """A wall of twice the stiffness shows the same angles at twice pressures and force."""

    def doubled(volume: float, force: float) -> Pause:
        one = resting(volume, force / 2)
        return Pause(one.theta1, one.theta2, one.bend, 2 * one.pressure)

    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    for n, force in enumerate([0.0] * 8 + [0.02, 0.04]):
        sense.observe(doubled(-600.0 + 60.0 * n, force))
    assert sense.force(doubled(0.0, 0.1)) == pytest.approx(0.1, rel=0.15)


def test_the_shape_alone_makes_contact_sure() -> None:
    """The lower half stands, yet the bend goes on as the pressures say; other way round nothing is sure."""
    for halves, found in ((0.0, 3.0), True), ((1.5, 1.5), False):
        sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
        for n in range(6):
            sense.observe(Pause((n - 9) * 1.5 * DEG, (n - 9) * 1.5 * DEG, (n - 9) * 3 * DEG, n * 10 * KPA))
        one, other = (-6 * DEG + half * DEG for half in halves)
        assert sense.observe(Pause(one, other, -9 * DEG, 60 * KPA)) == found


def test_creep_at_a_constant_force_tells_the_same_force() -> None:
    """Angles of a wall that has relaxed by two fifths so far, then by four: what it bears stays."""

    def crept(volume: float, force: float, share: float) -> Pause:
        one = resting(volume, force)
        turns = share * one.theta1, share * one.theta2
        return Pause(turns[0], turns[1], sum(turns), one.pressure, (one.theta1, one.theta2))

    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    for n, force in enumerate([0.0] * 8 + [0.02, 0.04]):
        sense.observe(crept(-600.0 + 60.0 * n, force, 0.4))
    assert sense.touching
    assert sense.force(crept(0.0, 0.05, 0.4)) == pytest.approx(0.05, rel=0.15)
    assert sense.force(crept(0.0, 0.05, 0.8)) == pytest.approx(sense.force(crept(0.0, 0.05, 0.4)))


def test_contact_before_anything_is_learnt_still_tells_a_force() -> None:
    """Touching from the first pulse on, as after bad placement: within a factor of three, so that no grip
    runs on."""
    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    for n in range(6):
        sense.observe(resting(-600.0 + 60.0 * n, 0.01 * n))
    assert sense.touching
    assert 0.05 / 3 < sense.force(resting(-300.0, 0.05)) < 0.05 * 3


def test_lost_markers_report_nothing() -> None:
    """Without theta1 and theta2 nothing is reported from nothing, and nothing raised."""
    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    nan = float("nan")
    for n in range(6):
        assert not sense.observe(Pause(nan, nan, (n - 6) * 3 * DEG, n * 10 * KPA))


def test_contact_is_found_after_a_pause_with_lost_markers() -> None:
    """What free bending is like stays known, and the next pause is compared with the last one seen."""
    nan = float("nan")
    sense = ContactSense(ContactSettings(), grip_lever(FINGER, HEIGHT))
    for n, force in enumerate([0.0] * 8 + [0.01, 0.02, 0.03]):
        pause = resting(-600.0 + 60.0 * n, force)
        sense.observe(Pause(nan, nan, pause.bend, pause.pressure) if n in (5, 7) else pause)
    assert sense.touching
    assert sense.force(resting(0.0, 0.05)) == pytest.approx(0.05, rel=0.2)
