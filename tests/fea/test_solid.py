"""The solid item: tangent, energy, rigid motion, patch test, one-element closed forms, locking spaces."""

import numpy as np
import pytest
from probe import DenseSink, settled

from mapped_box import mapped_box, outer_faces, symmetry
from tubefoot.errors import ConfigError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import StepFailed, Tolerance
from tubefoot.fea.traction import Traction

RUBBER = OgdenLaw((0.63 * 1.3 / 2, 0.0012 * 5 / 2, 0.01), (1.3, 5.0, -2.0), 50.0)
NO_FLUID = np.zeros(0)

ELEMENTS = [
    ("hexahedron27", "linear"),
    ("hexahedron27", "constant"),
    ("hexahedron27", "continuous"),
    ("hexahedron27", "none"),
    ("hexahedron20", "continuous"),
    ("hexahedron20", "constant"),
    ("hexahedron20", "none"),
    ("hexahedron8", "constant"),
    ("tetra10", "continuous"),
    ("tetra10", "constant"),
    ("tetra10", "none"),
]


def distorted(amount, seed=0):
    """Mapping that moves every point of the unit cube at random and shears the whole."""

    def mapping(points):
        moved = points + np.random.default_rng(seed).uniform(-amount, amount, points.shape)
        return moved @ np.array([[2.0, 0.3, 0.0], [0.0, 1.5, 0.2], [0.1, 0.0, 1.0]])

    return mapping


def solid_of(kind, pressure, divisions=(1, 1, 1), amount=0.03, law=RUBBER):
    mesh = mapped_box(kind, divisions, distorted(amount))
    solid = Solid(mesh, {"*": law}, pressure=pressure)
    return mesh, solid, mesh.points.size + solid.n_own


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def random_state(mesh, size, amount=0.05):
    unknowns = np.zeros(size)
    unknowns[: mesh.points.size] = np.random.default_rng(7).uniform(-amount, amount, mesh.points.size)
    return unknowns


@pytest.mark.parametrize(("kind", "pressure"), ELEMENTS)
def test_tangent_and_residual_are_central_differences_with_interior_unknowns_eliminated(kind, pressure):
    mesh, solid, size = solid_of(kind, pressure)
    start, sink, _ = settled(solid, random_state(mesh, size))
    kept = np.setdiff1d(np.unique(solid.pattern), solid.eliminated)
    step = 1e-5
    for j in kept[:: max(1, len(kept) // 12)]:
        sides = []
        for sign in (1, -1):
            moved = start.copy()
            moved[j] += sign * step
            sides.append(settled(solid, moved)[1:])
        (above, energy_above), (below, energy_below) = sides
        slope = (above.residual - below.residual)[kept] / (2 * step)
        assert np.abs(sink.matrix[kept, j] - slope).max() < 1e-7 * np.abs(sink.matrix).max()
        force = (energy_above.energy - energy_below.energy) / (2 * step)
        assert abs(sink.residual[j] - force) < 1e-6 * np.abs(sink.residual).max()
    assert np.abs(sink.matrix - sink.matrix.T).max() < 1e-9 * np.abs(sink.matrix).max()


@pytest.mark.parametrize(("kind", "pressure"), ELEMENTS)
def test_rigid_motion_stores_no_energy_and_leaves_a_deformed_state_as_it_is(kind, pressure):
    mesh, solid, size = solid_of(kind, pressure)
    turn, shift = rotation(5), np.array([3.0, -2.0, 1.0])

    def moved(unknowns):
        result = unknowns.copy()
        places = mesh.points + unknowns[: mesh.points.size].reshape(-1, 3)
        result[: mesh.points.size] = (places @ turn.T + shift - mesh.points).ravel()
        return result

    _, sink, found = settled(solid, moved(np.zeros(size)))
    assert found.energy == pytest.approx(0.0, abs=1e-13)
    assert np.abs(sink.residual).max() < 1e-12
    assert found.min_jacobian == pytest.approx(1.0, abs=1e-12)
    state, sink, found = settled(solid, random_state(mesh, size))
    _, turned_sink, turned = settled(solid, moved(state))
    assert turned.energy == pytest.approx(found.energy, rel=1e-12)
    n = mesh.points.size
    forces = sink.residual[:n].reshape(-1, 3) @ turn.T
    assert turned_sink.residual[:n].reshape(-1, 3) == pytest.approx(forces, abs=1e-11)
    assert turned.min_jacobian == pytest.approx(found.min_jacobian, rel=1e-12)


@pytest.mark.parametrize(("kind", "pressure"), ELEMENTS)
def test_patch_of_distorted_cells_carries_an_affine_field_exactly(kind, pressure):
    mesh, solid, _ = solid_of(kind, pressure, (2, 2, 2), 0.04)
    gradient = np.array([[0.2, 0.15, -0.1], [0.05, -0.1, 0.08], [-0.04, 0.1, -0.06]])
    affine = (mesh.points @ gradient.T).ravel()
    held = np.unique(outer_faces(mesh.blocks[0]))
    model = Model(mesh, [solid], {0: held, 1: held, 2: held}, tolerance=Tolerance(force=1e-11))
    guess = model.rest()
    guess.unknowns[: mesh.points.size] = affine
    inside = np.setdiff1d(np.arange(len(mesh.points)), held)
    assert len(inside) > 0
    noise = np.random.default_rng(2).uniform(-0.01, 0.01, (len(inside), 3))
    guess.unknowns.reshape(-1)[: mesh.points.size].reshape(-1, 3)[inside] += noise
    found = model.solve(guess, Control("parameter", 0.0))
    assert found.state.unknowns[: mesh.points.size] == pytest.approx(affine, abs=1e-10)
    cauchy, jacobians = solid.stresses(found.state)
    assert jacobians == pytest.approx(np.linalg.det(np.eye(3) + gradient), rel=1e-10)
    spread = np.abs(cauchy - cauchy[0, 0]).max()
    assert spread < 1e-8 * np.abs(cauchy).max()


@pytest.mark.parametrize(("kind", "pressure"), [e for e in ELEMENTS if e != ("hexahedron8", "constant")])
@pytest.mark.parametrize("loaded", [("x_max",), ("x_max", "y_max")])
def test_tension_of_one_block_follows_the_closed_form(kind, pressure, loaded):
    """Uniaxial and equibiaxial; the difference of principal stresses does not depend on the bulk law."""
    mesh = mapped_box(kind, (1, 1, 1))
    solid = Solid(mesh, {"*": RUBBER}, pressure=pressure)
    load = 0.5
    loads = [Traction(mesh, name, tuple(load * (name[0] == axis) for axis in "xyz")) for name in loaded]
    held = symmetry(mesh, x="x_min", y="y_min", z="z_min")
    model = Model(mesh, [solid], held, others=loads, tolerance=Tolerance(force=1e-12))
    state = model.rest()
    for scale in (0.25, 0.5, 0.75, 1.0):
        for part in loads:
            part.scale = scale
        state = model.solve(state, Control("parameter", 0.0)).state
    corner = np.flatnonzero(np.all(mesh.points == 1.0, axis=1))[0]
    stretch = 1.0 + state.unknowns[3 * corner : 3 * corner + 3]
    assert stretch[0] > 1.15
    scaled = stretch * stretch.prod() ** (-1 / 3)
    mu, alpha = np.array(RUBBER.mu), np.array(RUBBER.alpha)
    # J (sigma_1 - sigma_3) = sum 2 mu / alpha (l_1^alpha - l_3^alpha), sigma_1 = load l_1 / J, sigma_3 = 0.
    difference = np.sum(2 * mu / alpha * (scaled[0] ** alpha - scaled[2] ** alpha))
    assert load * stretch[0] == pytest.approx(difference, rel=1e-8)
    side = stretch[0] ** (-0.5 if len(loaded) == 1 else -2.0)
    assert stretch[2] == pytest.approx(side, rel=2e-2), "nearly incompressible"
    cauchy, _ = solid.stresses(state)
    assert cauchy[..., 0, 0] == pytest.approx(load * stretch[0] / stretch.prod(), rel=1e-8)


@pytest.mark.parametrize(("kind", "pressure"), ELEMENTS)
def test_simple_shear_of_one_cell_follows_the_closed_form(kind, pressure):
    shear = 0.8
    mesh, solid, size = solid_of(kind, pressure)
    unknowns = np.zeros(size)
    unknowns[0 : mesh.points.size : 3] = shear * mesh.points[:, 1]
    cauchy, _ = solid.stresses(State(unknowns, NO_FLUID, 0.0))
    stretch = (shear + np.sqrt(shear**2 + 4)) / 2
    mu, alpha = np.array(RUBBER.mu), np.array(RUBBER.alpha)
    difference = np.sum(2 * mu / alpha * (stretch**alpha - stretch**-alpha))
    assert cauchy[..., 0, 1] == pytest.approx(difference / (stretch + 1 / stretch), rel=1e-8)
    assert cauchy[..., 0, 0] - cauchy[..., 1, 1] == pytest.approx(shear * cauchy[..., 0, 1], rel=1e-8)


@pytest.mark.parametrize(("kind", "pressure"), [e for e in ELEMENTS if e[1] != "none"])
def test_bulk_modulus_is_that_of_the_law(kind, pressure):
    """A small uniform dilatation with the pressure in equilibrium: mean stress = kappa (J - 1)."""
    mesh, solid, size = solid_of(kind, pressure)
    growth = 1e-6
    unknowns = np.zeros(size)
    unknowns[: mesh.points.size] = growth * mesh.points.ravel()
    state, sink, found = settled(solid, unknowns)
    if pressure == "continuous":
        free = np.arange(mesh.points.size, size)
        state[free] -= np.linalg.solve(sink.matrix[np.ix_(free, free)], sink.residual[free])
        found = settled(solid, state)[2]
    cauchy, jacobians = solid.stresses(State(state, NO_FLUID, 0.0))
    mean = np.trace(cauchy, axis1=2, axis2=3) / 3
    assert mean == pytest.approx(RUBBER.kappa * (jacobians - 1), rel=2e-5)
    volume = solid.weights.sum()
    assert found.energy == pytest.approx(RUBBER.kappa / 2 * (3 * growth) ** 2 * volume, rel=2e-5)


def test_a_region_without_material_is_named():
    mesh = mapped_box("hexahedron27", (1, 1, 1))
    with pytest.raises(ConfigError, match="region `body` has no material; materials: wall"):
        Solid(mesh, {"wall": RUBBER})


def test_a_step_that_would_invert_cells_is_refused():
    mesh = mapped_box("hexahedron27", (1, 1, 1))
    solid = Solid(mesh, {"*": RUBBER})
    crush = Traction(mesh, "x_max", (-500.0, 0.0, 0.0))
    held = symmetry(mesh, x="x_min", y="y_min", z="z_min")
    model = Model(mesh, [solid], held, others=[crush])
    with pytest.raises(StepFailed):
        model.solve(model.rest(), Control("parameter", 0.0))


def test_a_collapsed_cell_is_reported_by_its_jacobian_not_by_a_crash():
    mesh, solid, size = solid_of("hexahedron27", "none")
    unknowns = np.zeros(size)
    unknowns[: mesh.points.size] = -2.0 * mesh.points.ravel()
    found = Evaluation()
    solid.assemble(State(unknowns, NO_FLUID, 0.0), DenseSink(size), found)
    assert found.min_jacobian == pytest.approx(-1.0)
