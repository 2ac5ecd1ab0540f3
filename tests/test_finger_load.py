"""The load case of the benchmark: a mesh recast for the elements of other programs stays the same body."""

import numpy as np
import pytest
from benchmarks.finger_load import FingerLoad

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.file_mesh import face_numbers
from tubefoot.fea.finger_mesh import finger_mesh
from tubefoot.fea.mesh import jacobian_at
from tubefoot.fea.named_mesh import outer_faces
from tubefoot.fea.recast import FACETS, recast

DESIGN = FingerDesign().with_bellows(units=1)
MESH = finger_mesh(DESIGN.profile, 3.0)


def volume(mesh):
    block = mesh.blocks[0]
    determinants = np.linalg.det(jacobian_at(mesh.points, block, block.element.quadrature_points))
    assert determinants.min() > 0.0
    return (determinants * block.element.quadrature_weights).sum()


@pytest.mark.parametrize("kind", FACETS)
def test_a_recast_finger_has_the_same_solid_and_chambers(kind):
    mesh = recast(MESH, kind)
    assert mesh.blocks[0].kind == kind
    assert volume(mesh) == pytest.approx(volume(MESH), rel=1e-12)
    for hand in ("right", "left"):
        chambers = [Cavity(m, f"cavity_{hand}", 0).rest_volume for m in (mesh, MESH)]
        assert chambers[0] == pytest.approx(chambers[1], rel=1e-12)


def test_each_wall_facet_of_the_tetrahedra_is_an_outer_face_of_one_cell():
    mesh = recast(MESH, "tetra10")
    wall = mesh.facet_set("cavity_right").nodes
    assert len(wall) == 2 * len(MESH.facet_set("cavity_right").nodes)
    corners = outer_faces(mesh.blocks[0])[:, :3]
    rows = np.array(list(face_numbers(wall[:, :3], corners)))
    assert (rows >= 0).all()
    assert len(np.unique(rows)) == len(rows)


def test_the_angle_of_a_turned_tip_is_the_turn():
    load = FingerLoad(DESIGN, MESH, (0.0, 0.0))
    turn = np.deg2rad(-12.0)
    matrix = np.array(
        [[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]]
    )
    displacements = MESH.points @ matrix.T - MESH.points + 3.0
    assert load.bend_deg(displacements) == pytest.approx(12.0, rel=1e-12)
