"""A point with a strain of its own: what it has in common with the usual one, and what it is good for."""

import numpy as np
import pytest

from mapped_box import mapped_box, plane
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.material_point import cofactor, material_point
from tubefoot.fea.mixed_point import mixed_point
from tubefoot.fea.newton import converge
from tubefoot.fea.predictor import straight
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import StepFailed
from tubefoot.fea.traction import Traction

MU, ALPHA = np.array([0.2, 0.1]), np.array([2.3, -1.5])
HISTORY = np.array([0.1, 0.02, 0.03, 0.04, 0.05, 0.06])
OTHERS = (0.3, 2.0, 0.17, HISTORY)
"""Share of the bulk modulus, guard, pressure field [MPa], remembered stress."""


def deformations():
    rng = np.random.default_rng(1)
    return [np.eye(3) + 0.2 * rng.standard_normal((3, 3)) for _ in range(4)]


def usual(f):
    """Energy, J, dJ/dF, stress and tangent by F."""
    cof, stress, tangent = np.empty((3, 3)), np.empty((3, 3)), np.empty((9, 9))
    jacobian = cofactor(f, cof)
    energy = material_point(f, cof, jacobian, MU, ALPHA, *OTHERS, True, stress, tangent, np.empty((7, 9)))
    return energy, jacobian, cof, stress, tangent


def mixed(f, strain):
    """The same with a strain of its own."""
    cof, stress, tangent = np.empty((3, 3)), np.empty((3, 3)), np.empty((9, 9))
    packed = strain[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    scratch = np.empty((7, 9)), np.empty((7, 3, 3))
    energy, jacobian = mixed_point(f, packed, MU, ALPHA, *OTHERS, cof, stress, tangent, *scratch)
    return energy, jacobian, cof, stress, tangent


@pytest.mark.parametrize("f", deformations())
def test_with_the_strain_of_the_displacements_it_is_the_usual_point(f):
    for own, known in zip(mixed(f, f.T @ f), usual(f), strict=True):
        assert own == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize("f", deformations())
def test_stress_and_volume_miss_by_the_square_of_the_strains_difference(f):
    rng = np.random.default_rng(2)
    change = rng.standard_normal((3, 3))
    change = change + change.T
    errors = []
    for size in (2e-3, 1e-3):
        _, jacobian, _, stress, _ = mixed(f, f.T @ f + size * change)
        _, exact_jacobian, _, exact, _ = usual(f)
        errors.append((np.abs(stress - exact).max(), abs(jacobian - exact_jacobian)))
    for coarse, fine in zip(*errors, strict=True):
        assert coarse / fine == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("f", deformations())
def test_a_turn_leaves_the_own_strain_without_stress_of_its_own(f):
    """A straight step stretches a wall that turns; the stiffness by its own strain does not know of that."""
    tilt = np.array([[0.0, -0.3, 0.0], [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    turned = (np.eye(3) + tilt) @ f
    _, _, _, _, tangent = mixed(turned, f.T @ f)
    second = np.linalg.solve(f, usual(f)[3])
    # The geometric part is by the stress of the own strain, without that of the spurious stretch.
    _, _, _, _, plain = usual(turned)
    strain = turned.T @ turned - f.T @ f
    assert np.abs(strain).max() > 0.05
    geometric = np.einsum("ik,jl->ijkl", np.eye(3), second).reshape(9, 9)
    assert np.abs(tangent - tangent.T).max() < 1e-12
    material = tangent - geometric
    # The rest is F D F: a rigid spin w x F strains nothing.
    spin = np.array([[0.0, -0.1, 0.2], [0.1, 0.0, -0.4], [-0.2, 0.4, 0.0]])
    assert np.abs(material @ (spin @ turned).ravel()).max() < 1e-12
    assert np.abs(plain - tangent).max() > 1e-3


def strip():
    """A thin strip held at one end, pushed across at the other."""
    places = {"foot": plane(2, 0.0), "head": plane(2, 20.0)}
    mesh = mapped_box("hexahedron27", (1, 1, 8), lambda p: p * [0.4, 2.0, 20.0], places)
    push = Traction(mesh, "head", (7.5e-5, 0.0, 0.0))
    solid = Solid(mesh, {"*": OgdenLaw((0.5,), (2.0,), 500.0)}, pressure="continuous")
    model = Model(mesh, [solid], dict.fromkeys(range(3), mesh.facet_set("foot").points), others=[push])
    model.slope_at_rest(Control("parameter", 1.0))
    return model, push


STILL = Control("parameter", 0.0)


def test_a_strip_is_bent_far_in_one_step_where_newtons_method_alone_fails():
    model, push = strip()
    with pytest.raises(StepFailed):
        converge(model, model.rest(), STILL)
    model, push = strip()
    bent = model.solve(model.rest(), STILL)
    head = 3 * model.mesh.facet_set("head").points
    assert bent.state.unknowns[head].mean() > 7.0
    model, push = strip()
    state = model.rest()
    for share in np.linspace(0.0, 1.0, 41)[1:]:
        push.scale = share
        state = converge(model, state, STILL).state
    assert np.abs(bent.state.unknowns - state.unknowns)[: 3 * len(model.mesh.points)].max() < 1e-4


def test_the_blend_of_a_straight_way_is_the_strain_to_first_order():
    model, _ = strip()
    solid = model.solids[0]
    rng = np.random.default_rng(3)
    start, way = 0.004 * rng.standard_normal((2, model.n_unknowns))

    def strain(unknowns):
        solid.blend([(1.0, unknowns)], unknowns)
        return solid.strains.copy()

    slope = (strain(start + 1e-5 * way) - strain(start - 1e-5 * way)) / 2e-5
    solid.blend(straight(start, start + way), start)
    assert solid.strains == pytest.approx(strain(start) + slope, abs=1e-6)


def test_a_point_takes_the_strain_of_the_displacements_where_its_own_would_be_none():
    model, _ = strip()
    solid = model.solids[0]
    at = 0.02 * np.random.default_rng(4).standard_normal(model.n_unknowns)
    solid.blend([(1.0, at)], at)
    known = solid.strains.copy()
    solid.blend([(-1.0, at)], at)
    assert solid.strains == pytest.approx(known)
    solid.bind()
    assert solid.strains.shape[2] == 0
