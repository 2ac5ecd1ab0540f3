"""Thick-walled Ogden sphere and cylinder against the closed-form pressure integrals.

An incompressible thick wall of inner radius A and outer radius B, inflated to inner stretch a:

    sphere     P = int_b^a W'(s) / (s^3 - 1) ds,   b^3 - 1 = (a^3 - 1) (A / B)^3,   W(s) = W(s^-2, s, s)
    cylinder   P = int_b^a W'(s) / (s^2 - 1) ds,   b^2 - 1 = (a^2 - 1) (A / B)^2,   W(s) = W(s^-1, s, 1)

Source: Ogden, Non-Linear Elastic Deformations, 1984, section 5.3. The solid's bulk modulus is 5000 times
its shear modulus, so it deviates from incompressible by about a part in a thousand.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from octant import cylinder_quarter, sphere_octant
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.solid import OgdenLaw, Solid

MU, ALPHA = np.array([0.63 * 1.3 / 2, 0.0012 * 5 / 2, 0.01]), np.array([1.3, 5.0, -2.0])
"""Ogden's fit of Treloar's rubber (Proc. R. Soc. A 326, 1972), in the form with 2 mu / alpha^2."""
LAW = OgdenLaw(tuple(MU), tuple(ALPHA), 5000 * MU.sum())
INNER, OUTER = 1.0, 1.5


def sphere_pressure(stretch):
    def slope(s):
        return np.sum(4 * MU / ALPHA * (s ** (ALPHA - 1) - s ** (-2 * ALPHA - 1)))

    outside = np.cbrt(1 + (stretch**3 - 1) * (INNER / OUTER) ** 3)
    return quad(lambda s: slope(s) / (s**3 - 1), outside, stretch, epsabs=1e-13)[0]


def cylinder_pressure(stretch):
    def slope(s):
        return np.sum(2 * MU / ALPHA * (s ** (ALPHA - 1) - s ** (-ALPHA - 1)))

    outside = np.sqrt(1 + (stretch**2 - 1) * (INNER / OUTER) ** 2)
    return quad(lambda s: slope(s) / (s**2 - 1), outside, stretch, epsabs=1e-13)[0]


def test_integrals_agree_with_the_thin_wall_and_the_neo_hookean_limits(monkeypatch):
    monkeypatch.setitem(globals(), "MU", np.array([0.4]))
    monkeypatch.setitem(globals(), "ALPHA", np.array([2.0]))
    a, b = 1.7, np.cbrt(1 + (1.7**3 - 1) / OUTER**3)
    neo_hookean = 0.2 * ((4 / b + b**-4) - (4 / a + a**-4))
    assert sphere_pressure(1.7) == pytest.approx(neo_hookean, rel=1e-10)
    monkeypatch.setitem(globals(), "OUTER", 1.0001)
    thin = 2 * 0.4 * 1e-4 / 1.7 * (1 - 1.7**-6)
    assert sphere_pressure(1.7) == pytest.approx(thin, rel=3e-4)


def inflate(mesh, facets, volumes, held, pressure_space="linear"):
    """Pressure [MPa] at each volume, given over the rest volume; driven by volume alone."""
    solid = Solid(mesh, {"*": LAW}, pressure=pressure_space)
    cavity = Cavity(mesh, facets, 0)
    model = Model(mesh, [solid], held, [cavity], Drive(("volume",), (1.0,)))
    state = before = model.rest()
    found = []
    for ratio in volumes:
        guess = State(
            2 * state.unknowns - before.unknowns,
            2 * state.pressures - before.pressures,
            2 * state.parameter - before.parameter,
        )
        step = model.solve(guess, Control("parameter", (ratio - 1) * cavity.rest_volume))
        before, state = state, step.state
        found.append(float(state.pressures[0]))
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "pressure_space"),
    [("hexahedron27", "linear"), ("hexahedron27", "continuous"), ("tetra10", "continuous")],
)
def test_sphere_inflates_along_the_closed_form_past_its_pressure_maximum(kind, pressure_space):
    mesh = sphere_octant(kind, INNER, OUTER, 2, 2)
    held = {axis: mesh.facet_set(f"{name}_min").points for axis, name in enumerate("xyz")}
    ratios = np.linspace(1.0, 6.0, 11)[1:]
    found = inflate(mesh, "inside", ratios, held, pressure_space)
    exact = np.array([sphere_pressure(np.cbrt(ratio)) for ratio in ratios])
    peak = int(np.argmax(exact))
    assert 0 < peak < len(exact) - 2, "the maximum lies inside the path"
    assert int(np.argmax(found)) == peak
    assert np.abs(found / exact - 1).max() < 1e-3


def test_cylinder_inflates_along_the_closed_form_in_plane_strain():
    mesh = cylinder_quarter("hexahedron27", INNER, OUTER, 2, 3, 0.5)
    ends = np.union1d(mesh.facet_set("z_min").points, mesh.facet_set("z_max").points)
    lid = np.setdiff1d(mesh.facet_set("lid").points, mesh.facet_set("inside").points)
    held = {
        0: np.union1d(mesh.facet_set("x_min").points, lid),
        1: np.union1d(mesh.facet_set("y_min").points, lid),
        2: np.union1d(ends, lid),
    }
    ratios = np.linspace(1.0, 4.0, 9)[1:]
    found = inflate(mesh, "cavity", ratios, held)
    exact = np.array([cylinder_pressure(np.sqrt(ratio)) for ratio in ratios])
    assert np.abs(found / exact - 1).max() < 1e-3
