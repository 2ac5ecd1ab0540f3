"""Element tables against VTK's parametric coordinates, exact polynomials and exact integrals."""

from itertools import product
from math import factorial

import numpy as np
import pytest
import vtkmodules.vtkCommonDataModel as vtk

from tubefoot.errors import ConfigError
from tubefoot.fea.elements import element_kind

VTK_CELLS = {
    "hexahedron27": vtk.vtkTriQuadraticHexahedron,
    "hexahedron20": vtk.vtkQuadraticHexahedron,
    "hexahedron8": vtk.vtkHexahedron,
    "tetra10": vtk.vtkQuadraticTetra,
    "tetra4": vtk.vtkTetra,
    "quad9": vtk.vtkBiQuadraticQuad,
    "quad8": vtk.vtkQuadraticQuad,
    "quad": vtk.vtkQuad,
    "triangle6": vtk.vtkQuadraticTriangle,
    "triangle": vtk.vtkTriangle,
}
SOLIDS = ["hexahedron27", "hexahedron20", "hexahedron8", "tetra10", "tetra4"]


def is_box(name):
    return name.startswith(("hexahedron", "quad"))


def to_vtk(name, points):
    """Reference coordinates as VTK has them: boxes on [0, 1]."""
    full = np.zeros((len(points), 3))
    full[:, : points.shape[1]] = (points + 1) / 2 if is_box(name) else points
    return full


@pytest.mark.parametrize("name", VTK_CELLS)
def test_nodes_lie_at_the_parametric_coordinates_of_vtk(name):
    kind, cell = element_kind(name), VTK_CELLS[name]()
    theirs = np.array(cell.GetParametricCoords()).reshape(-1, 3)
    assert to_vtk(name, kind.nodes) == pytest.approx(theirs, abs=1e-14)


@pytest.mark.parametrize("name", VTK_CELLS)
def test_shape_functions_and_slopes_are_those_of_vtk(name):
    kind, cell = element_kind(name), VTK_CELLS[name]()
    rng = np.random.default_rng(3)
    points = rng.uniform(0.05, 0.3, (6, kind.nodes.shape[1]))
    n, dim = kind.n_nodes, kind.nodes.shape[1]
    for point, shape, slope in zip(points, kind.shape(points), kind.shape_gradient(points), strict=True):
        values, slopes = [0.0] * n, [0.0] * (dim * n)
        cell.InterpolateFunctions(to_vtk(name, point[None])[0], values)
        assert shape == pytest.approx(values, abs=1e-13)
        if hasattr(cell, "InterpolateDerivs"):
            cell.InterpolateDerivs(to_vtk(name, point[None])[0], slopes)
            scale = 0.5 if is_box(name) else 1.0
            assert pytest.approx(scale * np.reshape(slopes, (dim, n)), abs=1e-12) == slope.T


@pytest.mark.parametrize("name", SOLIDS)
def test_faces_are_those_of_vtk_and_point_outwards(name):
    kind, cell = element_kind(name), VTK_CELLS[name]()
    for k in range(kind.n_nodes):
        cell.GetPointIds().SetId(k, k)
    theirs = set()
    for k in range(cell.GetNumberOfFaces()):
        ids = cell.GetFace(k).GetPointIds()
        theirs.add(frozenset(ids.GetId(i) for i in range(ids.GetNumberOfIds())))
    assert {frozenset(face) for face in kind.faces} == theirs
    face_kind = element_kind(kind.face_kind)
    for face in kind.faces:
        slope = face_kind.shape_gradient(face_kind.quadrature_points)
        tangents = np.einsum("ai,qas->qsi", kind.nodes[list(face)], slope)
        normal = np.cross(tangents[:, 0], tangents[:, 1])
        outwards = kind.nodes[list(face)].mean(axis=0) - kind.nodes[: kind.n_corners].mean(axis=0)
        assert (normal @ outwards > 0).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_of_a_cell_integrate_to_zero_and_its_surface_to_its_volume(name):
    """Also on a distorted cell: the discrete divergence theorem."""
    kind = element_kind(name)
    positions = kind.nodes + np.random.default_rng(1).uniform(-0.05, 0.05, kind.nodes.shape)
    matrices = np.einsum("ai,qaj->qij", positions, kind.shape_gradient(kind.quadrature_points))
    volume = np.linalg.det(matrices) @ kind.quadrature_weights
    face_kind = element_kind(kind.face_kind)
    shape, slope = (
        face_kind.shape(face_kind.quadrature_points),
        face_kind.shape_gradient(face_kind.quadrature_points),
    )
    total, flux = np.zeros(3), 0.0
    for face in kind.faces:
        corners = positions[list(face)]
        tangents = np.einsum("ai,qas->qsi", corners, slope)
        normal = np.cross(tangents[:, 0], tangents[:, 1]) * face_kind.quadrature_weights[:, None]
        total += normal.sum(axis=0)
        flux += np.einsum("qi,qi->", shape @ corners, normal) / 3
    assert total == pytest.approx(np.zeros(3), abs=1e-12)
    # The tetrahedral rule has degree 3: exact for the volume of a straight tetra10 only.
    assert flux == pytest.approx(volume, rel=3e-4 if name == "tetra10" else 1e-12)


def exact_integral(name, powers):
    if is_box(name):
        return np.prod([2.0 / (p + 1) if p % 2 == 0 else 0.0 for p in powers])
    return np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + len(powers))


@pytest.mark.parametrize(
    ("name", "degree"),
    [
        ("hexahedron27", 5),
        ("hexahedron20", 5),
        ("hexahedron8", 3),
        ("tetra10", 3),
        ("tetra4", 3),
        ("quad9", 5),
        ("quad8", 5),
        ("quad", 5),
        ("triangle6", 5),
        ("triangle", 5),
    ],
)
def test_quadrature_is_exact_to_its_degree_and_not_beyond(name, degree):
    kind = element_kind(name)
    dim = kind.nodes.shape[1]

    def error(powers):
        values = np.prod(kind.quadrature_points ** np.array(powers), axis=1)
        return abs(values @ kind.quadrature_weights - exact_integral(name, powers))

    below = [p for p in product(range(degree + 1), repeat=dim) if is_box(name) or sum(p) <= degree]
    assert max(map(error, below)) < 1e-14
    assert (kind.quadrature_weights > 0).all()
    beyond = [p for p in product(range(degree + 2), repeat=dim) if is_box(name) or sum(p) <= degree + 1]
    assert max(map(error, beyond)) > 1e-5


def test_corner_shape_is_one_at_its_corner_and_linear_between():
    for name in ("hexahedron27", "hexahedron20", "tetra10"):
        kind = element_kind(name)
        values = kind.corner_shape(kind.nodes)
        assert values[: kind.n_corners] == pytest.approx(np.eye(kind.n_corners), abs=1e-14)
        assert values @ kind.nodes[: kind.n_corners] == pytest.approx(kind.nodes, abs=1e-14)


def test_an_unknown_cell_type_is_refused_with_those_that_are_known():
    with pytest.raises(ConfigError, match=r"`wedge15` is not supported; supported: .*hexahedron27"):
        element_kind("wedge15")
