"""The film: its derivatives, its stiffness in tension and shear, and that the seam of a design is used."""

import numpy as np
import pytest
from probe import DenseSink

from mapped_box import mapped_box, plane
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.film import Film
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.path import follow
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.stride import StepControl
from tubefoot.fea.traction import Traction

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


@pytest.mark.parametrize("film_modulus", [0.0, 40.0, 400.0])
def test_bending_stiffness_of_a_bonded_beam(film_modulus):
    """A beam with a film on one face under pure bending against the composite section.

    Plane sections: the neutral axis lies where the stiffnesses balance, and
    EI = E b h^3 / 12 + E b h d^2 + Ef t b (h / 2 - d)^2, d = Ef t (h / 2) / (E h + Ef t) towards the film.
    """
    width, height, length, modulus, poisson = 1.0, 2.0, 16.0, 10.0, 0.3
    stress = 1e-4
    mesh = mapped_box(
        "hexahedron27",
        (1, 2, 12),
        lambda p: p * [width, height, length],
        places={
            "film": plane(1, 0.0),
            "side": plane(0, 0.0),
            "start": plane(2, 0.0),
            "pulled": lambda p: (np.abs(p[:, 2] - length) < 1e-9) & (p[:, 1] < height / 2 + 1e-9),
            "pushed": lambda p: (np.abs(p[:, 2] - length) < 1e-9) & (p[:, 1] > height / 2 - 1e-9),
        },
    )
    solid = Solid(mesh, {"*": OgdenLaw.elastic(modulus, poisson)}, pressure="none")
    loads = [Traction(mesh, "pulled", (0, 0, stress)), Traction(mesh, "pushed", (0, 0, -stress))]
    film = [Film(mesh, "film", THICKNESS, film_modulus, poisson)] if film_modulus else []
    corner = np.flatnonzero((np.abs(mesh.points) < 1e-9).all(axis=1))
    held = {0: mesh.facet_set("side").points, 1: corner, 2: mesh.facet_set("start").points}
    model = Model(mesh, [solid], held, others=[*loads, *film])
    state = model.solve(model.rest(), Control("parameter", 1.0)).state
    middle = np.flatnonzero(
        (np.abs(mesh.points[:, 0]) < 1e-9) & (np.abs(mesh.points[:, 1] - height / 2) < 1e-9)
    )
    middle = middle[np.argsort(mesh.points[middle, 2])]
    z, rise = mesh.points[middle, 2], state.unknowns[3 * middle + 1]
    low, mid, high = (np.interp(length * share, z, rise) for share in (0.25, 0.5, 0.75))
    curvature = (low - 2 * mid + high) / (length / 4) ** 2
    moment = stress * width * height**2 / 4
    film_force = film_modulus * THICKNESS
    shift = film_force * (height / 2) / (modulus * height + film_force)
    stiffness = width * (
        modulus * height**3 / 12 + modulus * height * shift**2 + film_force * (height / 2 - shift) ** 2
    )
    assert curvature == pytest.approx(moment / stiffness, rel=1e-4)
