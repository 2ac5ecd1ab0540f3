"""One export read again by other programs' readers: STEP, STL, 3MF, drawing, tables, instructions."""

import csv
import json
import re
import zipfile
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import trimesh

from tubefoot.design import export
from tubefoot.design.export import export_finger
from tubefoot.design.finger import load_design
from tubefoot.design.layout import gripper_base_of
from tubefoot.design.parts import finger_parts
from tubefoot.errors import GeometryError

EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
NAMES = {"front body", "front tubes", "back body", "back tubes", "base", "connector", "plug", "marker plate"}


@pytest.fixture(scope="module")
def exported(reference, tmp_path_factory):
    return export_finger(reference, tmp_path_factory.mktemp("export"), pictures=False)


@pytest.fixture(scope="module")
def directory(exported):
    return exported.files[-1].parent


def read_step(path):
    """Names, volumes and boxes of the solids, by OpenCASCADE's plain reader and the file's own text."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    found = []
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_SOLID)
    while explorer.More():
        properties, box = GProp_GProps(), Bnd_Box()
        BRepGProp.VolumeProperties_s(explorer.Current(), properties)
        BRepBndLib.AddOptimal_s(explorer.Current(), box)
        corners = [corner() for corner in (box.CornerMin, box.CornerMax)]
        limits = [value for corner in corners for value in (corner.X(), corner.Y(), corner.Z())]
        found.append((properties.Mass(), np.array(limits)))
        explorer.Next()
    text = re.sub(r"\s+", " ", path.read_text())
    return found, set(re.findall(r"PRODUCT\('([^']*)'", text))


def test_step_assembly_has_every_body_name_and_volume(reference, parts, directory):
    solids, names = read_step(directory / "finger.step")
    # 2 bodies, 4 + 4 half tubes, 2 pins, base, 2 connectors, 2 plugs, 1 plate
    assert len(solids) == 2 + 8 + 2 + 1 + 2 + 2 + 1
    expected = sum(part.volume * len(part.shifts) for part in parts.values())
    assert sum(volume for volume, _ in solids) == pytest.approx(expected, rel=1e-6)
    boxes = np.array([box for _, box in solids])
    assert boxes[:, :3].min(axis=0) == pytest.approx([-11.0, -13.6, -12.0], abs=1e-3)
    assert boxes[:, 3:].max(axis=0) == pytest.approx([11.0, 13.6, 40.0], abs=1e-3)
    assert {"reference-3", "front module", "back module", "front body", "base", "plug 1", "plug 2"} <= names


def test_step_colours_are_those_of_the_materials(directory):
    text = re.sub(r"\s+", "", (directory / "finger.step").read_text())
    colours = {tuple(map(float, found.split(","))) for found in re.findall(r"COLOUR_RGB\('',([^)]*)\)", text)}
    assert len(colours) == 2


def test_gripper_step_has_two_fingers_at_the_gap(reference, parts, directory):
    solids, names = read_step(directory / "gripper.step")
    assert len(solids) == 1 + 2 * 17
    assert {"left finger", "right finger", "gripper base"} <= names
    bodies = [box for volume, box in solids if volume == pytest.approx(parts["back body"].volume, rel=1e-6)]
    left, right = sorted(bodies, key=lambda box: box[0])
    assert right[0] - left[3] == pytest.approx(reference.gripper.finger_gap_mm, abs=1e-3)
    reach = gripper_base_of(reference).finger_x[1]
    assert (left[0] + left[3]) / 2 == pytest.approx(-reach, abs=1e-3)


def test_every_stl_is_closed_by_other_readers(parts, exported):
    files = [path for path in exported.files if path.suffix == ".stl"]
    assert len(files) == len(parts)
    for path in files:
        mesh = trimesh.load(path)
        assert mesh.is_watertight, path
        assert mesh.is_winding_consistent, path
        again = meshio.read(path)
        assert len(again.cells_dict["triangle"]) == len(mesh.faces)
        name = next(name for name, part in parts.items() if part.file_stem == path.stem)
        assert mesh.volume == pytest.approx(parts[name].volume, rel=4e-3)
        assert mesh.body_count == (1 if "tubes" not in name else 4 if "front" in name else 6)
        assert mesh.bounds[0][2] >= -1e-6


def test_only_stale_files_of_our_own_are_removed(parts, tmp_path):
    from tubefoot.design.mesh_files import remove_stale_stl, write_stl

    kept = write_stl(tmp_path / "kept.stl", parts["plug"].mesh, "plug")
    stale = write_stl(tmp_path / "stale.stl", parts["plug"].mesh, "plug")
    foreign = tmp_path / "foreign.stl"
    foreign.write_bytes(b"solid by someone else")
    remove_stale_stl(tmp_path, [kept])
    assert kept.exists()
    assert foreign.exists()
    assert not stale.exists()


def test_3mf_has_names_materials_colours_and_places(parts, directory):
    with zipfile.ZipFile(directory / "finger.3mf") as package:
        root = ElementTree.fromstring(package.read("3D/3dmodel.model"))
    assert root.get("unit") == "millimeter"
    materials = {base.get("name"): base.get("displaycolor") for base in root.iter(f"{CORE}base")}
    assert set(materials) == {"Agilus30", "Vero"}
    assert materials["Agilus30"] != materials["Vero"]
    order = list(materials)
    seen = {}
    for item in root.iter(f"{CORE}object"):
        points = np.array([[float(v.get(k)) for k in "xyz"] for v in item.iter(f"{CORE}vertex")])
        facets = np.array([[int(t.get(k)) for k in ("v1", "v2", "v3")] for t in item.iter(f"{CORE}triangle")])
        mesh = trimesh.Trimesh(points, facets)
        name = item.get("name")
        seen[item.get("id")] = name
        assert mesh.is_watertight, name
        assert mesh.volume == pytest.approx(parts[name].volume, rel=4e-3)
        assert order[int(item.get("pindex"))] == ("Agilus30" if parts[name].kind == "soft" else "Vero")
        assert mesh.bounds == pytest.approx(np.array(parts[name].mesh.bounds), abs=1e-5)
    assert set(seen.values()) == NAMES
    built = [seen[item.get("objectid")] for item in root.iter(f"{CORE}item")]
    assert built.count("plug") == built.count("connector") == 2
    assert len(built) == 10
    shifts = {name: set() for name in NAMES}
    for item in root.iter(f"{CORE}item"):
        numbers = (item.get("transform") or "1 0 0 0 1 0 0 0 1 0 0 0").split()
        shifts[seen[item.get("objectid")]].add(tuple(map(float, numbers[9:])))
    for name, found in shifts.items():
        assert found == set(parts[name].shifts), name
    assert len(shifts["plug"]) == 2


def test_walls_are_measured_on_the_meshes(reference, exported, directory):
    with (directory / "walls.csv").open() as file:
        rows = list(csv.DictReader(file))
    designed = {row["wall"]: float(row["designed_mm"]) for row in rows}
    assert designed["fold wall (T1)"] == 1.5
    assert designed["valley wall (T2)"] == designed["partition (T3)"] == 2.0
    assert len(rows) == 12
    for row in rows:
        assert abs(float(row["least_mm"]) - designed[row["wall"]]) < 0.03
        assert abs(float(row["greatest_mm"]) - designed[row["wall"]]) < 0.03
    assert sum(int(row["places"]) for row in rows if row["wall"] == "fold wall (T1)") == 2 * 4 * 3


def test_a_wrong_wall_is_refused(reference, tmp_path, monkeypatch):
    """The design says 1.5 mm, the solid is made with 1.45 mm: the measured mesh tells."""
    thinner = reference.with_bellows(fold_wall_mm=1.45)
    monkeypatch.setattr(
        export, "finger_parts", lambda design, growth, say: finger_parts(thinner, growth, say)
    )
    with pytest.raises(GeometryError, match=r"1\.450 mm, the design says 1\.500 mm"):
        export_finger(reference, tmp_path, pictures=False)


def test_drawing_shows_the_dimensions(reference, directory):
    svg = ElementTree.parse(directory / "drawing.svg").getroot()
    texts = {"".join(node.itertext()).strip() for node in svg.iter("{http://www.w3.org/2000/svg}text")}
    shown = {"T1 = 1.5", "T2 = 2", "T3 = 2", "length 29", "pitch 7", "22", "bellows 21 = 3 × 7"}
    assert shown <= texts
    assert any(text.startswith("pitch angle α = 11.31°") for text in texts)
    assert svg.get("width").startswith("1190.5")  # A3, in points
    assert (directory / "drawing.pdf").read_bytes().startswith(b"%PDF-")


def test_bill_and_summary_agree_with_the_meshes(exported, directory):
    with (directory / "bill.csv").open() as file:
        rows = {row["part"]: row for row in csv.DictReader(file)}
    summary = json.loads((directory / "summary.json").read_text())
    assert summary["chamber_volume_mm3"] == pytest.approx(summary["chamber_volume_by_formula_mm3"], rel=1e-9)
    for part in summary["parts"]:
        mesh = trimesh.load(
            next(path for path in exported.files if path.stem.startswith(part["part"].replace(" ", "-")))
        )
        assert float(rows[part["part"]]["volume_mm3"]) == pytest.approx(mesh.volume, rel=4e-3)
        assert part["open_edges"] == 0
        assert part["unseen_surface_share"] == 0.0
    assert set(rows) == NAMES | {"gripper base"}


def test_instructions_are_whole_and_say_so_when_pictures_are_missing(directory):
    page = (directory / "instructions.html").read_text()
    assert "The pictures are missing" in page
    for words in ("UV-curable resin", "298 mm²", "0.64 ml", "1.54 mm wide", "at unit 2.", "3.4 mm holes"):
        assert words in page, words
    parser = _Balanced()
    parser.feed(page)
    assert parser.open == []
    assert "http" not in page


@pytest.mark.slow
@pytest.mark.parametrize("growth", [0.0, 0.15])
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_all_examples_export_with_pictures(path, growth, tmp_path):
    design = load_design(path)
    exported = export_finger(design, tmp_path, growth)
    assert exported.summary["wall_error_max_mm"] < 0.03
    pictures = [path for path in exported.files if path.suffix == ".png"]
    assert len(pictures) == 6
    assert all(picture.stat().st_size > 10_000 for picture in pictures)
    assert (tmp_path / "instructions.html").read_text().count("data:image/png") == 6
    solids, _ = read_step(tmp_path / "body.step")
    assert len(solids) == 1
    assert solids[0][0] == pytest.approx(exported.summary["body_volume_mm3"], rel=1e-6)


class _Balanced(HTMLParser):
    VOID = ("meta", "img", "br")

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
