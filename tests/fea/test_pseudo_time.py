"""Falling to rest: where Newton's method ends if that finds it, in a stable equilibrium if not."""

import numpy as np
import pytest

from mapped_box import mapped_box, plane
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.pseudo_time import PseudoTime, _Drag, _Way
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


class Slipping:
    """A contact that presses with no force and is very unstable until the head leans so far."""

    convex = False

    def __init__(self, mesh, until):
        self.until = until
        self.numbers = 3 * mesh.facet_set("head").points
        self.pattern = self.numbers[:, None]
        self.counted = []

    def look(self, state):
        return False

    def assemble(self, state, sink, found):
        slips = state.unknowns[self.numbers].mean() < self.until
        if sink.stiff:
            self.counted.append((slips, self.convex))
        stiffness = -1e3 if slips and not self.convex else 0.0
        sink.add(self, 0, np.full((len(self.numbers), 1, 1), stiffness), np.zeros((len(self.numbers), 1)))

    def recover(self, step):
        pass


def test_contacts_count_without_their_negative_stiffness_where_they_would_be_unstable(column, monkeypatch):
    bare, along, step = column
    along.scale = 0.8
    solved = bare.solve(step.state, STILL)
    assert lean(bare, step) < 0.5 * lean(bare, solved)
    slipping = Slipping(bare.mesh, 0.5 * lean(bare, solved))
    clamped = dict.fromkeys(range(3), bare.mesh.facet_set("foot").points)
    model = Model(bare.mesh, bare.solids, clamped, others=[*bare.items[1:], slipping])
    along.scale, slipping.convex = 0.3, True
    model.slope_at_rest(Control("parameter", 1.0))
    along.scale, slipping.convex = 0.8, False
    time, raised = PseudoTime(model), []
    monkeypatch.setattr("tubefoot.fea.pseudo_time._Drag.raise_density", lambda drag: raised.append(drag))
    slipping.counted.clear()
    rested = time.fall(step.state, STILL, time.softness(step))
    assert rested.state.unknowns == pytest.approx(solved.state.unknowns, abs=1e-6 * LENGTH)
    assert not raised
    assert (True, True) in slipping.counted
    assert slipping.counted[-1] == (False, False)


def test_a_step_three_times_too_long_is_cut_to_its_length(column):
    model, along, step = column
    along.scale = 0.31
    time, drag = PseudoTime(model), _Drag(0.0, 1.0)
    model.evaluate(step.state)
    borders = model.borders(step.state, STILL)
    time._hold(step.state, borders, drag)
    way = time._way(step.state, borders)
    assert way.slope(model.system.residual, 0.0) == pytest.approx(-1.0)
    long = _Way(way.part(3.0), way.free, 3.0 * way.press, 3.0 * way.downhill)
    moved, _ = time._gone(step.state, long, drag)
    assert drag.too_far
    change = moved.unknowns - step.state.unknowns
    assert change[way.free] == pytest.approx(way.step.unknowns[way.free], rel=0.1, abs=1e-9)
    drag.adapt(1.0)
    assert drag.density == 0.0
    time._gone(step.state, way, drag)
    assert not drag.too_far
