"""Stress against the finite element law and closed forms; stability against a turning point."""

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.fea.ogden import ogden_point
from tubefoot.study.ogden_conventions import from_convention, over_instantaneous, to_convention
from tubefoot.study.ogden_curves import (
    LATERAL,
    driven_stretch,
    drucker_stability,
    nominal_stress,
    stress_basis,
)

MU, ALPHA = np.array([0.2127, 0.0375, -0.001]), np.array([1.3212, 4.318, -1.0248])


def finite_element_stress(kind: str, deformation: float) -> float:
    """Nominal stress of the kernel of `fea`, its pressure taken off by the free direction."""
    if kind == "shear":
        gradient = np.array([[1.0, deformation, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    else:
        second = deformation ** (-0.5 if kind == "uniaxial" else 0.0 if kind == "planar" else 1.0)
        gradient = np.diag([deformation, second, 1.0 / deformation / second])
    stress, tangent = np.zeros((3, 3)), np.zeros((9, 9))
    ogden_point(gradient, MU, ALPHA, False, stress, tangent, np.zeros((7, 9)))
    if kind == "shear":
        return stress[0, 1]
    free = stress[2, 2] * gradient[2, 2]
    return stress[0, 0] - free / gradient[0, 0]


@pytest.mark.parametrize("kind", LATERAL)
@pytest.mark.parametrize("deformation", [0.6, 1.0, 1.9])
def test_stress_is_that_of_the_finite_elements(kind, deformation):
    found = nominal_stress(kind, [deformation], MU, ALPHA)[0]
    assert found == pytest.approx(finite_element_stress(kind, deformation), rel=1e-12, abs=1e-14)


def test_neo_hooke_has_its_closed_forms():
    stretch = np.array([0.7, 1.3, 2.0])
    assert nominal_stress("uniaxial", stretch, [0.3], [2.0]) == pytest.approx(0.3 * (stretch - stretch**-2))
    assert nominal_stress("shear", stretch, [0.3], [2.0]) == pytest.approx(0.3 * stretch)


def test_a_vanishing_exponent_is_the_limit():
    near, at = stress_basis("planar", [1.7], [1e-4]), stress_basis("planar", [1.7], [1e-9])
    assert at == pytest.approx(near, rel=1e-6)


def test_instability_is_where_the_true_stress_turns():
    mu, alpha = [0.3, -0.05], [2.0, -4.0]
    found = drucker_stability("equibiaxial", 0.8, 3.0, mu, alpha, points=4001)
    stretch = np.linspace(1.0, 3.0, 4001)
    true_stress = stretch * nominal_stress("equibiaxial", stretch, mu, alpha)
    turning = stretch[np.argmax(np.diff(true_stress) < 0)]
    assert not found.stable
    assert found.stable_high == pytest.approx(turning, abs=2e-3)
    assert found.stable_low <= 0.8
    assert drucker_stability("equibiaxial", 0.8, found.stable_high - 0.01, mu, alpha).stable


def test_the_margin_at_rest_is_one_and_positive_moduli_are_always_stable():
    assert drucker_stability("uniaxial", 1.0, 1.0 + 1e-9, MU, ALPHA).margin == pytest.approx(1.0, abs=1e-6)
    for kind in LATERAL:
        assert drucker_stability(kind, 0.2 if kind != "shear" else -5, 6.0, [0.2, 0.1], [-3.0, 5.0]).stable


@pytest.mark.parametrize(
    ("convention", "energy"), [("classic", lambda m, a: m / a), ("febio", lambda m, a: m / a**2)]
)
def test_other_conventions_have_the_same_energy(convention, energy):
    theirs = np.array(to_convention(MU, ALPHA, convention))
    assert energy(theirs, ALPHA) == pytest.approx(2 * MU / ALPHA**2)
    assert from_convention(theirs, ALPHA, convention) == pytest.approx(MU)


def test_instantaneous_shares_sum_below_one():
    assert over_instantaneous([3.0, 1.0]) == pytest.approx([0.6, 0.2])
    with pytest.raises(ConfigError, match="known: tubefoot"):
        to_convention(MU, ALPHA, "marc")


def test_shear_is_driven_by_its_larger_stretch():
    stretch = driven_stretch("shear", [0.0, 1.5])
    assert stretch - 1 / stretch == pytest.approx([0.0, 1.5])
