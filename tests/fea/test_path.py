"""The path: predictor, landing on limits, folds and snaps of a balloon, named ends."""

import re
from dataclasses import replace

import numpy as np
import pytest

from octant import sphere_octant
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConvergenceError
from tubefoot.fea.arc import Arc
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.items import State
from tubefoot.fea.landing import Limit, passed
from tubefoot.fea.path import follow
from tubefoot.fea.predictor import best_degree, predict
from tubefoot.fea.settle import Settler
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import Step, StepFailed
from tubefoot.fea.stride import StepControl

NEO_HOOKEAN = OgdenLaw((0.4,), (2.0,), 400.0)
"""Its balloon has one pressure maximum and gets ever softer beyond."""
STIFFENING = OgdenLaw((0.4, 0.012), (2.0, 6.0), 400.0)
"""Its balloon stiffens again beyond the maximum: under a rising pressure it snaps to a larger size."""


def state(parameter, *unknowns):
    return State(np.array(unknowns, float), np.array([2.0 * parameter]), parameter)


def step(parameter, *unknowns):
    return Step(state(parameter, *unknowns), 3, 0.0, 1.0, np.array([10.0 + parameter]))


def balloon(law, drive):
    mesh = sphere_octant("hexahedron27", 1.0, 1.3, 1, 1)
    held = {axis: mesh.facet_set(f"{name}_min").points for axis, name in enumerate("xyz")}
    return Model(
        mesh, [Solid(mesh, {"*": law}, pressure="linear")], held, [Cavity(mesh, "inside", 0)],
        Drive((drive,), (1.0,)),
    )  # fmt: skip


def test_the_predictor_takes_the_degree_that_foretold_the_last_state():
    at = [0.0, 0.5, 0.8, 1.3, 1.7]
    cubic = [step(s, s**3 - s, 2.0 * s) for s in at]
    assert best_degree(cubic) == 3
    assert predict(cubic, 2.0).unknowns == pytest.approx([6.0, 4.0])
    # A kink before the last state: what was learnt further back misleads.
    kinked = [step(s, s**3 if s < 1 else 1.0 - 5.0 * (s - 1.0)) for s in (0.0, 0.4, 0.7, 1.0, 1.2, 1.4)]
    assert best_degree(kinked) == 1
    assert predict(kinked, 1.6).unknowns == pytest.approx([-2.0])


def test_a_single_state_predicts_itself():
    assert predict([step(0.3, 1.0, 2.0)], 0.5).unknowns == pytest.approx([1.0, 2.0])


def test_a_single_state_with_a_tangent_predicts_along_it():
    known = replace(step(0.3, 1.0, 2.0), tangent=State(np.array([0.2, -0.4]), np.array([1.0]), 0.1))
    found = predict([known], 0.5)
    assert found.unknowns == pytest.approx([1.4, 1.2])
    assert found.pressures == pytest.approx([2.6])
    assert found.parameter == pytest.approx(0.5)


@pytest.mark.parametrize("short", [1e-16, 1e-12, -1e-12])
def test_a_state_on_a_limit_up_to_roundoff_has_reached_it(short):
    model = balloon(NEO_HOOKEAN, "pressure")
    goal = Limit(Control("parameter", 0.1), "there")
    before, after = step(0.05, 0.0), step(0.1 * (1.0 - short), 0.0)
    found = passed(model, [goal], before, after)
    assert found is not None
    assert found[0] is goal
    # It is where the path begins then, and not passed again.
    assert passed(model, [goal], after, step(0.15, 0.0)) is None
    assert passed(model, [goal], step(0.02, 0.0), before) is None


def test_of_two_limits_passed_the_nearer_one_counts():
    model = balloon(NEO_HOOKEAN, "pressure")
    near, far = (Limit(Control("pressure", 2.0 * s), str(s)) for s in (0.06, 0.08))
    limit, at = passed(model, [far, near], step(0.05, 0.0), step(0.1, 0.0))
    assert limit is near
    assert at == pytest.approx(0.06)


def test_a_path_of_one_state_ends_at_its_goal():
    model = balloon(NEO_HOOKEAN, "pressure")
    path = follow(model, Limit(Control("parameter", 0.01), "there"), stepping=StepControl(states=1))
    assert path.end_reason == "there"
    assert [s.state.parameter for s in path.steps] == pytest.approx([0.0, 0.01])


def test_a_chamber_counts_as_collapsed_at_the_volume_that_the_message_names(reference):
    finger = build_finger(reference.with_bellows(units=1), SolveSettings(element_size_mm=6.0))
    collapses = [limit for limit in finger.limits if "collapse" in limit.reason]
    assert [limit.control.cavity for limit in collapses] == [0, 1]
    for limit in collapses:
        named = re.search(r"([\d.]+) mm apart on average, ([\d.]+) % of its volume left", limit.reason)
        cavity = finger.model.cavities[limit.control.cavity]
        left = cavity.rest_volume + limit.control.target
        assert left / cavity.rest_volume == pytest.approx(float(named[2]) / 100, abs=5e-4)
        # Of two walls at a distance h, each of area A / 2, V = h A / 2.
        walls = finger.mesh.facet_set(("cavity_right", "cavity_left")[limit.control.cavity])
        corners = finger.mesh.points[walls.nodes[:, :4]]
        across = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        area = 0.5 * np.linalg.norm(across, axis=1).sum()
        assert 2.0 * left / area == pytest.approx(float(named[1]), rel=1e-3)
        assert limit.control.quantity == "volume_change"


@pytest.mark.parametrize(
    ("bellows", "apart", "left"),
    [
        ({"height_mm": 16.0, "chamber_gap_mm": 5.0}, 0.2, 8.2),
        ({}, 0.174, 10.0),
        ({"height_mm": 5.0, "side_wall_mm": 2.0}, 0.1, 14.1),
    ],
    ids=["wide", "usual", "low"],
)
def test_a_collapsed_chamber_has_a_tenth_left_at_most_or_its_walls_at_the_reach(bellows, apart, left):
    design = FingerDesign.model_validate({"name": "one", "bellows": {"units": 1, **bellows}})
    finger = build_finger(design, SolveSettings(element_size_mm=6.0))
    reason = next(limit.reason for limit in finger.limits if "collapse" in limit.reason)
    named = re.search(r"([\d.]+) mm apart on average, ([\d.]+) % of its volume left", reason)
    assert (float(named[1]), float(named[2])) == (apart, left)


@pytest.fixture(scope="module")
def inflated():
    """The neo-Hookean balloon pumped past its pressure maximum."""
    model = balloon(NEO_HOOKEAN, "volume")
    rest = model.rest_volumes[0]
    return follow(model, Limit(Control("parameter", 8.0 * rest), "full"), stepping=StepControl(states=24))


def pressures(path):
    return np.array([s.state.pressures[0] for s in path.steps])


def test_a_pumped_balloon_passes_its_pressure_maximum_without_a_snap(inflated):
    assert inflated.end_reason == "full"
    peak = int(np.argmax(pressures(inflated)))
    assert 1 < peak < len(inflated.steps) - 2
    assert not any(s.event for s in inflated.steps)
    assert all(s.unstable == 0 for s in inflated.steps[1:])


def test_a_pressed_balloon_that_bursts_ends_by_instability_at_its_maximum(inflated):
    """No stable state is beyond: the end is named, at the limit point of the pressure, with its evidence."""
    model = balloon(NEO_HOOKEAN, "pressure")
    path = follow(model, Limit(Control("parameter", 1.0), "burst"), stepping=StepControl(states=12))
    named = re.match(r"instability: fold of the path in its parameter at ([\d.]+)", path.end_reason)
    assert float(named[1]) == pytest.approx(pressures(inflated).max(), rel=0.01)
    # The states on the way are stable ones, below the maximum.
    assert (pressures(path) < pressures(inflated).max() * (1 + 1e-3)).all()
    assert model.linearise(path.steps[-1].state) == 0


def test_an_arc_goes_around_the_pressure_maximum_onto_the_falling_branch(inflated):
    model = balloon(NEO_HOOKEAN, "pressure")
    top = pressures(inflated).max()
    start = follow(model, Limit(Control("parameter", 0.8 * top), "there"), stepping=StepControl(states=4))
    steps = list(Arc(model, *(s.state for s in start.steps[-2:])).steps(16))
    turned = np.diff([s.state.parameter for s in steps]) < 0
    assert turned.any()
    assert not turned[0]
    # Beyond the fold one direction is unstable under given pressure, before it none is.
    assert model.linearise(steps[0].state) == 0
    assert model.linearise(steps[-1].state) == 1
    # The states are those that pumping finds.
    volumes, found = np.array([(s.volumes[0], s.state.pressures[0]) for s in inflated.steps]).T
    for s in steps:
        if s.volumes[0] < volumes[-1]:
            expected = np.interp(s.volumes[0], volumes, found)
            assert s.state.pressures[0] == pytest.approx(expected, rel=0.03)


def test_a_pressed_balloon_that_stiffens_snaps_and_goes_on():
    model = balloon(STIFFENING, "pressure")
    pumped = balloon(STIFFENING, "volume")
    rest = pumped.rest_volumes[0]
    slow = follow(pumped, Limit(Control("parameter", 80.0 * rest), "full"), stepping=StepControl(states=40))
    top = pressures(slow)[1:-1][np.diff(np.sign(np.diff(pressures(slow)))) < 0][0]
    path = follow(model, Limit(Control("parameter", 1.2 * top), "there"), stepping=StepControl(states=8))
    assert path.end_reason == "there"
    snaps = [k for k, s in enumerate(path.steps) if s.event]
    assert len(snaps) == 1
    assert path.steps[snaps[0]].event.startswith("snap: ")
    before, after = path.steps[snaps[0] - 1], path.steps[snaps[0]]
    # A jump counts as located in a quarter of the first step, here 1.2 / 8 of the maximum.
    assert before.state.parameter == pytest.approx(top, rel=1.2 / 8 / 4)
    assert after.volumes[0] > 2.0 * before.volumes[0]
    # It came to rest on the branch that pumping finds.
    volumes = [s.volumes[0] for s in slow.steps]
    assert after.state.pressures[0] == pytest.approx(
        np.interp(after.volumes[0], volumes, pressures(slow)), rel=0.02
    )


def test_without_a_stable_state_there_is_no_rest():
    model = balloon(NEO_HOOKEAN, "pressure")
    start = follow(model, Limit(Control("parameter", 0.05), "there"), stepping=StepControl(states=2))
    with pytest.raises(StepFailed):
        Settler(model).advance(start.steps[-1], Control("parameter", 1.0))


def test_a_numerical_failure_is_no_instability(monkeypatch):
    """Nothing converges any more, and nothing says that the balance was lost: the path breaks off."""
    model = balloon(NEO_HOOKEAN, "volume")
    factorise = model.factorise

    def fails_later(borders):
        if model.timings.factorisations > 6:
            raise StepFailed("out of order")
        factorise(borders)

    monkeypatch.setattr(model, "factorise", fails_later)
    rest = model.rest_volumes[0]
    with pytest.raises(ConvergenceError, match=r"could not be followed beyond.*out of order") as caught:
        follow(model, Limit(Control("parameter", 2.0 * rest), "full"), stepping=StepControl(states=6))
    assert len(caught.value.last_state.steps) >= 2


def test_after_a_long_fall_the_next_steps_fall_at_once_to_the_same_states(monkeypatch):
    def goal(model):
        return Limit(Control("parameter", 0.5 * model.rest_volumes[0]), "full")

    model = balloon(NEO_HOOKEAN, "volume")
    solved = follow(model, goal(model), stepping=StepControl(states=4))
    model = balloon(NEO_HOOKEAN, "volume")
    tried, solve = [], model.solve

    def fails_at_the_second_step(*arguments):
        tried.append(arguments)
        if len(tried) == 2:
            raise StepFailed("no convergence")
        return solve(*arguments)

    monkeypatch.setattr(model, "solve", fails_at_the_second_step)
    monkeypatch.setattr("tubefoot.fea.path.EASY", 0)  # every fall is a long one
    fallen = follow(model, goal(model), stepping=StepControl(states=4))
    assert fallen.end_reason == "full"
    assert len(fallen.steps) > 3
    assert len(tried) == 2
    assert fallen.steps[-1].state.pressures == pytest.approx(solved.steps[-1].state.pressures, rel=1e-6)
