"""Element kinds: shape functions, quadrature and faces, in the node order of VTK and meshio.

A displacement element comes with a pressure space. Discontinuous spaces are eliminated inside the element;
a continuous one (Taylor-Hood) has its unknowns at the element's corners. What locks and what does not is
measured in `docs/verification.md`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PressureSpace = Literal["linear", "constant", "continuous", "none"]
"""linear: discontinuous, linear in space; continuous: Taylor-Hood; none: displacement only (locks)."""


@dataclass(frozen=True)
class ElementKind:
    """Shape functions and quadrature of one kind of cell.

    monomials : (n_nodes, 3) powers of the reference coordinates that span the shape functions
    nodes : (n_nodes, 3) reference coordinates of the nodes
    quadrature_points : (n_q, 3), quadrature_weights : (n_q,)
    n_corners : how many of the first nodes are corners
    n_shared : how many of the first nodes can be shared with a neighbour; the rest is interior
    faces : local node numbers of each face, normals pointing out of the cell
    """

    name: str
    monomials: IntArray
    nodes: FloatArray
    quadrature_points: FloatArray
    quadrature_weights: FloatArray
    n_corners: int
    n_shared: int
    face_kind: str
    faces: tuple[tuple[int, ...], ...]

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.nodes)

    def shape(self, points: FloatArray) -> FloatArray:
        """Shape functions, (n_points, n_nodes).

        points : (n_points, dim) reference coordinates
        """
        return _monomials(points, self.monomials) @ self._coefficients

    def shape_gradient(self, points: FloatArray) -> FloatArray:
        """Derivatives of the shape functions, (n_points, n_nodes, dim).

        points : (n_points, dim) reference coordinates
        """
        slopes = []
        for axis in range(self.nodes.shape[1]):
            lowered = self.monomials.copy()
            lowered[:, axis] = np.maximum(lowered[:, axis] - 1, 0)
            slopes.append(_monomials(points, lowered) * self.monomials[:, axis] @ self._coefficients)
        return np.stack(slopes, axis=-1)

    def corner_shape(self, points: FloatArray) -> FloatArray:
        """Lowest-order shape functions of the corners, (n_points, n_corners).

        points : (n_points, dim) reference coordinates
        """
        lowest = {"hexahedron27": "hexahedron8", "tetra10": "tetra4", "hexahedron20": "hexahedron8"}
        return element_kind(lowest[self.name]).shape(points)

    @property
    def _coefficients(self) -> FloatArray:
        return _inverse_vandermonde(self.name)


@cache
def element_kind(name: str) -> ElementKind:
    """The element kind of a meshio cell type.

    name : hexahedron27, hexahedron20, hexahedron8, tetra10, tetra4, quad9, quad8, triangle6, ...

    Raises ConfigError for a type that is not supported.
    """
    try:
        return _BUILDERS[name]()
    except KeyError:
        known = ", ".join(sorted(_BUILDERS))
        raise ConfigError(f"element type `{name}` is not supported; supported: {known}") from None


def _monomials(points: FloatArray, powers: IntArray) -> FloatArray:
    return np.prod(np.asarray(points)[:, None, :] ** powers[None], axis=2)


@cache
def _inverse_vandermonde(name: str) -> FloatArray:
    kind = element_kind(name)
    return np.asarray(np.linalg.inv(_monomials(kind.nodes, kind.monomials)), np.float64)


def gauss_line(n: int) -> tuple[FloatArray, FloatArray]:
    """Points and weights of the Gauss rule on [-1, 1].

    n : number of points
    """
    return np.polynomial.legendre.leggauss(n)


def _gauss_box(n: int, dim: int) -> tuple[FloatArray, FloatArray]:
    points, weights = gauss_line(n)
    grid = np.array(list(product(points, repeat=dim)))
    return grid, np.array([np.prod(w) for w in product(weights, repeat=dim)])


def _tetrahedron_rule() -> tuple[FloatArray, FloatArray]:
    """Degree 3, two orbits of four points, all weights positive."""
    first = _barycentric(0.3281633025163817)
    second = _barycentric(0.1080472498984286)
    weight_first, weight_second = 0.1362178425370874, 0.1137821574629126
    weights = np.r_[np.full(4, weight_first), np.full(4, weight_second)] / 6.0
    return np.vstack([first, second]), weights


def _barycentric(three: float) -> FloatArray:
    """The four points that have the same barycentric coordinate `three` thrice."""
    full = np.full((4, 4), three) + np.eye(4) * (1 - 4 * three)
    return full[:, 1:]


_QUAD9 = [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)]
_HEX_CORNERS = [
    *((x, y, -1) for x, y in _QUAD9[:4]),
    *((x, y, 1) for x, y in _QUAD9[:4]),
]
_HEX_EDGES = [
    *((x, y, -1) for x, y in _QUAD9[4:8]),
    *((x, y, 1) for x, y in _QUAD9[4:8]),
    *((x, y, 0) for x, y in _QUAD9[:4]),
]
_HEX_FACES = [(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)]


def _box_faces(
    nodes: Sequence[tuple[int, ...]], face_nodes: Sequence[tuple[int, int]]
) -> tuple[tuple[int, ...], ...]:
    """Faces of the reference box as quads whose normal (first edge x last edge) points out."""
    faces = []
    for axis in range(3):
        for side in (-1, 1):
            others = [(axis + 1) % 3, (axis + 2) % 3]
            if side < 0:
                others.reverse()
            face = []
            for s, t in face_nodes:
                point = [0, 0, 0]
                point[axis], point[others[0]], point[others[1]] = side, s, t
                face.append(nodes.index(tuple(point)))
            faces.append(tuple(face))
    return tuple(faces)


def _hexahedron27() -> ElementKind:
    nodes = [*_HEX_CORNERS, *_HEX_EDGES, *_HEX_FACES, (0, 0, 0)]
    points, weights = _gauss_box(3, 3)
    powers = np.array(list(product(range(3), repeat=3)))
    faces = _box_faces(nodes, _QUAD9)
    return ElementKind("hexahedron27", powers, np.array(nodes, float), points, weights, 8, 26, "quad9", faces)


def _hexahedron20() -> ElementKind:
    nodes = [*_HEX_CORNERS, *_HEX_EDGES]
    points, weights = _gauss_box(3, 3)
    # Serendipity: superlinear degree at most two.
    powers = [p for p in product(range(3), repeat=3) if sum(e for e in p if e > 1) <= 2]
    faces = _box_faces(nodes, _QUAD9[:8])
    return ElementKind(
        "hexahedron20", np.array(powers), np.array(nodes, float), points, weights, 8, 20, "quad8", faces
    )


def _hexahedron8() -> ElementKind:
    points, weights = _gauss_box(2, 3)
    powers = np.array(list(product(range(2), repeat=3)))
    faces = _box_faces(_HEX_CORNERS, _QUAD9[:4])
    nodes = np.array(_HEX_CORNERS, float)
    return ElementKind("hexahedron8", powers, nodes, points, weights, 8, 8, "quad", faces)


_TET_CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_TET_FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


def _tetra10() -> ElementKind:
    corners = np.array(_TET_CORNERS, float)
    nodes = np.vstack([corners, [(corners[i] + corners[j]) / 2 for i, j in _TET_EDGES]])
    points, weights = _tetrahedron_rule()
    powers = np.array([p for p in product(range(3), repeat=3) if sum(p) <= 2])
    faces = tuple((a, b, c, _edge(a, b), _edge(b, c), _edge(c, a)) for a, b, c in _TET_FACES)
    return ElementKind("tetra10", powers, nodes, points, weights, 4, 10, "triangle6", faces)


def _edge(a: int, b: int) -> int:
    return 4 + next(k for k, edge in enumerate(_TET_EDGES) if set(edge) == {a, b})


def _tetra4() -> ElementKind:
    points, weights = _tetrahedron_rule()
    powers = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    nodes = np.array(_TET_CORNERS, float)
    return ElementKind("tetra4", powers, nodes, points, weights, 4, 4, "triangle", tuple(_TET_FACES))


def _quad(name: str, n: int, powers: list[tuple[int, ...]]) -> ElementKind:
    points, weights = _gauss_box(3, 2)
    nodes = np.array(_QUAD9[:n], float)
    return ElementKind(name, np.array(powers), nodes, points, weights, 4, n, "", ())


def _triangle(name: str, n: int) -> ElementKind:
    corners = np.array([(0, 0), (1, 0), (0, 1)], float)
    middles = [(corners[i] + corners[j]) / 2 for i, j in ((0, 1), (1, 2), (2, 0))]
    nodes = np.vstack([corners, middles])[:n]
    powers = [p for p in product(range(3), repeat=2) if sum(p) <= (2 if n == 6 else 1)]
    points, weights = _triangle_rule()
    return ElementKind(name, np.array(powers), nodes, points, weights, 3, n, "", ())


def _triangle_rule() -> tuple[FloatArray, FloatArray]:
    """Degree 5, seven points (Radon 1948)."""
    root = np.sqrt(15.0)
    a, b = (6 - root) / 21, (6 + root) / 21
    points = [(1 / 3, 1 / 3)]
    for t in (a, b):
        points += [(t, t), (1 - 2 * t, t), (t, 1 - 2 * t)]
    weights = [9 / 80] + [(155 - root) / 2400] * 3 + [(155 + root) / 2400] * 3
    return np.array(points), np.array(weights)


_BUILDERS: dict[str, Callable[[], ElementKind]] = {
    "hexahedron27": _hexahedron27,
    "hexahedron20": _hexahedron20,
    "hexahedron8": _hexahedron8,
    "tetra10": _tetra10,
    "tetra4": _tetra4,
    "quad9": lambda: _quad("quad9", 9, list(product(range(3), repeat=2))),
    "quad8": lambda: _quad("quad8", 8, [p for p in product(range(3), repeat=2) if p != (2, 2)]),
    "quad": lambda: _quad("quad", 4, list(product(range(2), repeat=2))),
    "triangle6": lambda: _triangle("triangle6", 6),
    "triangle": lambda: _triangle("triangle", 3),
}
