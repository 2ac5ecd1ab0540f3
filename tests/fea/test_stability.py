"""Stability of equilibria: Euler's column, its critical mode, and where it goes when it buckles."""

import numpy as np
import pytest

from mapped_box import mapped_box, plane
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.settle import Settler
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.stability import critical_mode, nodal_volumes
from tubefoot.fea.traction import Traction

LENGTH, WIDTH, DEPTH = 20.0, 1.0, 2.0
LAW = OgdenLaw((0.5,), (2.0,), 500.0)
YOUNG = 1.5
EULER = np.pi**2 * YOUNG * DEPTH * WIDTH**3 / 12 / (4 * LENGTH**2)
"""Load under which a column held at one end buckles [N]."""


def column():
    places = {"foot": plane(2, 0.0), "head": plane(2, LENGTH)}
    mesh = mapped_box("hexahedron27", (1, 1, 8), lambda p: p * [WIDTH, DEPTH, LENGTH], places)
    load = Traction(mesh, "head", (0.0, 0.0, -EULER / WIDTH / DEPTH))
    foot = mesh.facet_set("foot").points
    solid = Solid(mesh, {"*": LAW}, pressure="linear")
    model = Model(mesh, [solid], dict.fromkeys(range(3), foot), others=[load])
    model.slope_at_rest(Control("parameter", 1.0))
    return model, load


def pressed(model, load, share):
    load.scale = share
    return model.solve(model.rest(), Control("parameter", 0.0))


def test_a_column_is_unstable_from_eulers_load_on():
    model, load = column()
    counts = [model.linearise(pressed(model, load, share).state) for share in (0.5, 0.95, 1.06, 3.0)]
    assert counts == [0, 0, 1, 1]
    # Across its broad side it buckles under four times the load.
    assert model.linearise(pressed(model, load, 4.6).state) == 2


def test_the_critical_mode_bends_the_column_and_loses_its_stiffness_at_eulers_load():
    model, load = column()
    shares = np.array([0.3, 0.6, 0.9, 1.1])
    modes = [critical_mode(model, pressed(model, load, share).state) for share in shares]
    stiffness = np.array([mode.stiffness for mode in modes])
    assert (stiffness[:3] > 0).all()
    assert stiffness[3] < 0
    assert np.interp(0.0, -stiffness, shares) == pytest.approx(1.0, abs=0.04)
    # At no load w = EI (1.875 / L)^4 / A, from where it falls nearly evenly; spreading each cell's volume
    # evenly over its nodes puts too little of it at the head.
    free = YOUNG * WIDTH**2 / 12 * (1.8751 / LENGTH) ** 4
    assert np.polyval(np.polyfit(shares, stiffness, 1), 0.0) == pytest.approx(free, rel=0.1)
    point, axis = divmod(int(np.argmax(np.abs(modes[-1].shape))), 3)
    assert axis == 0
    assert model.mesh.points[point, 2] == pytest.approx(LENGTH)


def test_a_column_beyond_eulers_load_settles_bent():
    model, load = column()
    before, straight = pressed(model, load, 1.1), pressed(model, load, 1.152)
    mode = critical_mode(model, straight.state)
    bent = Settler(model).leave(before, straight, mode)
    head = model.mesh.facet_set("head").points
    sideways, down = (float(np.abs(bent.state.unknowns[3 * head + axis]).mean()) for axis in (0, 2))
    assert model.linearise(bent.state) == 0
    # Elastica at 1.152 times Euler's load, Timoshenko and Gere, Theory of Elastic Stability, table 2-1.
    assert sideways / LENGTH == pytest.approx(0.593, abs=0.06)
    assert down / LENGTH == pytest.approx(0.259, abs=0.06)


def test_nodal_volumes_sum_to_the_solid():
    model, _ = column()
    assert nodal_volumes(model).sum() == pytest.approx(LENGTH * WIDTH * DEPTH)
