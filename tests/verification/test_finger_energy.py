"""A coarse finger as a machine: work of both fluids, reversal of the pump, the coupling of the chambers."""

from pathlib import Path

import numpy as np
import pytest

from tubefoot.design.finger import load_design
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive, air_uptake
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh, mirror_points
from tubefoot.fea.items import State
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import Tolerance

REFERENCE = Path(__file__).parents[2] / "examples" / "designs" / "reference-3.toml"


@pytest.fixture(scope="module", params=[1, pytest.param(3, marks=pytest.mark.slow)])
def design(request):
    return load_design(REFERENCE).with_bellows(units=request.param)


@pytest.fixture(scope="module")
def mesh(design):
    return finger_mesh(design.profile, 4.0)


def finger_model(design, mesh, air=(0.0, 0.0), tolerance=None):
    body = design.body
    law = OgdenLaw(tuple(body.mu_mpa), tuple(body.alpha), body.bulk_modulus_mpa)
    cavities = [Cavity(mesh, "cavity_right", 0, air[0]), Cavity(mesh, "cavity_left", 1, air[1])]
    solid = Solid(mesh, {"*": law})
    return Model(mesh, [solid], clamp_half_finger(mesh), cavities, Drive.pump(), tolerance=tolerance)


def follow(model, pumped):
    """Converged steps at each pumped volume [mm^3], by secant prediction."""
    state = before = model.rest()
    steps = []
    for target in pumped:
        guess = State(
            2 * state.unknowns - before.unknowns,
            2 * state.pressures - before.pressures,
            2 * state.parameter - before.parameter,
        )
        steps.append(model.solve(guess, Control("parameter", target)))
        before, state = state, steps[-1].state
    return steps


def test_work_of_both_fluids_is_the_strain_energy_along_the_path(design, mesh):
    model = finger_model(design, mesh)
    steps = follow(model, np.linspace(0.0, 0.25 * model.rest_volumes[0], 13)[1:])
    pressures = np.vstack([np.zeros(2), *(step.state.pressures for step in steps)])
    volumes = np.vstack([model.rest_volumes, *(step.volumes for step in steps)])
    assert pressures[-1, 0] > 0.015 > 0 > pressures[-1, 1]
    energy = np.array([step.energy for step in steps])
    # Simpson's rule over pairs of equal steps: each fluid's volume is linear in the path parameter.
    pairs = (
        (pressures[:-2:2] + 4 * pressures[1:-1:2] + pressures[2::2]) / 6 * (volumes[2::2] - volumes[:-2:2])
    )
    work = np.cumsum(pairs.sum(axis=1))
    assert work == pytest.approx(energy[1::2], rel=2e-4)
    assert (np.diff(energy) > 0).all()


def test_what_leaves_one_chamber_enters_the_other(design, mesh):
    model = finger_model(design, mesh)
    (step,) = follow(model, [30.0])
    assert step.volumes - model.rest_volumes == pytest.approx([30.0, -30.0], rel=1e-6)


def test_air_columns_take_their_share_of_the_pumped_volume(design, mesh):
    air = (300.0, 500.0)
    model = finger_model(design, mesh, air)
    step = follow(model, [20.0, 40.0])[-1]
    uptakes = [air_uptake(p, v)[0] for p, v in zip(step.state.pressures, air, strict=True)]
    assert abs(uptakes[0]) > 1.0
    assert step.volumes - model.rest_volumes + uptakes == pytest.approx([40.0, -40.0], rel=1e-6)


def test_reversing_the_pump_mirrors_the_result(design, mesh):
    tight = Tolerance(force=1e-11, volume=1e-12)
    forward = follow(finger_model(design, mesh, tolerance=tight), [30.0, 60.0])[-1]
    backward = follow(finger_model(design, mesh, tolerance=tight), [-30.0, -60.0])[-1]
    n = mesh.points.size
    there, back = (step.state.unknowns[:n].reshape(-1, 3) for step in (forward, backward))
    assert np.abs(there[:, 0]).max() > 1.0
    mirrored = there[mirror_points(mesh)] * [-1.0, 1.0, 1.0]
    assert np.abs(back - mirrored).max() < 1e-8 * np.abs(there).max()
    assert backward.state.pressures == pytest.approx(forward.state.pressures[::-1], rel=1e-8)
    assert backward.energy == pytest.approx(forward.energy, rel=1e-8)


def test_positive_pumping_bends_the_tip_towards_the_left_chamber(design, mesh):
    (step,) = follow(finger_model(design, mesh), [40.0])
    tip = mesh.facet_set("tip").points
    assert step.state.unknowns[3 * tip].mean() < -0.1
