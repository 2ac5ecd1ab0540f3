"""The film: its derivatives, its stiffness in tension and shear, and that the seam of a design is used."""

import numpy as np
import pytest
from probe import DenseSink

from mapped_box import mapped_box
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.film import Film
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.path import StepControl, follow

THICKNESS, YOUNG, POISSON = 0.2, 50.0, 0.4


def assembled(film, mesh, displacement):
    sink, found = DenseSink(mesh.points.size), Evaluation()
    film.assemble(State(displacement.ravel(), np.zeros(0), 0.0), sink, found)
    return found.energy, sink.residual, sink.matrix


@pytest.mark.parametrize("kind", ["hexahedron27", "tetra10"])
def test_forces_and_stiffness_are_central_differences(kind):
    mesh = mapped_box(kind, (1, 1, 1), lambda p: p * [2.0, 1.0, 3.0] + 0.1 * p[:, [1, 2, 0]] ** 2)
    film = Film(mesh, "y_min", THICKNESS, YOUNG, POISSON)
    rng = np.random.default_rng(1)
    u = 0.1 * rng.normal(size=mesh.points.size)
    way = rng.normal(size=u.size)
    h = 1e-5
    plus, minus = assembled(film, mesh, u + h * way), assembled(film, mesh, u - h * way)
    _, residual, matrix = assembled(film, mesh, u)
    assert residual @ way == pytest.approx((plus[0] - minus[0]) / (2 * h), rel=1e-7)
    slope = (plus[1] - minus[1]) / (2 * h)
    assert np.abs(matrix @ way - slope).max() <= 1e-7 * np.abs(slope).max()
    assert np.allclose(matrix, matrix.T, rtol=0, atol=1e-12 * np.abs(matrix).max())


@pytest.mark.parametrize(
    ("gradient", "density"),
    [
        # Uniaxial strain: E / (1 - nu^2) e^2 / 2; shear angle g: E / (2 (1 + nu)) g^2 / 2.
        ([[1e-4, 0, 0], [0, 0, 0], [0, 0, 0]], YOUNG / (1 - POISSON**2) * 1e-8 / 2),
        ([[0, 0, 1e-4], [0, 0, 0], [0, 0, 0]], YOUNG / (2 * (1 + POISSON)) * 1e-8 / 2),
        ([[1e-4, 0, 0], [0, 0, 0], [0, 0, 1e-4]], YOUNG / (1 - POISSON) * 1e-8),
    ],
)
def test_energy_of_uniform_small_strain(gradient, density):
    mesh = mapped_box("hexahedron27", (2, 1, 2), lambda p: p * [2.0, 1.0, 3.0])
    film = Film(mesh, "y_min", THICKNESS, YOUNG, POISSON)
    energy, _, _ = assembled(film, mesh, mesh.points @ np.array(gradient).T)
    assert energy == pytest.approx(THICKNESS * 6.0 * density, rel=3e-4)


def test_rigid_motion_costs_nothing():
    mesh = mapped_box("hexahedron27", (1, 1, 1))
    film = Film(mesh, "y_min", THICKNESS, YOUNG, POISSON)
    angle = 1.1
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    energy, residual, _ = assembled(film, mesh, mesh.points @ (turn - np.eye(3)).T + [1.0, 2.0, 3.0])
    assert energy == pytest.approx(0.0, abs=1e-20)
    assert np.abs(residual).max() < 1e-13


def test_the_seam_of_a_design_stiffens_the_finger():
    settings = SolveSettings(element_size_mm=3.5, target=10.0, states=2)
    angles = {}
    for modulus in (0.0, 20.0, 200.0):
        finger = FingerDesign(
            bellows=FingerDesign().with_bellows(units=1).bellows,
            seam={"thickness_mm": 0.15, "modulus_mpa": modulus},
        )
        model = build_finger(finger, settings)
        last = follow(model.model, model.goal, stepping=StepControl(states=2)).steps[-1]
        angles[modulus] = model.tip(last.state.unknowns)[0]
    assert angles[0.0] > angles[20.0] > angles[200.0] > 0
