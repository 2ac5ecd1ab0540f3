"""Meshes of grasped objects: volume, surface, names, and that blocks of different sizes meet."""

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.mesh import jacobian_at
from tubefoot.fea.object_mesh import beside, object_mesh

SIZES = (15.0, 12.0, 26.0)
EDGES = (4.0 - np.pi) * 12.0
"""What four rounded edges of 1 mm radius take off a box 12 mm deep [mm^3]."""
VOLUMES = {
    (): np.prod(SIZES) - EDGES,
    (0, 1, 2): np.pi / 6 * np.prod(SIZES),
    (0, 1): np.pi / 4 * np.prod(SIZES),
    (0, 2): np.pi / 4 * np.prod(SIZES),
}


@pytest.mark.parametrize("axes", VOLUMES)
def test_a_quarter_of_the_object_is_filled(axes):
    mesh = object_mesh(SIZES, axes, 2.5)
    kind = element_kind("hexahedron27")
    sizes = np.linalg.det(jacobian_at(mesh.points, mesh.blocks[0], kind.quadrature_points))
    volume = 4.0 * (sizes * kind.quadrature_weights).sum()
    assert volume == pytest.approx(VOLUMES[axes], rel=1e-3)


@pytest.mark.parametrize("axes", VOLUMES)
def test_outer_faces_close_the_body_and_none_lies_inside(axes):
    """By the divergence theorem int n dA = 0 over a closed surface; a gap between blocks would be a face."""
    mesh = object_mesh(SIZES, axes, 2.5)
    kind = element_kind("quad9")
    nodes = np.vstack([found.nodes for found in mesh.facets.values()])
    slopes = np.einsum("qad,fai->fqdi", kind.shape_gradient(kind.quadrature_points), mesh.points[nodes])
    normals = np.cross(slopes[..., 0, :], slopes[..., 1, :]) * kind.quadrature_weights[:, None]
    assert normals.sum(axis=(0, 1)) == pytest.approx(np.zeros(3), abs=1e-9)
    points = np.einsum("qa,fai->fqi", kind.shape(kind.quadrature_points), mesh.points[nodes])
    assert (np.einsum("fqi,fqi->fq", points, normals) > -1e-9).all(), "an inner face was taken for skin"


def test_the_surface_of_an_ellipsoid_lies_on_it():
    mesh = object_mesh(SIZES, (0, 1, 2), 2.5)
    on_skin = mesh.points[mesh.facet_set("object_skin").points] / (np.array(SIZES) / 2.0)
    assert np.linalg.norm(on_skin, axis=1) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(mesh.points[mesh.facet_set("object_middle").points, 0]).max() < 1e-9
    assert np.abs(mesh.points[mesh.facet_set("object_cut").points, 1]).max() < 1e-9


def test_sizes_and_radii_that_cannot_be_are_refused():
    with pytest.raises(ConfigError, match="must be > 0"):
        object_mesh((10.0, 0.0, 10.0), (), 2.0)
    with pytest.raises(ConfigError, match="edge radius 5 mm"):
        object_mesh((10.0, 10.0, 10.0), (), 2.0, edge_radius=5.0)


def test_two_bodies_in_one_mesh_keep_their_names_and_places():
    one = object_mesh((10.0, 10.0, 10.0), (), 4.0)
    with pytest.raises(ConfigError, match="no name is shared"):
        beside(one, one, (20.0, 0.0, 0.0))
