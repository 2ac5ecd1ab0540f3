"""Contact against closed forms: two bars that close their gap, a rigid sphere on a block (Hertz)."""

import numpy as np
import pytest
from scipy.optimize import brentq

from mapped_box import joined, mapped_box, plane
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.contact import SelfContact
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.obstacle import Obstacle, Plane, Sphere
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.traction import Traction

MODULUS, POISSON = 1.0, 0.3
LAW = OgdenLaw.elastic(MODULUS, POISSON)
LENGTH, GAP = 3.0, 0.05
BARRIER = Barrier(reach=0.02, stiffness=15.0)


def bar_stretch(stress):
    """Stretch of a neo-Hookean bar under nominal stress, by its own two equations (axial, lateral)."""
    mu, kappa = LAW.mu[0], LAW.kappa

    def nominal(stretch, lateral):
        volume = stretch * lateral**2
        mean = (stretch**2 + 2 * lateral**2) / 3
        pressure = kappa * (1 - 1 / volume)
        axial, side = (
            mu * volume ** (-2 / 3) * (x**2 - mean) / x + pressure * volume / x for x in (stretch, lateral)
        )
        return axial, side

    def residual(stretch):
        lateral = brentq(lambda side: nominal(stretch, side)[1], 0.5, 1.5)
        return nominal(stretch, lateral)[0] - stress

    return brentq(residual, 0.5, 2.0)


@pytest.mark.parametrize("traction", [0.025, 0.04])
def test_a_bar_pulled_onto_another_closes_the_gap_and_shares_the_load(traction):
    """The upper bar hangs from its top and is pulled down at its lower end; its neighbour stands below."""
    upper_start = LENGTH + GAP
    bars = [
        mapped_box("hexahedron27", (2, 2, 3), lambda p: p * [2.0, 2.0, LENGTH]),
        mapped_box("hexahedron27", (3, 3, 2), lambda p: p * [2.0, 2.0, LENGTH] + [0.0, 0.0, upper_start]),
    ]
    mesh = joined(
        bars,
        {
            "below": plane(2, LENGTH),
            "above": plane(2, upper_start),
            "x": plane(0, 0.0),
            "y": plane(1, 0.0),
            "foot": plane(2, 0.0),
            "head": plane(2, upper_start + LENGTH),
        },
    )
    held = {
        0: mesh.facet_set("x").points,
        1: mesh.facet_set("y").points,
        2: np.union1d(mesh.facet_set("foot").points, mesh.facet_set("head").points),
    }
    load = Traction(mesh, "above", (0.0, 0.0, -traction))
    contact = SelfContact(mesh, ["below", "above"], BARRIER)
    solid = Solid(mesh, {"*": LAW}, pressure="none")
    model = Model(mesh, [solid], held, others=[load, contact])
    state = model.rest()
    for share in (0.25, 0.5, 0.75, 1.0):
        load.scale = share
        state = model.solve(state, Control("parameter", 1.0)).state

    def gap_left(pressure):
        # The traction acts on the undeformed area, the contact pressure here as well (both sides' samples).
        lower, upper = bar_stretch(-pressure), bar_stretch(traction - pressure)
        gap = GAP - LENGTH * (lower - 1) - LENGTH * (upper - 1)
        return gap - (BARRIER.reach - np.sqrt(pressure * BARRIER.reach / BARRIER.stiffness))

    pressure = brentq(gap_left, 0.0, traction)
    pushed = state.unknowns[3 * mesh.facet_set("below").points + 2].mean()
    pulled = state.unknowns[3 * mesh.facet_set("above").points + 2].mean()
    assert pressure > 0.05 * traction
    assert pushed == pytest.approx(LENGTH * (bar_stretch(-pressure) - 1), rel=0.01)
    assert pulled == pytest.approx(-LENGTH * (bar_stretch(traction - pressure) - 1), rel=0.01)
    assert GAP + pulled - pushed == pytest.approx(
        BARRIER.reach - np.sqrt(pressure * BARRIER.reach / BARRIER.stiffness), abs=0.02 * BARRIER.reach
    )


def quarter_block(n):
    """A quarter of a block 80 mm wide and 40 deep, refined under the origin of its top."""

    def graded(p):
        x, y, z = p.T
        return np.stack([40.0 * x**2, 40.0 * y**2, -40.0 * (1 - z) ** 2], axis=1)

    places = {"x": plane(0, 0.0), "y": plane(1, 0.0), "foot": plane(2, -40.0), "top": plane(2, 0.0)}
    return mapped_box("hexahedron27", (n, n, n), graded, places)


def sphere_force(n, depth, barrier, law):
    """Force of a rigid sphere of radius 8 mm on the whole block, and how far it presses in its middle in."""
    mesh = quarter_block(n)
    held = {axis: mesh.facet_set(name).points for axis, name in ((0, "x"), (1, "y"))}
    foot = mesh.facet_set("foot").points
    held = {0: np.union1d(held[0], foot), 1: np.union1d(held[1], foot), 2: foot}
    radius = 8.0
    obstacle = Obstacle(mesh, "top", Sphere((0.0, 0.0, radius + barrier.reach), radius), barrier)
    model = Model(mesh, [Solid(mesh, {"*": law}, pressure="none")], held, others=[obstacle])
    state = model.rest()
    for part in np.linspace(0.05, 1.0, 20):
        obstacle.shape = Sphere((0.0, 0.0, radius - part * depth), radius)
        state = model.solve(state, Control("parameter", 0.0)).state
    middle = int(np.argmin(np.linalg.norm(mesh.points, axis=1)))
    return 4.0 * obstacle.force[2], -state.unknowns[3 * middle + 2]


@pytest.mark.slow
def test_a_rigid_sphere_presses_a_block_as_hertz_says():
    """F = 4/3 E / (1 - nu^2) sqrt(R) depth^1.5 for small depth, approached from above with the mesh."""
    barrier = Barrier(reach=0.02, stiffness=15.0)
    ratios = []
    for n in (5, 8):
        force, depth = sphere_force(n, 0.4, barrier, LAW)
        hertz = 4.0 / 3.0 * MODULUS / (1 - POISSON**2) * np.sqrt(8.0) * depth**1.5
        # On a bonded layer 40 mm deep the force is larger by about 1 + 1.0 sqrt(R depth) / 40
        # (Dimitriadis et al., Biophys. J. 82, 2002: 0.884 to 1.133 by Poisson's ratio).
        ratios.append(force / (hertz * (1 + np.sqrt(8.0 * depth) / 40.0)))
    assert 1.0 < ratios[1] < ratios[0]
    assert ratios[1] == pytest.approx(1.0, abs=0.07)


def test_a_plane_presses_a_confined_block_by_its_oedometer_modulus():
    mesh = mapped_box("hexahedron27", (2, 2, 2), lambda p: p * [2.0, 2.0, 5.0])
    sides = {
        0: np.union1d(mesh.facet_set("x_min").points, mesh.facet_set("x_max").points),
        1: np.union1d(mesh.facet_set("y_min").points, mesh.facet_set("y_max").points),
        2: mesh.facet_set("z_min").points,
    }
    barrier = Barrier(reach=0.02, stiffness=15.0)
    obstacle = Obstacle(mesh, "z_max", Plane((0.0, 0.0, 5.02), (0.0, 0.0, -1.0)), barrier)
    model = Model(mesh, [Solid(mesh, {"*": LAW}, pressure="none")], sides, others=[obstacle])
    state = model.rest()
    for height in (5.0, 4.98, 4.96, 4.95):
        obstacle.shape = Plane((0.0, 0.0, height), (0.0, 0.0, -1.0))
        state = model.solve(state, Control("parameter", 0.0)).state
    top = 5.0 + state.unknowns[3 * mesh.facet_set("z_max").points + 2].mean()
    pressure = obstacle.force[2] / 4.0
    assert pressure == pytest.approx(barrier.pressure(np.array([4.95 - top]))[0], rel=1e-6)
    # Uniaxial strain: nominal stress by the derivative of W with F = diag(1, 1, s).
    mu, kappa, s = LAW.mu[0], LAW.kappa, top / 5.0
    deviatoric = mu * s ** (-2 / 3) * (s - (s**2 + 2) / (3 * s))
    assert -pressure == pytest.approx(deviatoric + kappa * (1 - 1 / s), rel=1e-5)
