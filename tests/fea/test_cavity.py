"""Cavities: volume, its derivatives, load stiffness, rigid motion; the air column."""

from dataclasses import replace

import numpy as np
import pytest
from probe import DenseSink

from mapped_box import mapped_box
from octant import cylinder_quarter, sphere_octant
from tubefoot.errors import GeometryError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import air_uptake
from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.mesh import FacetSet, Mesh
from tubefoot.units import ATMOSPHERE_MPA


@pytest.fixture(scope="module", params=["hexahedron27", "hexahedron20", "tetra10"])
def octant(request):
    return sphere_octant(request.param, 1.0, 1.6, 1, 2)


def random_displacement(mesh, amount=0.1):
    return np.random.default_rng(4).uniform(-amount, amount, mesh.points.size)


def test_volume_of_an_octant_closed_by_symmetry_planes(octant):
    assert Cavity(octant, "inside", 0).volume == pytest.approx(np.pi / 6, rel=3e-3)


def test_volume_of_a_lidded_quarter_cylinder():
    mesh = cylinder_quarter("hexahedron27", 2.0, 3.0, 1, 3, 1.5)
    assert Cavity(mesh, "cavity", 0).volume == pytest.approx(np.pi * 1.5, rel=3e-4)


def test_gradient_and_load_stiffness_are_central_differences(octant):
    cavity = Cavity(octant, "inside", 1)
    pressure, step = 0.3, 1e-5
    unknowns = random_displacement(octant)
    n = len(unknowns)

    def parts(at):
        sink = DenseSink(n)
        cavity.assemble(State(at, np.array([9.0, pressure]), 0.0), sink, Evaluation())
        return sink

    sink = parts(unknowns)
    cavity.evaluate(unknowns)
    gradient = cavity.gradient(n)
    assert sink.residual == pytest.approx(-pressure * gradient, rel=1e-14)
    for j in np.unique(cavity.pattern)[::19]:
        moved = unknowns.copy()
        moved[j] += step
        above, volume_above = parts(moved), cavity.volume
        moved[j] -= 2 * step
        below, volume_below = parts(moved), cavity.volume
        assert gradient[j] == pytest.approx((volume_above - volume_below) / (2 * step), abs=1e-9)
        slope = (above.residual - below.residual) / (2 * step)
        assert np.abs(sink.matrix[:, j] - slope).max() < 1e-9
    assert np.abs(sink.matrix).max() > 1e-2
    assert np.abs(sink.matrix - sink.matrix.T).max() < 1e-15


def closed_box(size):
    """A box of six nine-node facets, normals into the box: the wall of a fluid."""
    kind = element_kind("hexahedron27")
    points = (kind.nodes + 1) / 2 * np.array(size) + [5.0, -3.0, 2.0]
    inwards = np.array(kind.faces)[:, [1, 0, 3, 2, 4, 7, 6, 5, 8]]
    return Mesh(points, (), (), {"wall": FacetSet("quad9", inwards)})


def test_volume_of_a_box_away_from_the_origin_and_its_independence_of_rigid_motion():
    mesh = closed_box((2.0, 3.0, 4.0))
    cavity = Cavity(mesh, "wall", 0)
    assert cavity.rest_volume == pytest.approx(24.0, rel=1e-14)
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    deformed = mesh.points + random_displacement(mesh, 0.2).reshape(-1, 3)
    volume = cavity.evaluate((deformed - mesh.points).ravel())
    assert abs(volume - 24.0) > 0.01
    turned = deformed @ turn.T + [10.0, -7.0, 3.0]
    assert cavity.evaluate((turned - mesh.points).ravel()) == pytest.approx(volume, rel=1e-12)


def test_pressure_in_a_closed_wall_has_no_resultant_force_or_moment():
    mesh = closed_box((2.0, 3.0, 4.0))
    cavity = Cavity(mesh, "wall", 0)
    unknowns = random_displacement(mesh, 0.2)
    cavity.evaluate(unknowns)
    forces = cavity.gradient(len(unknowns)).reshape(-1, 3)
    places = mesh.points + unknowns.reshape(-1, 3)
    assert forces.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.cross(places, forces).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-11)


@pytest.mark.parametrize("pressure", [-0.09, -0.03, 0.0, 0.035, 0.3])
def test_air_column_follows_boyle_and_its_slope_is_a_central_difference(pressure):
    uptake, slope = air_uptake(pressure, 800.0)
    assert (800.0 - uptake) * (ATMOSPHERE_MPA + pressure) == pytest.approx(800.0 * ATMOSPHERE_MPA, rel=1e-14)
    step = 1e-6
    above, below = air_uptake(pressure + step, 800.0)[0], air_uptake(pressure - step, 800.0)[0]
    assert slope == pytest.approx((above - below) / (2 * step), rel=1e-6)


def test_one_millilitre_of_air_takes_up_a_quarter_at_35_kpa_and_half_at_minus_35():
    assert air_uptake(0.035, 1000.0)[0] == pytest.approx(256.7, abs=0.1)
    assert air_uptake(-0.035, 1000.0)[0] == pytest.approx(-527.7, abs=0.1)


def test_an_open_wall_is_refused():
    mesh = mapped_box("hexahedron27", (1, 1, 1), lambda p: p + 1.0)
    walls = ["x_min", "x_max", "y_min", "y_max", "z_min"]
    nodes = np.vstack([mesh.facet_set(wall).nodes for wall in walls])
    opened = replace(mesh, facets={**mesh.facets, "open": FacetSet("quad9", nodes)})
    with pytest.raises(GeometryError, match="open near"):
        Cavity(opened, "open", 0)
    at_plane = replace(opened, points=opened.points - [0.0, 0.0, 2.0])
    assert Cavity(at_plane, "open", 0).volume == pytest.approx(-1.0)
