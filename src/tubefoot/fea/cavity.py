"""Fluid cavities: volume of a closed wall with its exact derivatives, and the load that its pressure is.

V = 1/3 int x . n dA over the wall, n out of the fluid. The first and second derivatives by the nodal
positions are those of the discrete formula, so pressure loads have a symmetric stiffness. A wall that ends
on symmetry planes through the origin is closed by them: there x . n = 0.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.errors import GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@njit(cache=True)
def facet_volumes(  # type: ignore[no-untyped-def]
    positions, shape, slope_s, slope_t, weights, stiff, volume, gradient, hessian
):
    """Volume contributions -1/3 int x . (x_s x x_t) of facets, and their derivatives.

    positions : (n_facets, n_nodes, 3) [mm], normals out of the solid, so into the fluid
    shape, slope_s, slope_t : (n_q, n_nodes); weights : (n_q,); stiff : whether the hessian is wanted
    volume : (n_facets,), gradient : (n_facets, 3 n_nodes), hessian : (n_facets, 3 n_nodes, 3 n_nodes) out
    """
    n_facets, n_nodes = positions.shape[:2]
    x, s, t = np.empty(3), np.empty(3), np.empty(3)
    volume[:] = 0.0
    gradient[:] = 0.0
    if stiff:
        hessian[:] = 0.0
    for facet in range(n_facets):
        for q in range(weights.shape[0]):
            factor = -weights[q] / 3.0
            x[:], s[:], t[:] = 0.0, 0.0, 0.0
            for a in range(n_nodes):
                for i in range(3):
                    x[i] += shape[q, a] * positions[facet, a, i]
                    s[i] += slope_s[q, a] * positions[facet, a, i]
                    t[i] += slope_t[q, a] * positions[facet, a, i]
            st, tx, xs = np.cross(s, t), np.cross(t, x), np.cross(x, s)
            volume[facet] += factor * (x[0] * st[0] + x[1] * st[1] + x[2] * st[2])
            for a in range(n_nodes):
                for i in range(3):
                    gradient[facet, 3 * a + i] += factor * (
                        shape[q, a] * st[i] + slope_s[q, a] * tx[i] + slope_t[q, a] * xs[i]
                    )
            if not stiff:
                continue
            # Second derivative: e_ijk v_k with v made of the third vector of the triple product.
            for a in range(n_nodes):
                for b in range(n_nodes):
                    with_t = shape[q, a] * slope_s[q, b] - slope_s[q, a] * shape[q, b]
                    with_s = slope_t[q, a] * shape[q, b] - shape[q, a] * slope_t[q, b]
                    with_x = slope_s[q, a] * slope_t[q, b] - slope_t[q, a] * slope_s[q, b]
                    for i in range(3):
                        j, k = (i + 1) % 3, (i + 2) % 3
                        value = factor * (with_t * t[k] + with_s * s[k] + with_x * x[k])
                        hessian[facet, 3 * a + i, 3 * b + j] += value
                        hessian[facet, 3 * a + j, 3 * b + i] -= value


def _require_closed(mesh: Mesh, facets: str) -> None:
    """Every edge of the wall that only one facet has must lie in a coordinate plane through the origin."""
    wall = mesh.facet_set(facets)
    corners = wall.nodes[:, : element_kind(wall.kind).n_corners]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    rim = edges[first[count == 1]]
    size = float(np.ptp(mesh.points, axis=0).max())
    in_plane = (np.abs(mesh.points[rim]) < 1e-9 * size).all(axis=1).any(axis=1)
    if not in_plane.all():
        x, y, z = mesh.points[rim[~in_plane][0, 0]]
        raise GeometryError(
            f"the cavity wall `{facets}` is open near x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm: close it, or "
            "let its rim lie in a coordinate plane through the origin (a plane of symmetry)"
        )


class Cavity:
    """The fluid inside a closed wall; as an item it adds the work of its pressure."""

    def __init__(self, mesh: Mesh, facets: str, number: int, air_volume: float = 0.0):
        """Prepare the wall.

        mesh : the mesh; facets : name of the wall's facet set
        number : which of the state's pressures is this fluid's
        air_volume : volume of the trapped-air column of its pressure branch at zero gauge [mm^3]

        Raises GeometryError when the wall has an opening that no symmetry plane closes.
        """
        self.name = facets
        self.number = number
        self.air_volume = air_volume
        wall = mesh.facet_set(facets)
        kind = element_kind(wall.kind)
        _require_closed(mesh, facets)
        self._nodes = wall.nodes
        self._rest = mesh.points
        self._shape = kind.shape(kind.quadrature_points)
        slopes = kind.shape_gradient(kind.quadrature_points)
        self._slopes = np.ascontiguousarray(np.moveaxis(slopes, -1, 0))
        self._weights = kind.quadrature_weights
        self.pattern: IntArray = (3 * wall.nodes[:, :, None] + np.arange(3)).reshape(len(wall.nodes), -1)
        size = self.pattern.shape[1]
        self._volumes = np.empty(len(wall.nodes))
        self._gradients = np.empty((len(wall.nodes), size))
        self._hessians = np.empty((len(wall.nodes), size, size))
        self.volume = self.rest_volume = 0.0
        self.evaluate(np.zeros(mesh.points.size))
        self.rest_volume = self.volume

    def evaluate(self, unknowns: FloatArray, stiff: bool = False) -> float:
        """Volume of the fluid [mm^3]; keeps its derivatives for `gradient` and `assemble`.

        unknowns : (n,) displacements first [mm]; stiff : whether second derivatives are wanted
        """
        n = self._rest.size
        positions = (self._rest + unknowns[:n].reshape(-1, 3))[self._nodes]
        facet_volumes(
            positions,
            self._shape,
            self._slopes[0],
            self._slopes[1],
            self._weights,
            stiff,
            self._volumes,
            self._gradients,
            self._hessians,
        )
        self.volume = float(self._volumes.sum())
        return self.volume

    def gradient(self, n_unknowns: int) -> FloatArray:
        """Derivative of the volume by the unknowns at the last evaluation, (n_unknowns,) [mm^2].

        n_unknowns : length of the vector
        """
        summed: FloatArray = np.bincount(
            self.pattern.ravel(), self._gradients.ravel(), minlength=n_unknowns
        ).astype(float, copy=False)
        return summed

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the load -p dV and its stiffness -p d2V into the sink.

        state : where to evaluate; sink : takes the parts; found : unchanged, a fluid stores nothing here
        """
        self.evaluate(state.unknowns, sink.stiff)
        pressure = state.pressures[self.number]
        matrices = -pressure * self._hessians if sink.stiff else self._hessians
        sink.add(self, 0, matrices, -pressure * self._gradients)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """
