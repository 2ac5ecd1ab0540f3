"""Meshes and rays against shapes whose answers are known, and against VTK's ray casting."""

import numpy as np
import pytest
import pyvista

from tubefoot.design.measure import unseen_share
from tubefoot.design.raycast import blocked, crossings
from tubefoot.design.surface import TriangleMesh


def block(low, high) -> TriangleMesh:
    box = pyvista.Box(bounds=np.column_stack([low, high]).ravel()).triangulate()
    mesh = TriangleMesh.merged(np.asarray(box.points, float), box.regular_faces.astype(np.int64))
    return mesh if mesh.volume > 0 else TriangleMesh(mesh.points, mesh.triangles[:, ::-1])


def inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.points, mesh.triangles[:, ::-1])


def test_a_block_is_closed_and_has_its_volume():
    mesh = block([0, 0, 0], [2, 3, 4])
    assert len(mesh.points) == 8
    assert mesh.open_edges() == 0
    assert mesh.volume == pytest.approx(24.0)
    assert mesh.size == pytest.approx([2, 3, 4])


def test_a_hole_and_a_flipped_facet_are_found():
    mesh = block([0, 0, 0], [1, 1, 1])
    assert TriangleMesh(mesh.points, mesh.triangles[1:]).open_edges() == 3
    flipped = mesh.triangles.copy()
    flipped[0] = flipped[0, ::-1]
    assert TriangleMesh(mesh.points, flipped).open_edges() > 0
    doubled = np.vstack([mesh.triangles, mesh.triangles[:1]])
    assert TriangleMesh(mesh.points, doubled).open_edges() > 0


def test_a_rotation_keeps_the_volume_and_the_orientation():
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    moved = block([0, 0, 0], [1, 2, 3]).moved(turn, np.array([5.0, 0.0, 0.0]))
    assert moved.volume == pytest.approx(6.0)
    assert moved.size == pytest.approx([3, 1, 2])
    assert moved.bounds[0] == pytest.approx([5, 0, 0])


def test_crossings_agree_with_vtk():
    ball = pyvista.Sphere(radius=3.0, theta_resolution=20, phi_resolution=20)
    mesh = TriangleMesh.merged(np.asarray(ball.points, float), ball.regular_faces.astype(np.int64))
    rng = np.random.default_rng(1)
    for _ in range(50):
        origin = np.array([-6.0, *rng.uniform(-2.5, 2.5, 2)])
        towards = np.array([1.0, *rng.uniform(-0.2, 0.2, 2)])
        towards /= np.linalg.norm(towards)
        points, _ = ball.ray_trace(origin, origin + 12 * towards)
        expected = np.sort(np.linalg.norm(points - origin, axis=1))
        assert crossings(mesh, origin, towards)[0] == pytest.approx(expected, abs=1e-5)


def test_a_ray_through_an_edge_counts_once():
    along, _ = crossings(block([0, 0, 0], [1, 1, 1]), np.array([0.5, 0.5, -1.0]), np.array([0.0, 0.0, 1.0]))
    assert along == pytest.approx([1.0, 2.0])


def test_blocked_agrees_with_single_rays():
    hollow = TriangleMesh.together([block([0, 0, 0], [4, 4, 4]), block([6, 1, 1], [8, 3, 3])])
    rng = np.random.default_rng(2)
    origins = rng.uniform([-2, -2, -2], [10, 6, 6], (400, 3))
    direction = np.array([0.6, 0.64, 0.48])
    expected = [len(crossings(hollow, origin, direction)[0]) > 0 for origin in origins]
    assert blocked(hollow, origins, direction).tolist() == expected
    assert 20 < sum(expected) < 380


def test_an_enclosed_cavity_is_out_of_reach_and_an_open_one_is_not():
    outside, cavity = block([0, 0, 0], [10, 10, 10]), inside_out(block([3, 3, 3], [7, 7, 7]))
    closed = TriangleMesh.together([outside, cavity])
    assert unseen_share(closed) == pytest.approx(6 * 16 / (600 + 96))
    assert unseen_share(outside) == 0.0
