"""The material point against closed forms, NumPy's eigenvalues and central differences."""

import numpy as np
import pytest

from tubefoot.fea.ogden import ogden_point, principal_derivatives, symmetric_eigen

# Ogden's three terms for Treloar's rubber (Proc. R. Soc. A 326, 1972), in the form with 2 mu / alpha^2.
MU = np.array([0.63 * 1.3 / 2, 0.0012 * 5.0 / 2, 0.01 * 2.0 / 2])
ALPHA = np.array([1.3, 5.0, -2.0])


def point(f):
    """Energy, stress (3, 3) and tangent (9, 9)."""
    stress, tangent = np.empty((3, 3)), np.empty((9, 9))
    energy = ogden_point(np.ascontiguousarray(f), MU, ALPHA, True, stress, tangent, np.empty((7, 9)))
    return energy, stress, tangent


def energy_of(*stretches):
    scale = np.prod(stretches) ** (-1 / 3)
    powers = (scale * np.array(stretches)[:, None]) ** ALPHA
    return float(np.sum(2 * MU / ALPHA**2 * (powers.sum(axis=0) - 3)))


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def deviatoric_cauchy(f):
    _, stress, _ = point(f)
    cauchy = stress @ f.T / np.linalg.det(f)
    assert cauchy == pytest.approx(cauchy.T, abs=1e-13)
    return cauchy


def principal_difference(a, b):
    """sigma_a - sigma_b of an incompressible Ogden solid with principal stretches a and b."""
    return float(np.sum(2 * MU / ALPHA * (a**ALPHA - b**ALPHA)))


@pytest.mark.parametrize("stretch", [0.4, 0.9, 1.0, 1.3, 2.0, 5.0])
def test_uniaxial_tension(stretch):
    side = stretch**-0.5
    cauchy = deviatoric_cauchy(np.diag([stretch, side, side]))
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(
        principal_difference(stretch, side), rel=1e-8, abs=1e-13
    )
    assert point(np.diag([stretch, side, side]))[0] == pytest.approx(
        energy_of(stretch, side, side), rel=1e-8, abs=1e-15
    )


@pytest.mark.parametrize("stretch", [0.5, 0.95, 1.2, 2.5])
def test_equibiaxial_tension(stretch):
    cauchy = deviatoric_cauchy(rotation(4) @ np.diag([stretch, stretch, stretch**-2]) @ rotation(5))
    values = np.sort(np.linalg.eigvalsh(cauchy))
    expected = abs(principal_difference(stretch, stretch**-2))
    assert values[2] - values[0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("shear", [1e-3, 0.3, 1.0, 2.5])
def test_simple_shear(shear):
    f = np.eye(3)
    f[0, 1] = shear
    cauchy = deviatoric_cauchy(f)
    stretch = (shear + np.sqrt(shear**2 + 4)) / 2
    expected = principal_difference(stretch, 1 / stretch) / (stretch + 1 / stretch)
    assert cauchy[0, 1] == pytest.approx(expected, rel=1e-8)
    # Universal relation of every isotropic elastic solid.
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(shear * cauchy[0, 1], rel=1e-8)


def test_the_undeformed_state_is_free_of_stress_and_has_the_shear_modulus():
    energy, stress, tangent = point(np.eye(3))
    assert energy == pytest.approx(0.0, abs=1e-16)
    assert stress == pytest.approx(np.zeros((3, 3)), abs=1e-16)
    identity = np.eye(3)
    symmetric = np.einsum("ik,jl->ijkl", identity, identity) + np.einsum("il,jk->ijkl", identity, identity)
    deviatoric = symmetric / 2 - np.einsum("ij,kl->ijkl", identity, identity) / 3
    assert tangent == pytest.approx(2 * MU.sum() * deviatoric.reshape(9, 9), rel=1e-12, abs=1e-15)


DEFORMATIONS = {
    "general": np.diag([1.4, 0.8, 1.1]),
    "two equal stretches": np.diag([1.5, 0.9, 0.9]),
    "nearly equal, limit formula": np.diag([1.5, 0.9, 0.9 * (1 + 3e-6)]),
    "nearly equal, quotient": np.diag([1.5, 0.9, 0.9 * (1 + 1e-4)]),
    "half a percent apart": np.diag([1.5, 0.9, 0.9 * 1.005]),
    "three equal stretches": 1.2 * np.eye(3),
    "three nearly equal stretches": np.diag([1.0, 1 + 4e-6, 1 - 5e-6]),
    "undeformed": np.eye(3),
    "strong": np.diag([4.0, 0.3, 0.9]),
}


@pytest.mark.parametrize("name", DEFORMATIONS)
def test_stress_and_tangent_are_central_differences_of_the_energy(name):
    f = rotation(1) @ DEFORMATIONS[name] @ rotation(2)
    step = 1e-5
    stress, tangent = np.empty((3, 3)), np.empty((9, 9))
    for k in range(9):
        change = np.zeros(9)
        change[k] = step
        above, below = point(f + change.reshape(3, 3)), point(f - change.reshape(3, 3))
        stress[k // 3, k % 3] = (above[0] - below[0]) / (2 * step)
        tangent[:, k] = ((above[1] - below[1]) / (2 * step)).ravel()
    _, found_stress, found_tangent = point(f)
    scale = np.abs(found_tangent).max()
    assert np.abs(found_stress - stress).max() < 1e-8 * scale
    assert np.abs(found_tangent - tangent).max() < 1e-7 * scale
    assert found_tangent == pytest.approx(found_tangent.T, abs=1e-13 * scale)


def test_energy_is_objective_and_isotropic():
    f = rotation(8) @ np.diag([1.3, 0.7, 1.05]) @ rotation(9)
    energy, stress, _ = point(f)
    turned_energy, turned_stress, _ = point(rotation(3) @ f @ rotation(6))
    assert turned_energy == pytest.approx(energy, rel=1e-12)
    assert turned_stress == pytest.approx(rotation(3) @ stress @ rotation(6), rel=1e-10)
    assert point(2.0 * f)[0] == pytest.approx(energy, rel=1e-12), "the energy is isochoric"


def test_principal_derivatives_are_central_differences():
    stretch, step = np.array([1.3, 0.7, 1.1]), 1e-5
    first, second = np.empty(3), np.empty((3, 3))
    principal_derivatives(stretch, stretch.prod(), MU, ALPHA, first, second)
    for a in range(3):
        up, down = stretch.copy(), stretch.copy()
        up[a] += step
        down[a] -= step
        assert first[a] == pytest.approx((energy_of(*up) - energy_of(*down)) / (2 * step), rel=1e-8)
        slopes = []
        for moved in (up, down):
            slope = np.empty(3)
            principal_derivatives(moved, moved.prod(), MU, ALPHA, slope, np.empty((3, 3)))
            slopes.append(slope)
        assert second[a] == pytest.approx((slopes[0] - slopes[1]) / (2 * step), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("spread", [1.0, 1e-4, 1e-9, 0.0])
def test_eigenvalues_and_vectors_are_those_of_numpy(spread):
    rng = np.random.default_rng(11)
    for _ in range(50):
        turn, values = rotation(rng.integers(1000)), 1.0 + spread * rng.uniform(-0.9, 5.0, 3)
        matrix = turn @ np.diag(values) @ turn.T
        matrix = (matrix + matrix.T) / 2
        vectors, found = np.empty((3, 3)), np.empty(3)
        symmetric_eigen(matrix.copy(), vectors, found)
        assert np.sort(found) == pytest.approx(np.linalg.eigvalsh(matrix), rel=1e-13)
        assert vectors.T @ vectors == pytest.approx(np.eye(3), abs=1e-14)
        assert vectors @ np.diag(found) @ vectors.T == pytest.approx(matrix, abs=1e-13)
