"""Viscoelastic memory: tangent, closed-form relaxation, both limits, order of the time step."""

import numpy as np
import pytest
from probe import DenseSink, settled
from scipy.integrate import quad

from mapped_box import mapped_box
from tubefoot.design.material import OgdenMaterial
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.memory import Memory, Relaxation
from tubefoot.fea.solid import OgdenLaw, Solid

LAW = OgdenLaw((0.4, 0.05, -0.01), (1.3, 4.3, -1.0), 50.0)
TERMS = Relaxation((0.5, 4.0, 60.0), (2.0, 0.7, 0.3))
NO_FLUID = np.zeros(0)


def one_cell(pressure="none", kind="hexahedron27", law=LAW):
    mesh = mapped_box(kind, (1, 1, 1))
    return mesh, Solid(mesh, {"*": law}, pressure=pressure)


def state_of(mesh, solid, gradient):
    unknowns = np.zeros(mesh.points.size + solid.n_own)
    unknowns[: mesh.points.size] = (mesh.points @ np.asarray(gradient).T).ravel()
    return State(unknowns, NO_FLUID, 0.0)


def shear(amount):
    return [[0.0, amount, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


def shear_stress(solid, state):
    cauchy, _ = solid.stresses(state)
    assert np.ptp(cauchy[..., 0, 1]) < 1e-12
    return cauchy[0, 0, 0, 1]


@pytest.mark.parametrize(("kind", "pressure"), [("hexahedron27", "continuous"), ("tetra10", "linear")])
def test_tangent_and_residual_with_memory_are_central_differences(kind, pressure):
    mesh, solid = one_cell(pressure, kind)
    rng = np.random.default_rng(3)
    history = 0.1 * rng.normal(size=(*solid.weights.shape, 6))
    solid.remember(np.array([3.0]), history)
    size = mesh.points.size + solid.n_own
    u = np.zeros(size)
    u[: mesh.points.size] = rng.uniform(-0.04, 0.04, mesh.points.size)
    way = np.zeros(size)
    kept = np.setdiff1d(np.arange(size), solid.eliminated)
    way[kept] = rng.normal(size=len(kept))
    h = 1e-6
    base, sink, _ = settled(solid, u)
    (_, plus, found_plus), (_, minus, found_minus) = (settled(solid, base + s * h * way) for s in (1, -1))
    slope = (found_plus.energy - found_minus.energy) / (2 * h)
    assert sink.residual @ way == pytest.approx(slope, rel=1e-6)
    change = (plus.residual - minus.residual)[kept] / (2 * h)
    assert np.abs((sink.matrix @ way)[kept] - change).max() <= 1e-6 * np.abs(change).max()


def test_stress_after_a_sudden_shear_relaxes_as_the_prony_series():
    mesh, solid = one_cell()
    state = state_of(mesh, solid, shear(0.8))
    long_term = shear_stress(solid, state)
    memory = Memory(solid, TERMS)
    memory.begin(0.0)
    instant = shear_stress(solid, state)
    assert instant / long_term == pytest.approx(1 + sum(TERMS.shares), rel=1e-12)
    memory.keep(state)
    time = 0.0
    for duration in (0.01, 0.3, 0.3, 2.0, 15.0, 100.0, 1e4):
        time += duration
        memory.begin(duration)
        series = sum(s * np.exp(-time / t) for s, t in zip(TERMS.shares, TERMS.times, strict=True))
        assert shear_stress(solid, state) / long_term == pytest.approx(1 + series, rel=1e-12)
        assert TERMS.modulus(time) == pytest.approx(1 + series, rel=1e-14)
        memory.keep(state)


def test_a_slow_ramp_is_the_long_term_law():
    mesh, solid = one_cell()
    memory = Memory(solid, TERMS)
    excess = 0.0
    for share in np.linspace(0.1, 1.0, 10):
        state = state_of(mesh, solid, shear(0.8 * share))
        memory.begin(1e9)
        slow = shear_stress(solid, state)
        excess = memory.keep(state)
    _, plain = one_cell()
    assert slow == pytest.approx(shear_stress(plain, state), rel=1e-6)
    found = Evaluation()
    plain.assemble(state, DenseSink(len(state.unknowns)), found)
    assert abs(excess) < 1e-6 * found.energy


def test_the_excess_leaves_the_long_term_energy():
    """Potential of the step minus the excess = stored energy of the law, whatever was remembered."""
    mesh, solid = one_cell("continuous")
    _, plain = one_cell("continuous")
    memory = Memory(solid, TERMS)
    for duration, amount in ((0.0, 0.3), (0.4, 0.5), (3.0, 0.2)):
        state = state_of(mesh, solid, shear(amount))
        memory.begin(duration)
        with_memory, without = Evaluation(), Evaluation()
        solid.assemble(state, DenseSink(len(state.unknowns)), with_memory)
        plain.assemble(state, DenseSink(len(state.unknowns)), without)
        assert with_memory.energy != pytest.approx(without.energy, rel=0.1)
        assert with_memory.energy - memory.keep(state) == pytest.approx(without.energy, rel=1e-12)


def test_second_order_in_the_time_step():
    """A branch alone under a sheared sine against the convolution integral of its closed-form stress."""
    law = OgdenLaw((0.5,), (2.0,), 50.0)
    terms = Relaxation((0.7,), (2.0,))

    def gamma(t):
        return 0.9 * np.sin(1.7 * t) * t

    def stress_12(t):
        # Isochoric neo-Hooke in simple shear: S = mu (1 - tr C / 3 C^-1), S12 = mu g (3 + g^2) / 3.
        g = gamma(t)
        return 0.5 * g * (3 + g * g) / 3

    end = 1.5
    # Integration by parts: Q(t) = share (S(t) - 1/tau int exp(-(t - s)/tau) S ds), S(0) = 0.
    integral, _ = quad(lambda s: np.exp(-(end - s) / 0.7) * stress_12(s), 0, end, epsabs=1e-13)
    exact = 2.0 * (stress_12(end) - integral / 0.7)
    errors = []
    for n in (8, 16, 32, 64):
        mesh, solid = one_cell(law=law)
        memory = Memory(solid, terms)
        for k in range(1, n + 1):
            memory.begin(end / n)
            memory.keep(state_of(mesh, solid, shear(gamma(k * end / n))))
        memory.begin(0.0)  # nothing fades: what is remembered is Q - share S
        remembered = solid._history[0, 0, 3] + 2.0 * stress_12(end)
        errors.append(abs(remembered - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 2.0) < 0.15).all(), (errors, orders)
    assert errors[-1] < 2e-3 * abs(exact)


def test_memory_follows_a_rotation():
    """A body that turns as a whole keeps its stress in its own axes."""
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    strained = np.eye(3) + np.array(shear(0.5))
    stresses = []
    for rotation in (np.eye(3), turn):
        mesh, solid = one_cell()
        memory = Memory(solid, TERMS)
        memory.begin(0.0)
        memory.keep(state_of(mesh, solid, strained - np.eye(3)))
        memory.begin(1.0)
        cauchy, _ = solid.stresses(state_of(mesh, solid, rotation @ strained - np.eye(3)))
        stresses.append(rotation.T @ cauchy[0, 0] @ rotation)
    assert np.abs(stresses[0] - stresses[1]).max() < 1e-12


def test_elastic_regions_remember_nothing():
    mesh, solid = one_cell()
    memory = Memory(solid, TERMS, elastic_regions=[0])
    state = state_of(mesh, solid, shear(0.4))
    _, plain = one_cell()
    memory.begin(0.0)
    assert shear_stress(solid, state) == pytest.approx(shear_stress(plain, state), rel=1e-14)
    memory.keep(state)
    memory.begin(2.0)
    assert shear_stress(solid, state) == pytest.approx(shear_stress(plain, state), rel=1e-14)


def test_agilus30_half_a_second_after_a_step_is_six_times_as_stiff():
    """The published dynamic test: about six times the long-term modulus at 0.5 s, 19 times in a moment."""
    body = OgdenMaterial()
    terms = Relaxation(body.relaxation_time_s, body.relaxation_share)
    assert terms.modulus(0.5) == pytest.approx(6.0, abs=0.1)
    assert terms.modulus(0.0) == pytest.approx(1 + 22.149 / 1.168, rel=1e-4)
