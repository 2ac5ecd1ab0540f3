"""Input decks: what they say is read back, and CalculiX finds with them what is found here."""

import re
from pathlib import Path

import numpy as np
import pytest
from benchmarks.peers_calculix import printed, run_deck

from tubefoot.cli.main import app
from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.deck import DeckLoad, finger_deck, material_card, wall_faces
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.finger_tetrahedra import finger_tetrahedra
from tubefoot.fea.measures import SectionRotation
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.path import follow
from tubefoot.fea.recast import recast
from tubefoot.fea.solid_part import SolidPart, build_part
from tubefoot.fea.stride import StepControl
from tubefoot.units import DEG, KPA

DESIGN = FingerDesign().with_bellows(units=1)
EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"
KINDS = {"C3D20": "hexahedron20", "C3D10": "tetra10"}
LOAD = DeckLoad((3 * KPA, -2 * KPA), first_increment=0.5)


def swept(element):
    """A coarse finger; tetrahedra with straight edges, where four points, as there, do for eight."""
    mesh = recast(finger_mesh(DESIGN.profile, 3.5), KINDS[element])
    if element == "C3D10":
        cells, points = mesh.blocks[0].nodes, mesh.points.copy()
        points[cells[:, 4:]] = points[cells[:, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]]].mean(axis=2)
        mesh = Mesh(points, mesh.blocks, mesh.regions, mesh.facets)
    return mesh


@pytest.mark.parametrize("element", KINDS)
@pytest.mark.parametrize("program", ["ccx", "abaqus"])
def test_a_deck_read_again_is_the_finger(element, program, tmp_path):
    mesh = swept(element)
    name = element if program == "ccx" else f"{element}H"
    path = tmp_path / "finger.inp"
    path.write_text(finger_deck(DESIGN, mesh, name, LOAD, program))
    part = build_part(SolidPart(mesh=str(path)), SolveSettings(target=1.0))
    assert part.share == 0.5
    assert part.model.rest_volumes == pytest.approx(
        [Cavity(mesh, f"cavity_{hand}", 0).rest_volume for hand in ("right", "left")], rel=1e-9
    )
    held = sum(len(points) for points in clamp_half_finger(mesh).values())
    displacements = part.model.system.free < part.mesh.points.size
    assert displacements.sum() == mesh.points.size - held


def test_walls_are_the_faces_that_the_programs_mean():
    """The corners of face n of a cell, by Abaqus' table, are those of our facet."""
    for element in KINDS:
        mesh = swept(element)
        cells, faces = wall_faces(mesh, "cavity_left")
        table = {
            "C3D20": ["1234", "5876", "1562", "2673", "3784", "4851"],
            "C3D10": ["123", "142", "243", "341"],
        }[element]
        n = len(table[0])
        for cell, face, facet in zip(cells, faces, mesh.facet_set("cavity_left").nodes, strict=True):
            corners = mesh.blocks[0].nodes[cell - 1][[int(letter) - 1 for letter in table[face - 1]]]
            assert set(corners) == set(facet[:n])


def test_material_cards_carry_the_terms_and_leave_further_bulk_terms_out():
    ours = material_card((0.2, 0.04, -0.001), (1.3, 4.3, -1.0), 50.0)
    assert ours[1] == "*HYPERELASTIC, OGDEN, N=3"
    numbers = [float(cell) for line in ours[2:] for cell in line.split(",")]
    assert numbers == [0.2, 1.3, 0.04, 4.3, -0.001, -1.0, 0.04, 1e20, 1e20]
    assert [len(line.split(",")) for line in ours[2:]] == [8, 1], "eight numbers a line"
    abaqus = material_card((0.2, 0.04), (1.3, 4.3), 50.0, "abaqus")
    assert abaqus[2].split(", ")[-2:] == ["0.04", "0"]
    with pytest.raises(ConfigError, match="4 terms"):
        material_card((1.0,) * 4, (2.0,) * 4, 50.0)


def test_abaqus_cavities_are_pumped_by_mass_or_held_at_pressure():
    mesh = swept("C3D20")
    pumped = finger_deck(DESIGN, mesh, "C3D20H", DeckLoad(pumped_volume=12.0), "abaqus")
    flux = pumped.split("*FLUID FLUX\n")[1].splitlines()[:2]
    assert flux == ["FLUID_RIGHT, 1.2e-08", "FLUID_LEFT, -1.2e-08"]
    nodes = [int(number) for number in re.findall(r"NSET=FLUID_\w+\n(\d+)", pumped)]
    assert nodes == [len(mesh.points) + 1, len(mesh.points) + 2]
    places = re.findall(rf"^{nodes[0]}, (\S+), (\S+), (\S+)$", pumped, re.M)
    assert float(places[0][0]) > 0
    assert float(places[0][1]) == 0, "in the plane that closes the cavity"
    held = finger_deck(DESIGN, mesh, "C3D20H", LOAD, "abaqus")
    assert "FLUID_RIGHT, 8, 8, 0.003\nFLUID_LEFT, 8, 8, -0.002" in held
    assert "DLOAD" not in held


def test_what_a_program_does_not_have_is_refused():
    mesh = swept("C3D20")
    with pytest.raises(ConfigError, match="C3D20H` does not go with ccx"):
        finger_deck(DESIGN, mesh, "C3D20H", LOAD)
    with pytest.raises(ConfigError, match="cells of kind hexahedron20"):
        finger_deck(DESIGN, mesh, "C3D10", LOAD)
    with pytest.raises(ConfigError, match="no fluid cavities"):
        finger_deck(DESIGN, mesh, "C3D20", DeckLoad(pumped_volume=1.0))
    seam = parse_settings({"seam": {"modulus_mpa": 5.0}}, FingerDesign)
    with pytest.raises(ConfigError, match="no seam film"):
        finger_deck(seam, mesh, "C3D20", LOAD)


def ccx_bend(mesh, element, load, directory):
    (directory / "finger.inp").write_text(finger_deck(DESIGN, mesh, element, load))
    run_deck(directory, "finger")
    displacements = np.zeros(mesh.points.shape)
    for node, values in printed(directory / "finger.dat").items():
        displacements[node - 1] = values
    return displacements


def our_displacements(path, load, space, **settings):
    """The same deck read again and solved here, with its tip's displacements in the deck's order."""
    ratio = load.pressures[1] / load.pressures[0]
    options = {"cavities": "pressure", "left_over_right": ratio, "target": load.pressures[0] / KPA}
    part = build_part(SolidPart(mesh=str(path)), SolveSettings(states=2, pressure_space=space, **options))
    step = follow(part.model, part.goal, stepping=StepControl(states=2)).steps[-1]
    return part, step.state.unknowns


@pytest.mark.parametrize("element", KINDS)
def test_calculix_bends_the_finger_as_the_same_element_does_here(element, tmp_path):
    """Displacement only, so both lock alike: the angle agrees to the printed digits and the residuals."""
    mesh = swept(element)
    displacements = ccx_bend(mesh, element, LOAD, tmp_path)
    part, unknowns = our_displacements(tmp_path / "finger.inp", LOAD, "none")
    angle, _ = part.tip(unknowns)
    assert angle / DEG > 0.25
    theirs, _ = SectionRotation(mesh, mesh.facet_set("tip").points)(displacements.ravel())
    assert theirs == pytest.approx(angle, rel=2e-4)


@pytest.mark.slow
def test_calculix_takes_a_finger_of_tetrahedra_with_rigid_tubes(tmp_path):
    mesh = finger_tetrahedra(DESIGN, 4.0, ports=True)
    displacements = ccx_bend(mesh, "C3D10", LOAD, tmp_path)
    settings = SolveSettings(
        mesh_kind="tetrahedra", ports=True, element_size_mm=4.0, pressure_space="none", states=2,
        cavities="pressure", left_over_right=-2 / 3, target=3.0,
    )  # fmt: skip
    ours = build_finger(DESIGN, settings)
    step = follow(ours.model, ours.goal, stepping=StepControl(states=2)).steps[-1]
    theirs, mine = (ours.tip(u)[0] for u in (displacements.ravel(), step.state.unknowns))
    assert mine / DEG > 0.2
    assert theirs == pytest.approx(mine, rel=1e-3)


def test_twelve_units_are_written_by_the_verb(tmp_path, capsys):
    arguments = ["--fea", "abaqus", "--pumped-volume-ml", "0.5", "--element-size-mm", "4"]
    app(["export", str(EXAMPLES / "reference-12.toml"), *arguments, "--out", str(tmp_path)])
    path = tmp_path / "reference-12-abaqus.inp"
    assert str(path) in capsys.readouterr().out
    text = path.read_text()
    assert "*FLUID FLUX\nFLUID_RIGHT, 2.5e-07" in text, "half of 0.5 ml of water in tonnes"
    assert (tmp_path / "run.toml").exists()
    assert text.count("*FLUID CAVITY,") == 2


def test_an_unknown_program_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="--fea ansys: allowed are ccx, abaqus"):
        app(["export", str(EXAMPLES / "reference-3.toml"), "--fea", "ansys", "--out", str(tmp_path)])
