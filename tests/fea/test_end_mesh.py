"""Rigid parts on the swept mesh: volumes, closed surface, a joint of two materials, how stiff they are."""

import numpy as np
import pytest

from mapped_box import mapped_box, outer_faces, symmetry
from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.drive import Control
from tubefoot.fea.end_mesh import RigidEnds
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import finger_mesh
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.measures import RIGID_REGIONS, Stresses
from tubefoot.fea.mesh import CellBlock, Mesh, jacobian_at
from tubefoot.fea.path import follow
from tubefoot.fea.seam import Seam
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.stride import StepControl
from tubefoot.fea.traction import Traction

UNIONS = {"cavity_right", "cavity_left", "outside"}
FINGER = FingerDesign().with_bellows(units=1)


def design_with(**base):
    return FingerDesign.model_validate({"bellows": FINGER.bellows, "base": base})


def meshed(design, size=3.0):
    return finger_mesh(design.profile, size, rigid=RigidEnds.of(design))


def volumes(mesh):
    block = mesh.blocks[0]
    kind = block.element
    cells = np.linalg.det(jacobian_at(mesh.points, block, kind.quadrature_points)) @ kind.quadrature_weights
    return {name: cells[block.region == k].sum() for k, name in enumerate(mesh.regions)}


@pytest.mark.parametrize("base", [{}, {"socket_depth_mm": 3.9}, {"socket_depth_mm": 9.0, "plate_mm": 5.0}])
def test_volumes_of_the_rigid_parts(base):
    design = design_with(**base)
    p, size = design.profile, design.base
    # A sliver of soft cap above the rim counts as gripped, and no socket is deeper than the cap.
    grip = 4.0 if size.socket_depth_mm > 3.8 else size.socket_depth_mm
    assert p.cap == 4.0
    found = volumes(meshed(design))
    outer_x, outer_y = p.valley_outside + size.socket_wall_mm, p.height / 2 + size.socket_wall_mm
    socket = grip * (2 * outer_x * outer_y - 2 * p.valley_outside * p.height / 2)
    plate = size.plate_mm * 2 * outer_x * outer_y
    assert found["mount"] == pytest.approx(socket + plate, rel=1e-9)
    # Caps and tubes together are the caps; four prisms (half of each modelled) of the cells inside the tubes.
    caps = 2 * p.cap * 2 * p.valley_outside * p.height / 2
    assert found["cap"] + found["tubes"] == pytest.approx(caps, rel=1e-9)
    assert 0 < found["tubes"] < 0.4 * caps


def test_tubes_are_about_as_thick_as_they_are():
    for size in (2.0, 0.5):
        found = volumes(meshed(FINGER, size))["tubes"]
        section = found / (2 * FINGER.profile.cap)  # two half tubes at either end
        round_one = np.pi / 4 * FINGER.ports.outer_diameter_mm**2
        assert section == pytest.approx(round_one, rel=0.15), size


def test_the_surface_is_closed_and_each_face_is_named_once():
    mesh = meshed(FINGER)
    named = np.vstack([facets.nodes for name, facets in mesh.facets.items() if name not in UNIONS])
    outer = outer_faces(mesh.blocks[0])
    rows = [np.unique(np.sort(faces, axis=1), axis=0) for faces in (named, outer)]
    assert len(named) == len(outer)
    assert (rows[0] == rows[1]).all()
    p = FINGER.profile
    for name, axis, at in (("base", 2, -p.cap - FINGER.base.plate_mm), ("side", 1, p.height / 2)):
        along = mesh.points[mesh.facet_set(name).points, axis]
        assert np.abs(along - at).max() < 1e-9, name


def test_the_soft_body_is_meshed_as_without_rigid_parts():
    plain, held = finger_mesh(FINGER.profile, 3.0), meshed(FINGER)
    assert set(plain.facets) | {"mount_outside"} == set(held.facets)
    for name in ("cavity_right", "side", "tip", "crest_outside_left", "valley_inside_right"):
        above = [np.sort(m.points[m.facet_set(name).points].round(9).tolist(), axis=0) for m in (plain, held)]
        if name != "side":
            assert np.allclose(*above), name


def test_two_materials_in_series_stretch_as_their_moduli():
    """A bar of a soft and a stiff half under tension; its pressure must jump between them."""
    mesh = mapped_box("hexahedron27", (1, 1, 12), lambda p: p * [1.0, 1.0, 6.0])
    region = (mesh.points[mesh.blocks[0].nodes[:, -1], 2] > 3.0).astype(np.int64)
    block = CellBlock("hexahedron27", mesh.blocks[0].nodes, region)
    mesh = Mesh(mesh.points, (block,), ("soft", "stiff"), mesh.facets)
    soft, stiff = OgdenLaw.elastic(0.7, 0.49), OgdenLaw.elastic(2200.0, 0.35)
    traction = 1e-4
    solid = Solid(mesh, {"soft": soft, "stiff": stiff}, pressure="continuous")
    load = Traction(mesh, "z_max", (0.0, 0.0, traction))
    held = symmetry(mesh, x="x_min", y="y_min", z="z_min")
    model = Model(mesh, [solid], held, others=[load])
    state = model.solve(model.rest(), Control("parameter", 1.0)).state
    cauchy, _ = solid.stresses(state)
    far = np.abs(solid.points[..., 2] - 3.0) > 2.0
    # Away from the joint the stress is the traction, in both halves; near it the soft half is held sideways.
    assert np.abs(cauchy[..., 2, 2][far] - traction).max() < 0.03 * traction
    assert np.abs(cauchy[..., 0, 0][far]).max() < 0.05 * traction
    pulled = state.unknowns[3 * mesh.facet_set("z_max").points + 2].mean()
    assert traction * 3.0 / 0.7 * 0.9 < pulled < traction * (3.0 / 0.7 + 3.0 / 2200.0)


@pytest.fixture(scope="module")
def bent():
    found = {}
    for rigid in ("clamp", "modelled"):
        settings = SolveSettings(element_size_mm=3.5, target=10.0, rigid_parts=rigid)
        finger = build_finger(FINGER, settings)
        found[rigid] = (
            finger,
            follow(finger.model, finger.goal, stepping=StepControl(states=2)).steps[-1].state,
        )
    return found


def test_a_held_cap_bends_a_little_less(bent):
    angles = {rigid: finger.tip(state.unknowns)[0] for rigid, (finger, state) in bent.items()}
    assert 0.75 * angles["clamp"] < angles["modelled"] < angles["clamp"]


def test_rigid_parts_hardly_move_and_do_not_count_as_body(bent):
    finger, state = bent["modelled"]
    block, displacement = finger.solid.block, state.unknowns[: finger.mesh.points.size].reshape(-1, 3)
    mount = np.unique(block.nodes[block.region == finger.mesh.regions.index("mount")])
    assert np.abs(displacement[mount]).max() < 1e-3 * np.abs(displacement).max()
    stresses = Stresses.of(finger.mesh, finger.solid, state)
    rigid = np.isin(stresses.region, RIGID_REGIONS)
    assert rigid.any()
    whole = dict(stresses.by_region())["all"]
    assert (whole == ~rigid).all()
    seam = Seam(finger.mesh, finger.solid)
    assert not np.isin(seam.region, RIGID_REGIONS).any()
    assert not np.isin(seam.points, mount).any()


def test_tetrahedra_have_no_mount():
    with pytest.raises(ConfigError, match="swept hexahedra"):
        parse_settings({"rigid_parts": "modelled", "mesh_kind": "tetrahedra"}, SolveSettings)
