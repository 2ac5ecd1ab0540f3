"""Tetrahedra by Netgen: named faces of a STEP file, curved edges, elements that carry what they must."""

from pathlib import Path

import numpy as np
import pytest

from tubefoot.design import cad
from tubefoot.design.named_step import write_named_step
from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.file_mesh import FileMesh
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.mesh import jacobian_at
from tubefoot.fea.named_mesh import named_mesh, outer_faces, smallest_determinants
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.solid_part import SetNames, SolidPart, build_part
from tubefoot.fea.step import Tolerance
from tubefoot.fea.tetrahedra import step_mesh, straightened

RUBBER = OgdenLaw((0.2127, 0.0375, -0.001), (1.3212, 4.318, -1.0248), 50.0)


def volume_by_region(mesh):
    block = mesh.blocks[0]
    determinants = np.linalg.det(jacobian_at(mesh.points, block, block.element.quadrature_points))
    volumes = determinants @ block.element.quadrature_weights
    return {name: volumes[block.region == k].sum() for k, name in enumerate(mesh.regions)}


def plug_in_block(path: Path) -> Path:
    """A 10 x 8 x 6 block with a cylinder of radius 2 through it, as two solids; faces named by place."""
    plug = cad.cylinder((5.0, 4.0, 0.0), (0, 0, 1), 2.0, 6.0)
    block = cad.cut(cad.box((0, 10), (0, 8), (0, 6)), [plug])

    def name(solid, place):
        for axis, letter in enumerate("xyz"):
            if place.high[axis] - place.low[axis] < 1e-6:
                return f"{letter}{place.low[axis]:.0f}_{solid}"
        return f"round_{solid}"

    return write_named_step(path, {"block": block, "plug": plug}, name)


@pytest.fixture(scope="module")
def two_solids(tmp_path_factory):
    return step_mesh(plug_in_block(tmp_path_factory.mktemp("step") / "two.step"), 2.5)


def test_named_faces_and_solids_of_a_step_file_become_sets(two_solids):
    mesh = named_mesh(two_solids, {name: name for name in two_solids.facet_sets})
    expected = {"x0_block", "x10_block", "y0_block", "y8_block", "z0_block", "z6_block", "z0_plug", "z6_plug"}
    assert set(mesh.facets) == expected, "the joint of the two is inside"
    volumes = volume_by_region(mesh)
    assert volumes["plug"] == pytest.approx(np.pi * 4 * 6, rel=2e-3)
    assert volumes["block"] == pytest.approx(480 - np.pi * 4 * 6, rel=1e-3)
    assert sum(volumes.values()) == pytest.approx(480.0, rel=1e-12), "they share their nodes"
    assert len(outer_faces(mesh.blocks[0])) == sum(len(facets.nodes) for facets in mesh.facets.values())


def test_patch_of_netgen_cells_carries_an_affine_field_exactly(two_solids):
    mesh = named_mesh(two_solids, {})
    solid = Solid(mesh, {"*": RUBBER}, pressure="continuous")
    gradient = np.array([[0.2, 0.15, -0.1], [0.05, -0.1, 0.08], [-0.04, 0.1, -0.06]])
    affine = (mesh.points @ gradient.T).ravel()
    held = np.unique(outer_faces(mesh.blocks[0]))
    model = Model(mesh, [solid], {0: held, 1: held, 2: held}, tolerance=Tolerance(force=1e-11))
    guess = model.rest()
    guess.unknowns[: mesh.points.size] = affine
    inside = np.setdiff1d(np.arange(len(mesh.points)), held)
    assert len(inside) > 10
    noise = np.random.default_rng(2).uniform(-0.01, 0.01, (len(inside), 3))
    guess.unknowns[: mesh.points.size].reshape(-1, 3)[inside] += noise
    found = model.solve(guess, Control("parameter", 0.0))
    assert found.state.unknowns[: mesh.points.size] == pytest.approx(affine, abs=1e-9)
    cauchy, jacobians = solid.stresses(found.state)
    assert jacobians == pytest.approx(np.linalg.det(np.eye(3) + gradient), rel=1e-9)
    assert np.abs(cauchy - cauchy[0, 0]).max() < 1e-7 * np.abs(cauchy).max()


def test_mid_nodes_lie_on_the_curved_face(two_solids):
    """All but those of cells with two faces on the cylinder, which fold where the faces meet tangentially."""
    plug = two_solids.cells[two_solids.cell_sets["plug"]]
    corners = np.unique(plug[:, :4])
    middles = np.setdiff1d(plug, corners)
    radius = np.hypot(two_solids.points[:, 0] - 5.0, two_solids.points[:, 1] - 4.0)
    at_joint = np.intersect1d(middles, two_solids.cells[two_solids.cell_sets["block"]])
    assert len(at_joint) > 20
    on_face = np.abs(radius[at_joint] - 2.0) < 1e-6
    assert on_face.mean() > 0.9
    assert radius[at_joint].min() > 1.85


def test_a_mid_node_that_folds_its_cell_is_moved_towards_the_straight_edge():
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2.0]])
    ends = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    middles = np.array([(points[a] + points[b]) / 2 for a, b in ends])
    found = FileMesh(np.vstack([points, middles]), "tetra10", np.arange(10)[None])
    bent = found.points.copy()
    bent[4] += [0.0, 0.2, 0.1]
    assert straightened(bent, found.cells) == pytest.approx(bent), "a mild curve is kept"
    bent[4] += [0.0, 1.5, 1.5]
    block = named_mesh(found, {}).blocks[0]
    assert smallest_determinants(bent, block).min() < 0
    mended = straightened(bent, found.cells)
    assert smallest_determinants(mended, block).min() > 0.02 * 8
    assert np.delete(mended, 4, axis=0) == pytest.approx(np.delete(found.points, 4, axis=0))
    share = (mended - found.points)[4, 1:] / (bent - found.points)[4, 1:]
    assert share == pytest.approx(share[0])
    assert 0 < share[0] < 1, "as much of the curve is kept as can be"


@pytest.mark.parametrize("whole", [True, False])
def test_a_step_file_of_a_hollow_box_is_modelled_by_its_face_names(whole, tmp_path):
    """Whole, or cut at y = 0; goals and chamber are those of what is modelled."""
    low = -4 if whole else 0
    hollow = cad.cut(cad.box((-4, 4), (low, 4), (0, 20)), [cad.box((-2, 3), (-2.5, 2.5), (2, 18))])

    def name(solid, place):
        if not whole and place.high[1] < 1e-6:
            return "cut"
        if place.high[2] < 1e-6:
            return "foot"
        if place.low[2] > 20 - 1e-6:
            return "top"
        outside = np.abs(place.point[:2]).max() > 4 - 1e-6
        return "skin" if outside else "chamber"

    path = write_named_step(tmp_path / "hollow.step", {"body": hollow}, name)
    sets = SetNames(base="foot", tip="top", cavity_right="Chamber", mid_plane=None if whole else "cut")
    part = SolidPart(name="hollow", mesh=str(path), sets=sets)
    settings = SolveSettings(element_size_mm=3.0, until="pumped_volume_ml", target=0.1, air_right_ml=0.2)
    found = build_part(part, settings)
    share = 1.0 if whole else 0.5
    assert found.share == share
    assert found.model.rest_volumes == pytest.approx([share * 5 * 5 * 16])
    assert volume_by_region(found.mesh) == pytest.approx({"body": share * (8 * 8 * 20 - 5 * 5 * 16)})
    assert found.goal.control.target == pytest.approx(share * 100.0)
    assert found.model.cavities[0].air_volume == pytest.approx(share * 200.0)
    held = 3 * len(found.mesh.facet_set("base").points)
    if not whole:
        held += len(
            np.setdiff1d(found.mesh.facet_set("mid_plane").points, found.mesh.facet_set("base").points)
        )
    assert (found.model.system.free < found.mesh.points.size).sum() == found.mesh.points.size - held


def test_files_that_are_no_solid_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="no such file"):
        step_mesh(tmp_path / "none.step", 1.0)
    (tmp_path / "text.step").write_text("this is no STEP file")
    with pytest.raises((ConfigError, GeometryError), match=r"text\.step"):
        step_mesh(tmp_path / "text.step", 1.0)
