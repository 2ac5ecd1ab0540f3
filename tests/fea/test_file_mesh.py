"""Meshes from files: the same solid by every format, and a clear refusal of what cannot be solved."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from mapped_box import mapped_box
from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.deck import mesh_cards
from tubefoot.fea.elements import element_kind
from tubefoot.fea.file_mesh import FileMesh, read_mesh_file
from tubefoot.fea.mesh import jacobian_at
from tubefoot.fea.named_mesh import named_mesh, raised
from tubefoot.fea.solid_part import SolidPart, part_mesh, require_fluid

TUBE = Path(__file__).parents[2] / "examples" / "solids" / "eccentric-tube.msh"
TUBE_ROLES = {"base": "clamped_end", "tip": "free_end", "cavity_right": "bore", "mid_plane": "symmetry"}
BOX_ROLES = {"base": "x_min", "tip": "x_max"}


def cell_volumes(mesh):
    block = mesh.blocks[0]
    determinants = np.linalg.det(jacobian_at(mesh.points, block, block.element.quadrature_points))
    return determinants @ block.element.quadrature_weights


def box_file(kind, size=10.0, **changes):
    """A box of 2 x 1 x 1 cells as a file would hold it, its ends as facet sets."""
    mesh = mapped_box(kind, (2, 1, 1), lambda points: size * points)
    block = mesh.blocks[0]
    n_corners = element_kind(block.element.face_kind).n_corners
    sets = {name: mesh.facet_set(name).nodes[:, :n_corners] for name in ("x_min", "x_max")}
    half = mesh.points[block.nodes].mean(axis=1)[:, 0] > size / 2
    values = {"points": mesh.points, "kind": kind, "cells": block.nodes, "facet_sets": sets}
    return FileMesh(**values | {"cell_sets": {"upper": half}} | changes)


def write_inp(path, mesh, element, more=()):
    path.write_text("\n".join([*mesh_cards(mesh.points, mesh.blocks[0].nodes, element), *more, ""]))
    return path


def test_a_gmsh_file_gives_volume_chamber_and_areas_of_the_solid():
    """Half a cylinder of radius 5 and length 60 with a bore of radius 3, length 54; quadratic arcs."""
    mesh = named_mesh(read_mesh_file(TUBE), TUBE_ROLES)
    assert mesh.blocks[0].kind == "tetra10"
    assert mesh.regions == ("body",)
    assert cell_volumes(mesh).sum() == pytest.approx(np.pi / 2 * (25 * 60 - 9 * 54), rel=2e-3)
    assert Cavity(mesh, "cavity_right", 0).rest_volume == pytest.approx(np.pi / 2 * 9 * 54, rel=2e-3)
    assert np.unique(mesh.points[mesh.facet_set("base").points, 2]) == pytest.approx([0.0], abs=1e-9)
    assert np.unique(mesh.points[mesh.facet_set("tip").points, 2]) == pytest.approx([60.0])
    require_fluid(mesh, "cavity_right", "tube")


@pytest.mark.parametrize("suffix", [".inp", ".vtu"])
def test_other_formats_give_the_same_mesh(suffix, tmp_path):
    found = read_mesh_file(TUBE)
    path = tmp_path / f"tube{suffix}"
    if suffix == ".inp":
        mesh = named_mesh(found, TUBE_ROLES)
        sets = []
        for role, name in TUBE_ROLES.items():
            sets += [f"*NSET, NSET={name.upper()}", *map(str, mesh.facet_set(role).points + 1)]
        write_inp(path, mesh, "C3D10", sets)
    else:
        reference = meshio.read(TUBE)
        cells = [("tetra10", found.cells)] + [
            ("triangle6", block.data) for block in reference.cells if block.type == "triangle6"
        ]
        flags = {}
        for name in TUBE_ROLES.values():
            members = [np.asarray(part, int) for part in reference.cell_sets[name]]
            rows = [np.zeros(len(found.cells), int)]
            triangles = zip(reference.cells, members, strict=True)
            rows += [
                np.isin(np.arange(len(b.data)), chosen).astype(int)
                for b, chosen in triangles
                if b.type == "triangle6"
            ]
            flags[name] = rows
        meshio.Mesh(found.points, cells, cell_data=flags).write(path)
    ours, theirs = (named_mesh(file, TUBE_ROLES) for file in (found, read_mesh_file(path)))
    assert theirs.n_cells == ours.n_cells
    assert cell_volumes(theirs).sum() == pytest.approx(cell_volumes(ours).sum(), rel=1e-12)
    for role in TUBE_ROLES:
        assert len(theirs.facet_set(role).nodes) == len(ours.facet_set(role).nodes)
    volumes = [Cavity(mesh, "cavity_right", 0).rest_volume for mesh in (theirs, ours)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-12)


def test_surface_cards_number_faces_as_abaqus_does(tmp_path):
    """Abaqus' table of faces by corner: of a brick S1 1234, S2 5876, S3 1562, S4 2673, S5 3784, S6 4851."""
    mesh = mapped_box("hexahedron20", (1, 1, 1), lambda points: 10 * points)
    sides = {
        "S1": (2, 0.0),
        "S2": (2, 10.0),
        "S3": (1, 0.0),
        "S4": (0, 10.0),
        "S5": (1, 10.0),
        "S6": (0, 0.0),
    }
    cards = [line for side in sides for line in (f"*SURFACE, NAME=at_{side}, TYPE=ELEMENT", f"1, {side}")]
    found = read_mesh_file(write_inp(tmp_path / "box.inp", mesh, "C3D20", cards))
    for side, (axis, value) in sides.items():
        corners = found.facet_sets[f"at_{side.lower()}"]
        assert found.points[corners][..., axis] == pytest.approx(value, abs=1e-12), side


def test_generated_and_nested_sets_of_abaqus(tmp_path):
    mesh = mapped_box("hexahedron20", (2, 1, 1), lambda points: 10 * points)
    cards = [
        *("*ELSET, ELSET=Both, GENERATE", "1, 2"),
        *("*NSET, NSET=few, GENERATE", "1, 5, 2"),
        *("*NSET, NSET=more", "few, 7"),
        *("*SURFACE, NAME=Low, TYPE=ELEMENT", "Both, S1"),
    ]
    found = read_mesh_file(write_inp(tmp_path / "box.inp", mesh, "C3D20", cards))
    assert found.cell_sets["both"].tolist() == [True, True]
    assert found.point_sets["more"].tolist() == [0, 2, 4, 6]
    assert len(found.facet_sets["low"]) == 2


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27"])
def test_facets_point_out_of_the_solid_whatever_the_file_says(kind):
    found = box_file(kind)
    for name, corners in found.facet_sets.items():
        found.facet_sets[name] = corners[:, ::-1]
    mesh = named_mesh(found, BOX_ROLES)
    for role, sign in (("base", -1), ("tip", 1)):
        nodes = mesh.facet_set(role).nodes
        a, b, c = mesh.points[nodes[:, :3]].transpose(1, 0, 2)
        assert (sign * np.cross(b - a, c - a)[:, 0] > 0).all()
    assert mesh.regions == ("upper", "body")
    upper = mesh.blocks[0].region == 0
    assert cell_volumes(mesh)[upper].sum() == pytest.approx(500.0)


def test_the_smallest_cell_set_that_holds_a_cell_is_its_region():
    """Programs that write every cell into a set of all cells do not hide the others."""
    found = box_file("tetra10")
    upper = found.cell_sets["upper"]
    found.cell_sets = {"tiny": upper & (np.arange(len(upper)) == upper.argmax()), "upper": upper}
    found.cell_sets["a"] = np.ones(len(upper), dtype=bool)
    mesh = named_mesh(found, {})
    region = np.array(mesh.regions)[mesh.blocks[0].region]
    assert sorted(mesh.regions) == ["a", "tiny", "upper"]
    assert (region == "tiny").sum() == 1
    assert (region == "a").tolist() == (~upper).tolist()


@pytest.mark.parametrize(("linear", "quadratic"), [("tetra4", "tetra10"), ("hexahedron8", "hexahedron27")])
def test_linear_cells_are_raised_on_request_only(linear, quadratic):
    fine = mapped_box(quadratic, (2, 1, 1), lambda points: 10 * points)
    n_corners = element_kind(quadratic).n_corners
    corners = np.unique(fine.blocks[0].nodes[:, :n_corners])
    number = np.full(len(fine.points), -1)
    number[corners] = np.arange(len(corners))
    cells = number[fine.blocks[0].nodes[:, :n_corners]]
    found = FileMesh(fine.points[corners], linear, cells)
    with pytest.raises(GeometryError, match="raise_to_quadratic = true"):
        named_mesh(found, {})
    points, nodes = raised(found.points, cells, linear)
    assert len(points) == len(fine.points), "neighbours share their new nodes"
    mesh = named_mesh(found, {}, raise_to_quadratic=True)
    assert mesh.blocks[0].kind == quadratic
    assert cell_volumes(mesh).sum() == pytest.approx(1000.0)
    assert points[nodes] == pytest.approx(fine.points[fine.blocks[0].nodes], abs=1e-12)


def test_a_missing_set_is_named_with_the_sets_there_are():
    with pytest.raises(
        ConfigError, match=r"no surface set `xmin` for base; did you mean `x_min`\? .*x_max, x_min"
    ):
        named_mesh(box_file("tetra10"), {"base": "xmin"})


def test_folded_cells_are_refused_with_their_place():
    found = box_file("hexahedron20")
    found.cells[1, :] = found.cells[1, [1, 0, 3, 2, 5, 4, 7, 6, *range(8, 20)]]
    with pytest.raises(GeometryError, match=r"1 of 2 cells are folded over .* near x = 7.5"):
        named_mesh(found, {})


@pytest.mark.parametrize("size", [0.06, 60e3])
def test_another_unit_of_length_is_noticed_and_can_be_given(size):
    found = box_file("tetra10", size)
    with pytest.raises(GeometryError, match="length_unit"):
        named_mesh(found, {})
    mesh = named_mesh(found, {}, scale=60.0 / size)
    assert np.ptp(mesh.points, axis=0) == pytest.approx(60.0)


def test_facets_inside_the_solid_are_refused():
    found = box_file("hexahedron20")
    shared = np.intersect1d(*(set_of.tolist() for set_of in found.cells[:, :8]))
    x = found.points[shared, 0]
    assert x == pytest.approx(5.0)
    ordered = shared[[0, 1, 3, 2]]
    found.facet_sets["wall"] = ordered[None]
    with pytest.raises(GeometryError, match=r"1 of the 1 facets of `wall` .* no outer faces"):
        named_mesh(found, {"cavity_right": "wall"})


def test_an_open_chamber_and_an_outer_surface_are_refused():
    found = read_mesh_file(TUBE)
    bore = found.facet_sets["bore"]
    ends = found.points[bore][..., 2].min(axis=1) > 57 - 1e-6
    assert ends.any()
    found.facet_sets["bore"] = bore[~ends]
    mesh = named_mesh(found, TUBE_ROLES)
    area = np.pi / 2 * 9
    with pytest.raises(GeometryError, match=rf"opening of {area:.1f}\d* mm\^2 faces \(.*, .*, -?14"):
        require_fluid(mesh, "cavity_right", "tube")
    box = named_mesh(box_file("tetra10"), {})
    faces = mapped_box("tetra10", (2, 1, 1), lambda points: 10 * points).facets
    everything = box_file("tetra10", facet_sets={"skin": np.vstack([f.nodes[:, :3] for f in faces.values()])})
    box = named_mesh(everything, {"cavity_right": "skin"})
    with pytest.raises(GeometryError, match="encloses the solid"):
        require_fluid(box, "cavity_right", "box")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("part.stl", "solid", "not a mesh format"),
        ("part.msh", "$MeshFormat\nnonsense", "cannot be read as .msh"),
        ("part.inp", "*NODE\n1, 0, 0, 0\n", "no \\*NODE or no \\*ELEMENT"),
        ("part.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D15\n1, 1\n", "C3D15` cannot be used"),
        ("part.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n1, 1, 2\n", "4 nodes has another number"),
        (
            "part.inp",
            "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n1, 1, 1, 1, 9\n",
            "node 9, which is not defined",
        ),
        ("part.inp", "*NODE\n1, x, 0, 0\n", "\\*NODE: could not convert"),
    ],
)
def test_files_that_are_no_mesh_are_refused(name, text, message, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises((ConfigError, GeometryError), match=message):
        read_mesh_file(path)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ConfigError, match="no such file"):
        part_mesh(SolidPart(mesh=str(tmp_path / "none.msh")), 2.0)


def test_cells_of_two_kinds_are_refused(tmp_path):
    points = np.random.default_rng(0).uniform(0, 10, (12, 3))
    cells = [("tetra", np.arange(4)[None]), ("hexahedron", np.arange(4, 12)[None])]
    meshio.Mesh(points, cells).write(tmp_path / "two.vtu")
    with pytest.raises(GeometryError, match="several kinds \\(hexahedron, tetra\\)"):
        read_mesh_file(tmp_path / "two.vtu")
