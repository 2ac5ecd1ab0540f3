"""The finger as tetrahedra: the same body and chambers as the swept mesh, by volumes, sets and solution."""

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.design import cad
from tubefoot.design.analysis_solids import quarter_solids, write_body
from tubefoot.design.finger import FingerDesign
from tubefoot.design.layout import tube_axis
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.errors import ConfigError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.finger_mesh import finger_mesh
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.finger_tetrahedra import TUBES, finger_tetrahedra
from tubefoot.fea.mesh import jacobian_at, scaled_jacobian
from tubefoot.fea.path import follow
from tubefoot.fea.solid_part import SolidPart, build_part
from tubefoot.fea.stride import StepControl
from tubefoot.units import DEG

DESIGN = FingerDesign().with_bellows(units=1)
ROUNDED = DESIGN.with_bellows(fillet_outside_mm=0.4, fillet_chamber_mm=0.5)
MESHES = {}


def tetrahedra(design, ports):
    key = (design.bellows.fillet_outside_mm, ports)
    if key not in MESHES:
        MESHES[key] = finger_tetrahedra(design, 2.5, ports)
    return MESHES[key]


def cell_volumes(mesh):
    block = mesh.blocks[0]
    determinants = np.linalg.det(jacobian_at(mesh.points, block, block.element.quadrature_points))
    return determinants @ block.element.quadrature_weights


def area(mesh, name):
    corners = mesh.points[mesh.facet_set(name).nodes[:, : 3 if mesh.blocks[0].kind == "tetra10" else 4]]
    diagonals = (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if corners.shape[1] == 4:
        diagonals = (corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return np.linalg.norm(np.cross(*diagonals), axis=1).sum() / 2


def test_body_chambers_and_facet_sets_are_those_of_the_swept_mesh():
    mesh, swept = tetrahedra(DESIGN, False), finger_mesh(DESIGN.profile, 2.5)
    assert cell_volumes(mesh).sum() == pytest.approx(cell_volumes(swept).sum(), rel=1e-12)
    for hand in ("right", "left"):
        volumes = [Cavity(m, f"cavity_{hand}", 0).rest_volume for m in (mesh, swept)]
        assert volumes[0] == pytest.approx(volumes[1], rel=1e-12)
    # The side face of a cap and of the valley beside it are one face of the solid.
    assert set(swept.facets) - set(mesh.facets) == {"cap_outside"}
    assert set(mesh.facets) < set(swept.facets)
    for name in mesh.facets:
        if not name.startswith("valley_outside"):
            assert area(mesh, name) == pytest.approx(area(swept, name), rel=1e-9), name
    assert mesh.regions == swept.regions


def test_fillets_and_ports_have_the_volumes_of_the_solids():
    solids = quarter_solids(ROUNDED, ports=True)
    mesh = tetrahedra(ROUNDED, True)
    volumes = cell_volumes(mesh)
    tubes = mesh.blocks[0].region == mesh.regions.index(TUBES)
    assert volumes[tubes].sum() == pytest.approx(2 * cad.volume(solids["tubes"]), rel=1e-2)
    assert volumes[~tubes].sum() == pytest.approx(2 * cad.volume(solids["body"]), rel=3e-3)
    p, ports = ROUNDED.profile, ROUNDED.ports
    depth = p.cap + ports.length_mm / 2
    ideal = chamber_rest_volume(p) / 2
    bores = 2 * depth * np.pi / 4 * ports.bore_mm**2 / 2
    assert Cavity(mesh, "cavity_right", 0).rest_volume - ideal == pytest.approx(bores, rel=2e-2)
    x = mesh.points[np.unique(mesh.blocks[0].nodes[tubes]), 0]
    assert np.abs(x).min() == pytest.approx(tube_axis(p, ports) - ports.outer_diameter_mm / 2, abs=1e-6)
    assert scaled_jacobian(mesh).min() > 0


def test_the_mesh_is_its_own_mirror_image_with_points_on_the_centre_line():
    mesh = tetrahedra(ROUNDED, True)
    images = mesh.points * [-1.0, 1.0, 1.0]
    keys = {tuple(point) for point in (mesh.points + 0.0).tolist()}
    assert all(tuple(point) in keys for point in (images + 0.0).tolist())
    line = (mesh.points[:, 0] == 0) & (mesh.points[:, 1] == 0)
    z = np.sort(mesh.points[line, 2])
    assert z[0] == pytest.approx(-DESIGN.profile.cap)
    assert np.diff(z).max() < 2.5


def test_the_exported_body_is_a_part_by_the_names_of_its_faces(tmp_path):
    """Two units: there the middle of a lid lies outside of it. The whole finger, not its half."""
    design = ROUNDED.with_bellows(units=2)
    path = write_body(tmp_path / "body.step", design)
    part = SolidPart(mesh=str(path), body=design.body)
    model = build_part(part, SolveSettings(element_size_mm=4.0))
    assert model.share == 1.0
    fluid = chamber_rest_volume(design.profile)
    assert model.model.rest_volumes == pytest.approx([fluid, fluid], rel=2e-3)
    right = model.mesh.points[model.mesh.facet_set("cavity_right").points, 0]
    assert right.min() == pytest.approx(design.profile.partition_face)


def test_ports_of_the_swept_mesh_are_refused():
    with pytest.raises(ConfigError, match="--mesh-kind tetrahedra"):
        parse_settings({"ports": True}, SolveSettings)


def solved_bend(design, **settings):
    model = build_finger(design, SolveSettings(cavities="pressure", left_over_right=-1.0, **settings))
    path = follow(model.model, model.goal, stepping=StepControl(states=model.settings.states))
    return model.tip(path.steps[-1].state.unknowns)[0] / DEG


def test_both_meshes_of_one_unit_bend_alike_and_without_a_pressure_field_tetrahedra_lock():
    """Coarse meshes, so within three percent; the slow test has fine ones."""
    load = {"target": 2.0, "states": 2}
    fine = {"mesh_kind": "tetrahedra", "element_size_mm": 1.4, **load}
    tetra, swept = solved_bend(DESIGN, **fine), solved_bend(DESIGN, element_size_mm=2.0, **load)
    assert swept > 0.2
    assert tetra == pytest.approx(swept, rel=0.03)
    assert solved_bend(DESIGN, **fine, pressure_space="none") < 0.93 * tetra


@pytest.mark.slow
@pytest.mark.parametrize("design", [DESIGN, ROUNDED], ids=["sharp", "fillets"])
def test_fine_meshes_of_one_unit_bend_alike_within_one_percent(design):
    tetra = solved_bend(design, mesh_kind="tetrahedra", element_size_mm=1.0, target=35.0, states=4)
    swept = solved_bend(design, element_size_mm=1.2, target=35.0, states=4)
    assert tetra == pytest.approx(swept, rel=0.01)
