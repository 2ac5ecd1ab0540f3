"""Any solid through the solve stage: the same result as the finger's own model, files, errors, resumption."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from tubefoot.cli.main import app
from tubefoot.config import load_settings, parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.path import follow
from tubefoot.fea.recorder import CURVE_COLUMNS
from tubefoot.fea.solid_part import SetNames, SolidPart, build_part, load_part
from tubefoot.fea.solve_part import solve_part
from tubefoot.fea.stride import StepControl
from tubefoot.records import read_table

EXAMPLE = Path(__file__).parents[2] / "examples" / "solids" / "eccentric-tube.toml"
DESIGN = FingerDesign().with_bellows(units=1)
COARSE = SolveSettings(target=6.0, states=2, element_size_mm=3.5, fields="last")


def write_vtu(path: Path, mesh: Mesh, roles: dict[str, str]) -> Path:
    """A mesh with its regions and with facets as cells of their own, flagged by name."""
    block = mesh.blocks[0]
    names = list(roles)
    cells = [(block.kind, block.nodes)]
    cells += [(mesh.facet_set(roles[name]).kind, mesh.facet_set(roles[name]).nodes) for name in names]
    flags = {
        name: [np.full(len(nodes), int(number == 1 + k)) for number, (_, nodes) in enumerate(cells)]
        for k, name in enumerate(names)
    }
    for number, region in enumerate(mesh.regions):
        flags[region] = [(block.region == number).astype(int)] + [
            np.zeros(len(nodes), int) for _, nodes in cells[1:]
        ]
    meshio.Mesh(mesh.points, cells, cell_data=flags).write(path)
    return path


@pytest.fixture(scope="module")
def finger():
    return build_finger(DESIGN, COARSE)


@pytest.fixture(scope="module")
def finger_file(finger, tmp_path_factory):
    roles = {"bottom": "base", "tip": "tip", "wall_r": "cavity_right", "wall_l": "cavity_left"}
    roles |= {"mid_plane": "mid_plane"}
    return write_vtu(tmp_path_factory.mktemp("vtu") / "finger.vtu", finger.mesh, roles)


def finger_part(path):
    sets = SetNames(base="bottom", cavity_right="wall_r", cavity_left="wall_l")
    return SolidPart(name="finger", mesh=str(path), sets=sets, body=DESIGN.body)


def test_a_finger_read_from_a_file_is_solved_as_the_design_is(finger, finger_file):
    part = build_part(finger_part(finger_file), COARSE)
    assert part.share == 0.5
    assert sorted(part.mesh.regions) == sorted(finger.mesh.regions)
    ends = []
    for model in (part, finger):
        step = follow(model.model, model.goal, model.limits, StepControl(states=2)).steps[-1]
        ends.append(
            (*step.state.pressures, step.state.parameter, step.energy, model.tip(step.state.unknowns)[0])
        )
    assert ends[0][0] == pytest.approx(0.006)
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


@pytest.mark.parametrize(
    ("until", "target"), [("volume_change_left_ml", -0.01), ("pumped_volume_ml", 0.02), ("bend_deg", -0.5)]
)
def test_goals_are_those_of_the_whole_part(finger_file, tmp_path, until, target):
    """Half of it is solved; volumes are of the whole."""
    settings = COARSE.model_copy(update={"until": until, "target": target, "fields": "none"})
    result = solve_part(finger_part(finger_file), tmp_path, settings)
    assert result.curve[-1][until] == pytest.approx(target, rel=1e-6)
    assert result.summary["end_reason"] == "goal reached"


@pytest.fixture(scope="module")
def tube(tmp_path_factory):
    directory = tmp_path_factory.mktemp("tube")
    return solve_part(load_part(EXAMPLE), directory, SolveSettings(target=10.0, states=2, fields="last"))


def test_a_tube_with_one_chamber_bends_away_from_its_thin_wall(tube):
    """And lengthens; the work of the fluid is the strain energy (trapezoid over a nearly straight path)."""
    table = read_table(tube.directory / "curve.csv")
    assert list(table[0]) == list(CURVE_COLUMNS)
    last = tube.curve[-1]
    assert last["pressure_right_kpa"] == pytest.approx(10.0)
    assert last["pressure_left_kpa"] == last["volume_change_left_ml"] == 0.0
    assert last["bend_deg"] > 0.3
    assert last["theta1_deg"] + last["theta2_deg"] == pytest.approx(last["bend_deg"])
    assert 0.3 < last["theta1_deg"] / last["bend_deg"] < 0.7
    assert last["tip_x_mm"] < 0.0
    pressure, volume = tube.column("pressure_right_kpa"), tube.column("volume_change_right_ml")
    assert last["strain_energy_mj"] == pytest.approx(np.trapezoid(pressure, volume), rel=0.01)
    assert tube.summary["modelled_share"] == 0.5
    assert tube.summary["chambers_ml"] == pytest.approx([np.pi * 9 * 54e-3], rel=2e-3)
    rows = read_table(tube.directory / "regions.csv")
    assert rows[-1]["volume_mm3"] == pytest.approx(np.pi * (25 * 60 - 9 * 54), rel=2e-3)
    for name in ("run.toml", "summary.json", "units.csv", "fields.pvd"):
        assert (tube.directory / name).exists(), name


def test_a_finished_run_is_not_solved_again_and_another_mesh_is_not_mixed_in(tube, tmp_path):
    settings = SolveSettings(target=10.0, states=2, fields="last")
    again = solve_part(load_part(EXAMPLE), tube.directory, settings, progress=lambda _: pytest.fail("solved"))
    assert again.summary["bend_deg"] == tube.summary["bend_deg"]
    mesh = tmp_path / "tube.msh"
    mesh.write_text(Path(load_part(EXAMPLE).mesh).read_text() + "\n")
    other = load_part(EXAMPLE).model_copy(update={"mesh": str(mesh)})
    with pytest.raises(ConfigError, match="add --overwrite"):
        solve_part(other, tube.directory, settings)


def test_an_interrupted_run_goes_on(tube, tmp_path):
    settings = SolveSettings(target=10.0, states=2, fields="last")

    class Interrupted(Exception):
        pass

    def interrupt(row):
        if row["step"] == 1:
            raise Interrupted

    with pytest.raises(Interrupted):
        solve_part(load_part(EXAMPLE), tmp_path, settings, progress=interrupt)
    rows = []
    result = solve_part(load_part(EXAMPLE), tmp_path, settings, progress=rows.append)
    assert rows[0]["step"] == 2
    assert result.summary["bend_deg"] == pytest.approx(tube.summary["bend_deg"], rel=1e-9)


@pytest.mark.parametrize(
    "option",
    [
        {"viscoelastic": True},
        {"rigid_parts": "modelled"},
        {"cavities": "filtered"},
        {"ports": True, "mesh_kind": "tetrahedra"},
    ],
    ids=lambda option: next(iter(option)),
)
def test_options_of_designs_are_refused(option, tmp_path):
    with pytest.raises(ConfigError, match=f"{next(iter(option))}.* is an option of designs"):
        solve_part(load_part(EXAMPLE), tmp_path, SolveSettings(**option))


def test_the_verb_solves_a_solid_and_says_what_is_missing(tmp_path, capsys):
    options = ["--until", "bend_deg=0.2", "--states", "1", "--fields", "none", "--no-pictures"]
    app(["solve", "--solid", str(EXAMPLE), *options, "--out", str(tmp_path / "tube")])
    assert "bend 0.20 deg" in capsys.readouterr().out
    with pytest.raises(ConfigError, match="nothing to solve"):
        app(["solve"])
    with pytest.raises(ConfigError, match="leave the design and --mesh out"):
        app(["solve", "--solid", str(EXAMPLE), "--mesh", "tube.msh"])
    mesh = load_part(EXAMPLE).mesh
    with pytest.raises(
        ConfigError, match=r"no surface set `base` for base\. Its surface sets: bore, clamped_end"
    ):
        app(["solve", "--mesh", mesh, "--out", str(tmp_path / "mesh")])


def test_the_left_chamber_of_a_part_with_one_is_no_goal(tmp_path):
    settings = SolveSettings(until="pressure_left_kpa", target=-5.0)
    with pytest.raises(ConfigError, match="the part has one chamber"):
        solve_part(load_part(EXAMPLE), tmp_path, settings)


def test_a_stiff_region_is_named_by_its_cell_set(finger_file):
    part = finger_part(finger_file)
    stiff = parse_settings({"mesh": part.mesh, "elastic": {"caps": {}}}, SolidPart).elastic
    with pytest.raises(ConfigError, match=r"\[elastic.caps\]: the mesh has the cell sets .*cap"):
        build_part(part.model_copy(update={"elastic": stiff}), COARSE)
    stiff = {"cap": stiff["caps"]}
    model = build_part(part.model_copy(update={"elastic": stiff}), COARSE)
    mu = model.solid.constants[0].sum(axis=1)
    cap = model.mesh.regions.index("cap")
    assert mu[cap] == pytest.approx(2200 / 2.7)
    assert np.delete(mu, cap) == pytest.approx(DESIGN.body.shear_modulus)


def test_a_mid_plane_elsewhere_is_refused(finger, tmp_path):
    points = finger.mesh.points + np.array([0.0, 1.0, 0.0])
    shifted = Mesh(points, finger.mesh.blocks, finger.mesh.regions, finger.mesh.facets)
    roles = {name: name for name in ("base", "tip", "cavity_right", "cavity_left", "mid_plane")}
    path = write_vtu(tmp_path / "shifted.vtu", shifted, roles)
    with pytest.raises(GeometryError, match="mid-plane spans y = 1 to 1 mm, must be the plane y = 0"):
        build_part(SolidPart(mesh=str(path)), COARSE)


def test_settings_name_the_typo(tmp_path):
    path = tmp_path / "part.toml"
    path.write_text('mesh = "a.msh"\n[sets]\ncavity_rigth = "bore"\n')
    with pytest.raises(ConfigError, match="did you mean `cavity_right`"):
        load_settings(path, SolidPart)
