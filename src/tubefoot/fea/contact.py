"""Frictionless contact of a wall with itself: a barrier that grows smoothly from a small reach on.

Each quadrature point of the wall looks for the facet opposite and carries, per undeformed area, half of

    w(g) = k / (3 d) max(0, d - g)^3,   pressure -w'(g) = k / d (d - g)^2,

the other half coming from the points over there, so that neither side is master. g is the distance to the
closest point of the curved facet (`proximity`), d the reach: nothing acts across a wider gap. The energy is
that of g(u) with the closest point eliminated, so its residual and tangent are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.proximity import closest_point, facet_powers, find_opposite

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MANY = 12
"""Facets opposite one sample that are remembered."""


@dataclass(frozen=True)
class Barrier:
    """How two walls repel each other.

    reach : gap from which on they do [mm]
    stiffness : k [N/mm^3]; at zero gap the pressure is k * reach
    depth : penetration up to which a partner is looked for [mm], less than the thinnest wall
    ahead : gap up to which possible partners are prepared for [mm]
    """

    reach: float = 0.1
    stiffness: float = 3.0
    depth: float = 0.6
    ahead: float = 1.2

    def pressure(self, gap: FloatArray) -> FloatArray:
        """Contact pressure [MPa] at some gaps.

        gap : [mm]
        """
        return self.stiffness / self.reach * np.maximum(0.0, self.reach - gap) ** 2


@njit(cache=True, error_model="numpy")
def add_contact(  # type: ignore[no-untyped-def]
    gap, normal, surface, place_slopes, own_shape, other_shape, weight, barrier, residual, matrix
):
    """Add a sample's energy to an element of its own facet's nodes and the other's; the energy [mJ].

    gap : below the reach; normal : (3,); surface : (6, 3) of `surface_at`
    place_slopes : (2, n) slopes of the other facet's shape functions at the closest point
    own_shape, other_shape : (n,); weight : undeformed area [mm^2]; barrier : (reach, stiffness)
    residual : (6 n,), matrix : (6 n, 6 n) in and out
    """
    reach, stiffness = barrier
    n = own_shape.shape[0]
    excess = reach - gap
    first = -weight * stiffness / reach * excess * excess
    second = 2.0 * weight * stiffness / reach * excess
    # Metric less gap times curvature, inverted (c); a^-1 b c (h).
    a00 = a01 = a11 = b00 = b01 = b11 = 0.0
    for i in range(3):
        a00 += surface[1, i] * surface[1, i]
        a01 += surface[1, i] * surface[2, i]
        a11 += surface[2, i] * surface[2, i]
        b00 += normal[i] * surface[3, i]
        b01 += normal[i] * surface[4, i]
        b11 += normal[i] * surface[5, i]
    m00, m01, m11 = a00 - gap * b00, a01 - gap * b01, a11 - gap * b11
    determinant = m00 * m11 - m01 * m01
    c00, c01, c11 = m11 / determinant, -m01 / determinant, m00 / determinant
    area = a00 * a11 - a01 * a01
    p00, p01 = (a11 * b00 - a01 * b01) / area, (a11 * b01 - a01 * b11) / area
    p10, p11 = (a00 * b01 - a01 * b00) / area, (a00 * b11 - a01 * b01) / area
    h = np.empty((2, 2))
    h[0, 0], h[0, 1] = p00 * c00 + p01 * c01, p00 * c01 + p01 * c11
    h[1, 0], h[1, 1] = p10 * c00 + p11 * c01, p10 * c01 + p11 * c11
    c = np.array([[c00, c01], [c01, c11]])
    tangents = surface[1:3]
    # c applied to the tangents, h applied to both sides of them.
    ct = np.empty((2, 3))
    tht = np.empty((3, 3))
    for i in range(3):
        for s in range(2):
            ct[s, i] = c[s, 0] * tangents[0, i] + c[s, 1] * tangents[1, i]
    for i in range(3):
        for j in range(3):
            tht[i, j] = 0.0
            for s in range(2):
                for t in range(2):
                    tht[i, j] += h[s, t] * tangents[s, i] * tangents[t, j]
    w = np.empty(2 * n)
    v = np.zeros((2, 2 * n))
    for a in range(n):
        w[a] = own_shape[a]
        w[n + a] = -other_shape[a]
        v[0, n + a] = place_slopes[0, a]
        v[1, n + a] = place_slopes[1, a]
    for a in range(2 * n):
        for i in range(3):
            residual[3 * a + i] += first * w[a] * normal[i]
    for a in range(2 * n):
        for b in range(2 * n):
            ww = w[a] * w[b]
            bending = 0.0
            for s in range(2):
                for t in range(2):
                    bending += c[s, t] * v[s, a] * v[t, b]
            for i in range(3):
                left = ct[0, i] * v[0, b] + ct[1, i] * v[1, b]
                for j in range(3):
                    right = ct[0, j] * v[0, a] + ct[1, j] * v[1, a]
                    curved = ww * tht[i, j] + w[a] * normal[j] * left + w[b] * normal[i] * right
                    curved += gap * normal[i] * normal[j] * bending
                    matrix[3 * a + i, 3 * b + j] += second * ww * normal[i] * normal[j] - first * curved
    return weight * stiffness / (3.0 * reach) * excess**3


@njit(cache=True, error_model="numpy")
def assemble_contacts(  # type: ignore[no-untyped-def]
    points,
    facet,
    row,
    places,
    gaps,
    powers,
    coefficients,
    polynomials,
    own_shapes,
    weights,
    barrier,
    residuals,
    matrices,
):
    """The energy [mJ] of all samples with a partner; nan where a closest point got lost.

    points : (n_samples, 3); facet : (n_samples,) partner or -1; row : (n_samples,) element of the pair
    places : (n_samples, 2) in and out; gaps : (n_samples,) out, infinite without a partner
    powers, coefficients : see `facet_powers`; polynomials : (n_facets, n_monomials, 3)
    own_shapes : (n_q, n_nodes), of sample k at k % n_q; weights : (n_samples,) [mm^2]
    barrier : (reach, stiffness)
    residuals : (n_pairs, 6 n_nodes), matrices : (n_pairs, 6 n_nodes, 6 n_nodes) out
    """
    residuals[:] = 0.0
    matrices[:] = 0.0
    n_q, n = own_shapes.shape
    surface, normal = np.empty((6, 3)), np.empty(3)
    basis = np.empty((powers.shape[0], 3))
    shapes = np.empty((3, n))
    total = 0.0
    for sample in range(points.shape[0]):
        gaps[sample] = np.inf
        other = facet[sample]
        if other < 0:
            continue
        place = places[sample]
        gap = closest_point(powers, polynomials[other], points[sample], place, surface, normal)
        gaps[sample] = gap
        if np.isnan(gap):
            return np.nan
        if gap >= barrier[0]:
            continue
        s, t = place
        for m in range(powers.shape[0]):
            a, b = powers[m]
            basis[m, 0] = s**a * t**b
            basis[m, 1] = a * s ** max(a - 1, 0) * t**b
            basis[m, 2] = s**a * b * t ** max(b - 1, 0)
        for k in range(3):
            for c in range(n):
                shapes[k, c] = 0.0
                for m in range(powers.shape[0]):
                    shapes[k, c] += basis[m, k] * coefficients[m, c]
        total += add_contact(
            gap,
            normal,
            surface,
            shapes[1:],
            own_shapes[sample % n_q],
            shapes[0],
            weights[sample],
            barrier,
            residuals[row[sample]],
            matrices[row[sample]],
        )
    return total


class SelfContact:
    """Contact of a surface with itself; as an item it adds the barrier's energy."""

    def __init__(self, mesh: Mesh, surface: Sequence[str], barrier: Barrier | None = None):
        """Prepare the samples; the reach is cut to half the smallest gap at rest.

        mesh : the mesh; surface : names of the facet sets that make up the surface, of one facet kind
        barrier : how its parts repel each other

        Raises ConfigError for facets of several kinds, GeometryError when the walls touch at rest.
        """
        sets = [mesh.facet_set(name) for name in surface]
        if len({found.kind for found in sets}) != 1:
            raise ConfigError(f"the surface {', '.join(surface)} has facets of several kinds")
        self.barrier = barrier or Barrier()
        kind = element_kind(sets[0].kind)
        self.nodes = np.ascontiguousarray(np.vstack([found.nodes for found in sets]))
        names = np.repeat(np.arange(len(sets)), [len(found.nodes) for found in sets])
        self._labels = [surface[int(k)] for k in names]
        self._rest = mesh.points
        self._triangle = kind.n_corners == 3
        self._powers, self._coefficients = facet_powers(kind)
        self._shape = np.ascontiguousarray(kind.shape(kind.quadrature_points))
        self._slopes = kind.shape_gradient(kind.quadrature_points)
        self._own = np.repeat(np.arange(len(self.nodes)), len(self._shape))
        normals = self._area_vectors(mesh.points)
        shares = np.tile(kind.quadrature_weights, len(self.nodes))
        self._weights: FloatArray = 0.5 * shares * np.linalg.norm(normals, axis=1)
        n = len(self._own)
        self._facet, self._row = np.full(n, -1), np.full(n, -1)
        self._places, self.gaps = np.zeros((n, 2)), np.full(n, np.inf)
        self._keep(np.empty(0, dtype=np.int64))
        self._looked_at: FloatArray | None = None
        rest = State(np.zeros(mesh.points.size), np.zeros(0), 0.0)
        gap, where = self.smallest_gap(rest, 2 * self.barrier.reach)
        if gap < 0.01:
            raise GeometryError(f"walls touch at rest: {where}, gap {gap:.3g} mm, must be at least 0.01 mm")
        self.barrier = replace(self.barrier, reach=min(self.barrier.reach, gap / 2))

    def look(self, state: State) -> tuple[bool, bool]:
        """Give every sample its partner anew: whether one that matters changed, and whether the pattern grew.

        state : where to look
        """
        barrier = self.barrier
        if self._far(state):
            return False, False
        facet, places, gaps, others = self._opposite(state, barrier.ahead)
        self._looked_at = state.unknowns[: self._rest.size].copy()
        matters = (gaps < barrier.reach) | (self.gaps < barrier.reach)
        changed = bool((facet != self._facet)[matters].any())
        close = gaps < self._close
        facet[~close] = -1
        keys = self._own * len(self.nodes) + facet
        grew = not np.isin(keys[close], self._pairs).all()
        if grew:
            sample, slot = np.nonzero(others >= 0)
            found = self._own[sample] * len(self.nodes) + others[sample, slot]
            self._keep(np.union1d(self._pairs, found))
        self._facet, self._places, self.gaps = facet, places, gaps
        self._row = np.where(close, np.searchsorted(self._pairs, keys), -1)
        return changed, grew

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the contact forces and their stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy and magnitude
        """
        if not (self._facet >= 0).any():
            return
        positions = self._positions(state)
        energy = assemble_contacts(
            self._sampled(positions),
            self._facet,
            self._row,
            self._places,
            self.gaps,
            self._powers,
            self._coefficients,
            self._coefficients @ positions[self.nodes],
            self._shape,
            self._weights,
            (self.barrier.reach, self.barrier.stiffness),
            self._residuals,
            self._matrices,
        )
        if np.isnan(energy):
            found.min_gap = -np.inf
            return
        found.energy += energy
        found.min_gap = min(found.min_gap, float(self.gaps.min()))
        found.magnitude = max(found.magnitude, float(np.abs(self._residuals).max(initial=0.0)))
        sink.add(self, 0, self._matrices, self._residuals)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """

    def smallest_gap(self, state: State, within: float) -> tuple[float, str]:
        """The smallest gap [mm], negative for a penetration, and between which walls.

        Infinite where none is smaller than `within`.

        state : where to look; within : largest gap looked for [mm]
        """
        facet, _, gaps, _ = self._opposite(state, within, remembered=0)
        sample = int(np.argmin(gaps))
        if facet[sample] < 0:
            return float("inf"), ""
        pair = sorted({self._labels[self._own[sample]], self._labels[facet[sample]]})
        return float(gaps[sample]), " and ".join(name.replace("_", " ") for name in pair)

    def pressures(self) -> FloatArray:
        """Contact pressure at the samples at the last evaluation, (n_samples,) [MPa]."""
        return self.barrier.pressure(self.gaps)

    def _far(self, state: State) -> bool:
        """Whether nothing can have come close since the last look."""
        if self._looked_at is None or (self._facet >= 0).any():
            return False
        moved = (state.unknowns[: self._rest.size] - self._looked_at).reshape(-1, 3)
        spare = min(float(self.gaps.min()), self.barrier.ahead) - self._close
        return 2.0 * float(np.linalg.norm(moved, axis=1).max()) < spare

    @property
    def _close(self) -> float:
        """Gap below which a sample has a partner [mm]: before the reach, since Newton moves the walls."""
        return (self.barrier.reach + self.barrier.ahead) / 3

    def _keep(self, pairs: IntArray) -> None:
        """Take pairs, numbered own * n_facets + other and sorted, as the elements."""
        n, size = len(self.nodes), 6 * self.nodes.shape[1]
        self._pairs = pairs
        nodes = np.hstack([self.nodes[pairs // n], self.nodes[pairs % n]])
        self.pattern: IntArray = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(pairs), size)
        self._residuals = np.zeros((len(pairs), size))
        self._matrices = np.zeros((len(pairs), size, size))

    def _positions(self, state: State) -> FloatArray:
        return self._rest + state.unknowns[: self._rest.size].reshape(-1, 3)

    def _sampled(self, positions: FloatArray) -> FloatArray:
        return np.einsum("qa,fai->fqi", self._shape, positions[self.nodes]).reshape(-1, 3)

    def _area_vectors(self, positions: FloatArray) -> FloatArray:
        tangents = np.einsum("qad,fai->fqdi", self._slopes, positions[self.nodes]).reshape(-1, 2, 3)
        return np.cross(tangents[:, 0], tangents[:, 1])

    def _opposite(
        self, state: State, within: float, remembered: int = MANY
    ) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
        """Of each sample: the facet opposite (-1 for none), place on it, gap, all facets found."""
        positions = self._positions(state)
        normals = self._area_vectors(positions)
        facing = normals.reshape(len(self.nodes), -1, 3).sum(axis=1)
        corners = positions[self.nodes]
        centres = corners.mean(axis=1)
        radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
        axis = int(np.argmax(np.ptp(centres, axis=0)))
        n = len(self._own)
        facet, places, gaps = self._facet.copy(), np.empty((n, 2)), np.empty(n)
        others = np.empty((n, remembered), dtype=np.int64)
        find_opposite(
            self._sampled(positions),
            normals / np.linalg.norm(normals, axis=1)[:, None],
            self._own,
            self.nodes,
            self._powers,
            self._coefficients @ corners,
            np.column_stack([centres, radii]),
            facing / np.linalg.norm(facing, axis=1)[:, None],
            np.argsort(centres[:, axis]),
            axis,
            self._triangle,
            within,
            self.barrier.depth,
            facet,
            places,
            gaps,
            others,
        )
        return facet, places, gaps, others
