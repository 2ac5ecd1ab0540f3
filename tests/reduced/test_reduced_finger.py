"""Equilibria: balanced moments, kept fluid, the pump's way there and back, and errors that say what to do."""

import numpy as np
import pytest

from made_fingers import linear_finger
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.units import ATMOSPHERE_MPA, DEG, KPA, ML


@pytest.mark.parametrize("air", [(0.0, 0.0), (1.0 * ML, 1.5 * ML)])
@pytest.mark.parametrize("pumped", [-0.6 * ML, 0.2 * ML, 0.9 * ML])
def test_fluid_is_kept_and_moments_balance(reference, pumped, air):
    state = reference.equilibrium(np.array([pumped, -pumped]), air)
    found = reference.respond(state.angles, state.pressures)
    shrunk = np.array(air) * state.pressures / (ATMOSPHERE_MPA + state.pressures)
    assert found.volumes + shrunk == pytest.approx([pumped, -pumped], rel=1e-9)
    assert np.abs(found.moments).max() < 1e-6
    assert np.sign(state.bend) == np.sign(pumped)


def test_reversing_the_pump_mirrors_the_finger(reference):
    one = reference.equilibrium(np.array([400.0, -400.0]))
    other = reference.equilibrium(np.array([-400.0, 400.0]))
    assert other.angles == pytest.approx(-one.angles, abs=1e-10)
    assert other.pressures == pytest.approx(one.pressures[::-1], abs=1e-10)


def test_linear_finger_bends_by_its_closed_form():
    """phi = a d / K; V = +-a n phi + n c p, so d = q / (n (a^2 / K + c / 2)) with opposite volumes."""
    finger = linear_finger(bending=70.0, arm=90.0, own=2400.0, n_units=4)
    state = finger.equilibrium(np.array([200.0, -200.0]))
    difference = 200.0 / (4 * (90.0**2 / 70.0 + 2400.0 / 2))
    assert state.pressures == pytest.approx([difference / 2, -difference / 2], rel=1e-9)
    assert state.angles == pytest.approx(np.full(4, 90.0 * difference / 70.0), rel=1e-9)


def test_outside_moments_turn_each_unit():
    finger = linear_finger(bending=70.0)
    state = finger.free_bending(np.zeros(2), moments=np.array([7.0, 0.0, -3.5, 1.4]))
    assert state.angles == pytest.approx([0.1, 0.0, -0.05, 0.02], rel=1e-9)


def test_air_takes_up_part_of_what_is_pumped(reference):
    without = reference.equilibrium(np.array([500.0, -500.0]))
    with_air = reference.equilibrium(np.array([500.0, -500.0]), (1000.0, 1000.0))
    assert with_air.bend < without.bend
    # Air on the suction side gives more than it takes on the other: the left pressure suffers most.
    assert -with_air.pressures[1] < -without.pressures[1]


@pytest.mark.parametrize("bend_deg", [-45.0, 3.0, 30.0, 60.0])
def test_pumped_volume_is_the_inverse(reference, bend_deg):
    air = (0.8 * ML, 1.2 * ML)
    volume = reference.pumped_volume_for(bend_deg * DEG, air)
    assert reference.equilibrium(np.array([volume, -volume]), air).bend == pytest.approx(
        bend_deg * DEG, abs=1e-8
    )


def test_more_units_bend_more_by_what_an_inner_unit_adds(reference):
    pressures = np.array([20.0, -26.0]) * KPA
    bends = [reference.with_units(n).free_bending(pressures).bend for n in (4, 5, 12)]
    inner = reference.free_bending(pressures).angles[5]
    assert bends[1] - bends[0] == pytest.approx(inner, rel=1e-9)
    assert bends[2] - bends[0] == pytest.approx(8 * inner, rel=1e-9)


def test_suction_below_vacuum_is_refused(reference):
    with pytest.raises(
        ConvergenceError, match=r"no equilibrium .* 0 ml filled right and -6 ml left.*pump less"
    ):
        reference.equilibrium(np.array([0.0, -6.0 * ML]))


def test_range_is_told_with_values_and_limits(reference):
    reference.check_range(np.full(12, 0.05), np.array([0.03, -0.05]))
    with pytest.raises(ConfigError, match=r"17\.19 deg is outside of the 13\.\d+ deg"):
        reference.check_range(np.full(12, 0.3), np.zeros(2))
    with pytest.raises(ConfigError, match=r"left pressure -90\.00 kPa is outside of -77\.\d+ to 46\.\d+ kPa"):
        reference.check_range(np.zeros(12), np.array([0.0, -0.09]))
    # A stiffer print bears more.
    reference.with_scale(1.7).check_range(np.zeros(12), np.array([0.0, -0.09]))


def test_impossible_wishes_are_refused(reference):
    with pytest.raises(ConfigError, match=r"200\.0 deg is outside of the 16\d\.\d deg"):
        reference.pumped_volume_for(200 * DEG)
    with pytest.raises(ConfigError, match="1 to 48 units, not 0"):
        reference.with_units(0)
    with pytest.raises(ConfigError, match=r"stiffness scale 0\.01"):
        reference.with_scale(0.01)
