"""A grasp from rest to grip on a short finger: balance of forces, contact, resuming, bad input."""

import json
import shutil

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.grasp_model import build_grasp
from tubefoot.fea.grasp_rows import judge
from tubefoot.fea.grasp_settings import GraspedObject, GraspSettings
from tubefoot.fea.grasp_solve import first_contact, solve_grasp
from tubefoot.records import read_table

DESIGN = FingerDesign().with_bellows(units=2)
SOLVE = SolveSettings(element_size_mm=4.0, fields="last")


def grasp(**changes):
    thing = {"sizes_mm": (6.2, 9.0, 8.0), "youngs_modulus_kpa": 30.0, "poisson_ratio": 0.45}
    thing |= changes.pop("thing", {})
    table = {
        "object": thing,
        "finger_gap_mm": 6.0,
        "height_mm": 15.0,
        "open_ml": -0.1,
        "states_ml": (0.05, 0.1),
        "stride_ml": 0.05,
        "object_element_mm": 4.0,
    }
    return parse_settings({**table, **changes}, GraspSettings)


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    directory = tmp_path_factory.mktemp("grasp") / "run"
    result = solve_grasp(DESIGN, directory, grasp(), SOLVE)
    return result, read_table(directory / "grasp.csv")


def test_the_finger_opens_free_of_the_object_and_closes_on_it(held):
    result, rows = held
    assert result.converged
    assert result.summary["end_reason"] == "grasp reached"
    free = [row for row in rows if not row["placed"]]
    assert min(row["pumped_volume_ml"] for row in free) == pytest.approx(-0.1)
    assert [row["normal_force_n"] for row in free] == pytest.approx([0.0] * len(free), abs=1e-12)
    closing = [row for row in rows if row["placed"]]
    assert closing[-1]["pumped_volume_ml"] == pytest.approx(0.1)
    forces = np.array([row["normal_force_n"] for row in closing])
    assert (np.diff(forces) > -1e-9).all()
    assert forces[-1] > 0.01
    assert -0.1 < result.summary["first_contact_ml"] < 0.05


def test_what_the_object_bears_is_what_base_and_other_half_hold(held):
    _, rows = held
    for row in rows[-2:]:
        force = row["normal_force_n"]
        assert -row["base_force_n"] == pytest.approx(force, rel=1e-4)
        assert row["middle_force_n"] == pytest.approx(force, rel=1e-4)
        assert row["pressure_mean_kpa"] * row["patch_mm2"] * 1e-3 == pytest.approx(force, rel=1e-7)
        assert row["pressure_mean_kpa"] < row["pressure_p99_kpa"]


def test_the_halves_turn_as_much_as_the_tip(held):
    result, rows = held
    turns = [row["theta1_deg"] + row["theta2_deg"] for row in rows]
    assert turns == pytest.approx(result.column("bend_deg"), abs=1e-6)


def test_the_fluid_is_pushed_out_of_neither_chamber_by_the_object(held):
    result, _ = held
    for name, sign in (("right", 1.0), ("left", -1.0)):
        change = result.column(f"volume_change_{name}_ml")
        assert change == pytest.approx(sign * result.column("pumped_volume_ml"), abs=1e-7)


def test_fields_of_the_object_carry_the_contact_pressure(held):
    pyvista = pytest.importorskip("pyvista")
    result, rows = held
    (path,) = sorted((result.directory / "fields").glob("object_*.vtu"))[-1:]
    grid = pyvista.read(path)
    peak = float(grid.point_data["contact_pressure_kpa"].max())
    # Spread over cells as long as a crest, the pressure at a point is less than that of a sample.
    assert 0.5 * rows[-1]["pressure_mean_kpa"] < peak < rows[-1]["pressure_p99_kpa"]


def test_an_interrupted_grasp_goes_on_where_it_was(held, tmp_path):
    result, rows = held
    directory = tmp_path / "again"
    shutil.copytree(result.directory, directory)
    (directory / "summary.json").unlink()
    last = max((directory / "states").glob("*.npz"))
    last.unlink()
    again = solve_grasp(DESIGN, directory, grasp(), SOLVE)
    found = read_table(directory / "grasp.csv")
    assert len(found) == len(rows)
    # Samples that slid a little over a facet's edge are paired anew: 2e-4 of the force.
    assert found[-1]["normal_force_n"] == pytest.approx(rows[-1]["normal_force_n"], rel=1e-3)
    assert json.loads((directory / "summary.json").read_text())["states"] == len(again.curve)


def test_an_object_that_does_not_fit_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"does not fit .* overlap by"):
        solve_grasp(DESIGN, tmp_path, grasp(thing={"sizes_mm": (12.0, 9.0, 8.0)}, open_ml=-0.01), SOLVE)


def test_a_rigid_object_is_pressed_harder_than_a_soft_one(held, tmp_path):
    _, rows = held
    solve_grasp(DESIGN, tmp_path, grasp(thing={"rigid": True}), SOLVE)
    rigid = read_table(tmp_path / "grasp.csv")[-1]
    assert rigid["normal_force_n"] > 1.05 * rows[-1]["normal_force_n"]
    assert -rigid["base_force_n"] == pytest.approx(rigid["normal_force_n"], rel=1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"states_ml": (0.1, 0.05)}, "must ascend"),
        ({"states_ml": (-0.2, 0.05)}, "must ascend from above open_ml"),
        ({"thing": {"sizes_mm": (2.0, 9.0, 8.0)}}, "at least 4 mm"),
        ({"thing": {"rigid": True, "shape": "ellipsoid"}}, "three equal sizes"),
        ({"thing": {"rounding_mm": 3.0}}, "0.4 of the shortest edge"),
        ({"thing": {"modulus_kpa": 3.0}}, "unknown key"),
    ],
)
def test_settings_that_cannot_be_are_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        grasp(**changes)


def test_a_grasp_is_not_solved_by_pressures():
    with pytest.raises(ConfigError, match="coupled"):
        build_grasp(DESIGN, SolveSettings(cavities="pressure"), grasp())


def placed_rows(*pairs):
    return [{"placed": 1, "pumped_volume_ml": ml, "normal_force_n": force} for ml, force in pairs]


def test_first_contact_is_where_the_line_of_forces_begins():
    assert first_contact(placed_rows((0.0, 0.0), (0.1, 0.0), (0.2, 0.01), (0.3, 0.03))) == pytest.approx(0.15)
    assert first_contact(placed_rows((0.0, 0.0), (0.1, 0.0), (0.2, 0.04), (0.3, 0.05))) == pytest.approx(0.1)
    assert first_contact(placed_rows((0.0, 0.0), (0.1, 0.0))) is None


def test_the_margin_is_that_of_the_bound_that_is_met_first():
    thing = GraspedObject(compression_bound_kpa=3.0, tension_bound_kpa=3.5, force_bound_n=1.0)
    row = {
        "object_compression_p99_kpa": 2.0,
        "object_tension_p99_kpa": 0.5,
        "pressure_p99_kpa": 9.0,
        "normal_force_n": 0.1,
    }
    assert judge(thing, row).margin == pytest.approx(1.5)
    assert judge(thing, row).by == "compression"
    assert judge(thing, {**row, "normal_force_n": 0.0}).margin is None
    assert judge(GraspedObject(), row).margin is None
