"""Ten-node tetrahedra as Netgen makes them, against closed forms and published values.

The cases are those of `test_cook.py` and `test_inflation.py`, their sources are named there; the meshes are
unstructured, of STEP files, with named faces.
"""

import build123d as b3d
import numpy as np
import pytest
from test_cook import NEARLY_INCOMPRESSIBLE
from test_inflation import INNER, OUTER, inflate, sphere_pressure

from tubefoot.design.named_step import write_named_step
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.named_mesh import named_mesh
from tubefoot.fea.solid import Solid
from tubefoot.fea.tetrahedra import step_mesh
from tubefoot.fea.traction import Traction

THICKNESS = 2.0


def meshed(solid, directory, name, size):
    found = step_mesh(write_named_step(directory / "part.step", {"body": solid}, name), size)
    return named_mesh(found, {key: key for key in found.facet_sets})


def plane_name(place, scale):
    """`x0` for a face in the plane x = 0, `other` for one in no coordinate plane."""
    for axis, letter in enumerate("xyz"):
        if place.high[axis] - place.low[axis] < 1e-6 * scale:
            return f"{letter}{abs(round(place.low[axis]))}"
    return "other"


@pytest.fixture(scope="module")
def membrane(tmp_path_factory):
    outline = b3d.Wire.make_polygon([(0, 0, 0), (48, 44, 0), (48, 60, 0), (0, 44, 0)], close=True)
    solid = b3d.Solid.extrude(b3d.Face(outline), b3d.Vector(0, 0, THICKNESS))
    return meshed(solid, tmp_path_factory.mktemp("cook"), lambda _, place: plane_name(place, 48.0), 3.0)


def rise(mesh):
    """Vertical displacement of the corner (48, 60) under 6.25 MPa [mm]."""
    load = Traction(mesh, "x48", (0.0, 6.25, 0.0))
    flat = np.union1d(mesh.facet_set("z0").points, mesh.facet_set(f"z{THICKNESS:.0f}").points)
    clamp = mesh.facet_set("x0").points
    held = {0: clamp, 1: clamp, 2: np.union1d(flat, clamp)}
    model = Model(
        mesh, [Solid(mesh, {"*": NEARLY_INCOMPRESSIBLE}, pressure="continuous")], held, others=[load]
    )
    state = before = model.rest()
    for load.scale in (0.25, 0.5, 0.75, 1.0):
        guess = State(2 * state.unknowns - before.unknowns, state.pressures, 0.0)
        before, state = state, model.solve(guess, Control("parameter", 0.0)).state
    point = int(np.argmin(np.linalg.norm(mesh.points - np.array([48.0, 60.0, 0.0]), axis=1)))
    return state.unknowns[3 * point + 1]


def test_nearly_incompressible_membrane_rises_as_published(membrane):
    assert rise(membrane) == pytest.approx(6.8914, rel=1e-2)


def test_sphere_inflates_along_the_closed_form_past_its_pressure_maximum(tmp_path):
    shell = b3d.Solid.make_sphere(OUTER) - b3d.Solid.make_sphere(INNER)
    octant = shell & b3d.Solid.make_box(2 * OUTER, 2 * OUTER, 2 * OUTER)

    def name(_, place):
        flat = plane_name(place, OUTER)
        return ("inside" if place.high[0] < 1.1 * INNER else "outside") if flat == "other" else flat

    mesh = meshed(octant, tmp_path, name, 0.25)
    held = {axis: mesh.facet_set(f"{letter}0").points for axis, letter in enumerate("xyz")}
    ratios = np.linspace(1.0, 6.0, 21)[1:]
    found = inflate(mesh, "inside", ratios, held, "continuous")
    exact = np.array([sphere_pressure(np.cbrt(ratio)) for ratio in ratios])
    assert 0 < np.argmax(exact) < len(exact) - 2
    assert np.argmax(found) == np.argmax(exact)
    assert np.abs(found / exact - 1).max() < 5e-3
