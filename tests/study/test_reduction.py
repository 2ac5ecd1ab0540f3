"""Identification: a known law is found again, states are solved once, short fingers speak for long ones."""

import numpy as np
import pytest

from tubefoot.design.finger import load_design
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.solve import solve_design
from tubefoot.reduced.files import reference_file, reference_finger
from tubefoot.reduced.relaxation import MEASURED_C, RelaxingFinger
from tubefoot.study.loaded_finger import Asked, LoadedFinger, UnitState
from tubefoot.study.reduction_content import ReduceSettings, unit_hash
from tubefoot.study.reduction_fit import fit_laws, identified_range, softest, state_error, summarise
from tubefoot.study.reduction_plan import PLAN, Branch
from tubefoot.study.reduction_states import Sampler, SolvedState, StateStore
from tubefoot.units import DEG

REFERENCE = "examples/designs/reference-12.toml"
COARSE_MM = 6.0
SHORT_PLAN = (
    Branch("pump", None, (1.0, -1.0, 0.0, 0.0), 2),
    Branch("pushed", ("pump", 1), (0.5, -0.5, 0.0, -0.2), 2),
)


def made_states(finger, count, seed=0):
    """States of the reduced finger itself, as if solved: random angles and pressures."""
    rng = np.random.default_rng(seed)
    states = []
    for number in range(count):
        angles, pressures = rng.uniform(-0.1, 0.1, finger.n_units), rng.uniform(-0.05, 0.04, 2)
        found = finger.respond(angles, pressures)
        none = np.zeros(finger.n_units)
        unit_state = UnitState(
            angles=angles,
            moments=found.moments,
            shears=none,
            slips=none,
            pressures=pressures,
            volumes=found.volumes,
            energy=found.energy + float(pressures @ found.volumes),
            bend=float(angles.sum()),
            tip=(0.0, 0.0),
            gap=1.0,
        )
        asked = Asked((float(found.volumes[0]), float(found.volumes[1])))
        states.append(SolvedState("made", number, False, asked, unit_state))
    return states


def test_a_known_law_is_found_again():
    """From random states of a 4- and a 6-unit chain, moments and volumes of a 12-unit one within 1e-4."""
    known = reference_finger()
    states = made_states(known.with_units(4), 60) + made_states(known.with_units(6), 40, seed=1)
    content = reference_file()
    inner, base, tip = fit_laws(states)
    for law, name in ((inner, "inner"), (base, "base"), (tip, "tip")):
        assert law.terms == getattr(content, name).to_law().terms
    found = _with_laws(known, inner, base, tip)
    angles, pressures = np.linspace(-0.03, 0.09, 12), np.array([0.03, -0.045])
    one, other = known.respond(angles, pressures), found.respond(angles, pressures)
    assert other.moments == pytest.approx(one.moments, abs=1e-4 * np.abs(one.moments).max())
    assert other.volumes == pytest.approx(one.volumes, rel=1e-4)


def test_fingers_of_one_length_do_not_tell_units_from_ends():
    """Why a second finger is solved: from one length alone the volumes of a longer finger come out wrong."""
    known = reference_finger()
    found = _with_laws(known, *fit_laws(made_states(known.with_units(4), 120)))
    angles, pressures = np.zeros(12), np.array([0.03, 0.03])
    true = known.respond(angles, pressures).volumes
    assert np.abs(found.respond(angles, pressures).volumes / true - 1.0).max() > 0.02


def _with_laws(finger, inner, base, tip):
    from dataclasses import replace

    return replace(finger, inner=inner, base=base, tip=tip)


def test_errors_are_those_planted():
    finger = reference_finger().with_units(4)
    states = made_states(finger, 5)
    clean = [state_error(finger, state) for state in states]
    assert summarise(clean)["bend_deg_max"] < 1e-6
    assert summarise(clean)["pressure_kpa_max"] < 1e-6
    off = [state_error(finger.with_scale(1.1), state) for state in states]
    assert summarise(off)["pressure_kpa_max"] > 0.5
    assert summarise(off)["states"] == 5


def test_too_few_states_are_told():
    with pytest.raises(ConvergenceError, match=r"2 states give .* equations for 74 coefficients"):
        fit_laws(made_states(reference_finger().with_units(4), 2))


def test_shipped_law_is_stable_over_its_range():
    stiffness, compliance = softest(reference_finger())
    assert stiffness > 0.05
    assert compliance > 0.05


def test_range_is_that_of_the_states():
    states = made_states(reference_finger().with_units(4), 10)
    valid = identified_range(states)
    assert valid.angle == max(np.abs(state.found.angles).max() for state in states)
    assert valid.pressure_low == min(state.found.pressures.min() for state in states)


@pytest.mark.parametrize("units", [3, 6, 12])
def test_shipped_file_belongs_to_the_reference_designs(units):
    design = load_design(f"examples/designs/reference-{units}.toml")
    assert reference_file().provenance["design_sha256"] == unit_hash(design)


def test_hash_sees_walls_and_moduli_not_names():
    design = load_design(REFERENCE)
    assert unit_hash(design.model_copy(update={"name": "other"})) == unit_hash(design)
    assert unit_hash(design.with_bellows(fold_wall_mm=1.6)) != unit_hash(design)
    softer = design.model_copy(update={"body": design.body.model_copy(update={"scale": 0.7})})
    assert unit_hash(softer) != unit_hash(design)


def test_plan_starts_from_branches_that_come_before():
    seen = {}
    for branch in PLAN:
        if branch.start is not None:
            name, number = branch.start
            assert number <= seen[name]
        seen[branch.name] = branch.steps
    assert any(branch.check for branch in PLAN)


def test_longer_finger_must_be_longer():
    with pytest.raises(ValueError, match="long_units = 4 must be more than units = 4"):
        ReduceSettings(units=4, long_units=4)


@pytest.fixture(scope="module")
def short_design():
    return load_design(REFERENCE).with_bellows(units=1)


def sampled(design, store, plan=SHORT_PLAN, progress=None):
    sampler = Sampler(design, COARSE_MM, store, progress)
    solved = []
    solve = sampler.finger.solve
    sampler.finger.solve = lambda asked, guess: solved.append(asked) or solve(asked, guess)
    return sampler.run(plan, 0.01), len(solved)


def test_interrupted_sampling_goes_on_where_it_was(tmp_path, short_design):
    """A run killed after its first state ends with the same states as one never killed."""
    whole, all_solved = sampled(short_design, StateStore(tmp_path / "whole", {"a": 1}))

    class Killed(Exception):
        pass

    def kill(_):
        raise Killed

    with pytest.raises(Killed):
        sampled(short_design, StateStore(tmp_path / "cut", {"a": 1}), progress=kill)
    known = len(list((tmp_path / "cut").glob("*.npz")))
    again, solved = sampled(short_design, StateStore(tmp_path / "cut", {"a": 1}))
    assert solved == all_solved - known
    bends = [[state.found.bend for state in one.states] for one in (again, whole)]
    assert bends[0] == pytest.approx(bends[1], abs=1e-9)
    assert whole.ended == {}
    _, repeated = sampled(short_design, StateStore(tmp_path / "whole", {"a": 1}))
    assert repeated == 0


def test_states_of_another_design_are_not_mixed_in(tmp_path):
    StateStore(tmp_path / "states", {"design": "one"})
    with pytest.raises(ConfigError, match="another design or of other settings; choose another --out"):
        StateStore(tmp_path / "states", {"design": "two"})


def test_a_branch_that_cannot_go_on_is_named(tmp_path, short_design):
    plan = (
        Branch("crush", None, (0.0, -40.0, 0.0, 0.0), 2),
        Branch("after", ("crush", 2), (0.0, -50.0, 0.0, 0.0), 1),
    )
    found, _ = sampled(short_design, StateStore(tmp_path / "states", {}), plan)
    assert found.states == [] or found.states[-1].step < 2
    assert "beyond step" in found.ended["crush"]
    assert found.ended["after"] == "the branch `crush` ended before its state 2"


def test_tip_couple_does_the_work_that_the_finger_stores(short_design):
    """Chambers closed: strain energy between two close couples = the work of both halves' tractions."""
    finger = LoadedFinger(short_design, COARSE_MM)
    rises, energies, guess = [], [], finger.rest()
    for couple in (0.9, 1.1):
        asked = Asked((0.0, 0.0), couple=couple)
        step = finger.solve(asked, guess)
        guess = step.state
        found = finger.measure(asked, step)
        assert found.moments[0] == pytest.approx(couple, rel=0.01)
        energies.append(found.energy)
        rises.append(mean_rise(finger, "tip_right", guess) - mean_rise(finger, "tip_left", guess))
    push = 1.0 / mean_place(finger, "tip_right") / 2
    assert push * (rises[1] - rises[0]) == pytest.approx(energies[1] - energies[0], rel=1e-4)


def tip_areas(finger, facets):
    """Points of a facet set of 9-node facets, and the share of the area that each carries."""
    nodes = finger.mesh.facet_set(facets).nodes
    weights = np.outer(SIMPSON, SIMPSON).ravel()[LEXICOGRAPHIC]
    size = np.ptp(finger.mesh.points[nodes][:, :4], axis=1)[:, :2].prod(axis=1)
    return nodes, size[:, None] * weights


SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0
LEXICOGRAPHIC = [0, 2, 8, 6, 1, 5, 7, 3, 4]


def mean_rise(finger, facets, state):
    nodes, areas = tip_areas(finger, facets)
    return float((areas * state.unknowns[3 * nodes + 2]).sum() / areas.sum())


def mean_place(finger, facets):
    nodes, areas = tip_areas(finger, facets)
    return float((areas * finger.mesh.points[nodes, 0]).sum() / areas.sum())


def test_transverse_force_has_its_lever(short_design):
    """A small tip force makes force x distance to the tip face at the unit's middle, and pushes to -x."""
    finger = LoadedFinger(short_design, COARSE_MM)
    asked = Asked((0.0, 0.0), force=0.01)
    found = finger.measure(asked, finger.solve(asked, finger.rest()))
    assert found.moments[0] == pytest.approx(0.01 * (3.5 + 4.0), rel=1e-3)
    assert found.bend > 0.0
    assert found.tip[0] < 0.0


@pytest.mark.slow
def test_shipped_law_meets_fresh_finite_element_states():
    """Part of what made the shipped file, solved anew on the same mesh, and a 5-unit finger it never saw."""
    design = load_design(REFERENCE)
    law = reference_finger()
    for units, asked_states in (
        (4, [Asked((240.0, -240.0)), Asked((240.0, -240.0), couple=-2.0)]),
        (5, [Asked((200.0, -120.0)), Asked((200.0, -120.0), force=0.05)]),
    ):
        finger = LoadedFinger(
            design.with_bellows(units=units), reference_file().provenance["element_size_mm"]
        )
        guess = finger.rest()
        for asked in asked_states:
            guess = finger.solve(asked, guess).state
            state = SolvedState("fresh", 1, True, asked, finger.measure(asked, finger.solve(asked, guess)))
            error = state_error(law.with_units(units), state)
            assert abs(error.bend_deg) < 0.3
            assert error.pressure_kpa < 0.3
            assert error.volume_ml < 0.002


@pytest.mark.slow
def test_memory_agrees_with_a_viscoelastic_solve(tmp_path):
    """3 units, pressures ramped in 0.5 s and held for 10 s: creep as the finite-strain solve in time has it.

    Under a tenth at first (there the bulk, which does not relax, gives way in the solve), 3 % in the end:
    measured 2.2 %, with the coarse time steps of four states.
    """
    settings = SolveSettings(
        target=20.0,
        cavities="pressure",
        left_over_right=-1.2,
        viscoelastic=True,
        ramp_s=0.5,
        hold_s=10.0,
        hold="goal",
        fields="none",
        states=4,
    )
    solved = solve_design(load_design("examples/designs/reference-3.toml"), tmp_path / "solve", settings)
    times, bends = solved.column("time_s"), solved.column("bend_deg")
    wall = RelaxingFinger(reference_finger().with_units(3), reference_file().to_prony(MEASURED_C))
    angles, found, now = np.zeros(3), [], 0.0
    for time in times[1:]:
        for fine in np.linspace(now, time, 9)[1:]:
            pressures = min(fine / 0.5, 1.0) * np.array([0.020, -0.024])
            for _ in range(6):
                answer = wall.respond(angles, pressures, fine - now)
                angles = angles - answer.moments / answer.stiffness
            wall.commit(angles, pressures, fine - now)
            now = fine
        found.append(angles.sum() / DEG)
    assert found == pytest.approx(bends[1:], rel=0.1)
    assert found[-1] == pytest.approx(bends[-1], rel=0.03)
