"""Falling to rest: where Newton's method ends if that finds it, in a stable equilibrium if not."""

import numpy as np
import pytest

from mapped_box import mapped_box, plane
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.pseudo_time import PseudoTime
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import StepFailed
from tubefoot.fea.traction import Traction

LENGTH, WIDTH, DEPTH = 12.0, 1.0, 2.0
LAW = OgdenLaw((0.5,), (2.0,), 500.0)
EULER = np.pi**2 * 1.5 * DEPTH * WIDTH**3 / 12 / (4 * LENGTH**2)
"""Load under which the column buckles [N]; E = 3 mu."""
STILL = Control("parameter", 0.0)


@pytest.fixture
def column():
    places = {"foot": plane(2, 0.0), "head": plane(2, LENGTH)}
    mesh = mapped_box("hexahedron27", (1, 1, 4), lambda p: p * [WIDTH, DEPTH, LENGTH], places)
    along = Traction(mesh, "head", (0.0, 0.0, -EULER / WIDTH / DEPTH))
    across = Traction(mesh, "head", (1e-3 * EULER / WIDTH / DEPTH, 0.0, 0.0))
    model = Model(
        mesh,
        [Solid(mesh, {"*": LAW}, pressure="linear")],
        dict.fromkeys(range(3), mesh.facet_set("foot").points),
        others=[along, across],
    )
    model.slope_at_rest(Control("parameter", 1.0))
    along.scale = 0.3
    step = model.solve(model.rest(), STILL)
    return model, along, step


def lean(model, step):
    head = model.mesh.facet_set("head").points
    return float(step.state.unknowns[3 * head].mean())


def test_below_the_critical_load_it_rests_where_newton_ends(column):
    model, along, step = column
    along.scale = 0.8
    time = PseudoTime(model)
    rested = time.fall(step.state, STILL, time.softness(step))
    solved = model.solve(step.state, STILL)
    assert np.abs(rested.state.unknowns - solved.state.unknowns).max() < 1e-6 * LENGTH
    assert rested.energy == pytest.approx(solved.energy, rel=1e-6)
    assert rested.unstable == 0


def test_beyond_it_the_fall_ends_bent_and_stable(column):
    """Newton's method finds the column leaning against its side force there, or nothing at all."""
    model, along, step = column
    along.scale = 1.3
    time = PseudoTime(model)
    rested = time.fall(step.state, STILL, time.softness(step))
    assert rested.unstable == 0
    assert model.linearise(rested.state) == 0
    assert lean(model, rested) > 0.5 * LENGTH


def test_without_a_deformed_state_there_is_no_measure_for_the_drag(column):
    model, _, _ = column
    with pytest.raises(StepFailed, match="not deformed"):
        PseudoTime(model).fall(model.rest(), STILL, 0.0)
