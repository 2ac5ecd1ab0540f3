"""Samples of a wall that press facets opposite: the item that self-contact and contact of two bodies share.

Each contact is a sample, a facet, a place on it and a gap; facets that a sample's own facet may press are
paired into elements, and the barrier's energy of all samples of a pair goes into its matrix. Which contacts
there are is for those who derive from this: they look, and `_take` what they found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.barrier import Barrier, assemble_contacts
from tubefoot.fea.elements import ElementKind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.proximity import facet_edges, facet_powers

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

UNFADED = (-3.0, -2.0)
"""Below every cosine: a contact weighs all at any angle, and its gap is the length along its direction."""


@dataclass(frozen=True)
class Elements:
    """Pairs of facets that may press each other.

    pairs : (n,) sorted numbers own * n_facets + other; pattern : (n, 6 n_nodes) unknowns of each
    residuals : (n, 6 n_nodes), matrices : (n, 6 n_nodes, 6 n_nodes) of the last evaluation
    """

    pairs: IntArray
    pattern: IntArray
    residuals: FloatArray
    matrices: FloatArray

    @classmethod
    def of(cls, pairs: IntArray, nodes: IntArray) -> Elements:
        """Elements without forces.

        pairs : see above; nodes : (n_facets, n_nodes) of all facets
        """
        n, size = len(nodes), 6 * nodes.shape[1]
        both = np.hstack([nodes[pairs // n], nodes[pairs % n]])
        pattern = (3 * both[:, :, None] + np.arange(3)).reshape(len(pairs), size)
        return cls(pairs, pattern, np.zeros((len(pairs), size)), np.zeros((len(pairs), size, size)))


class Contacts:
    """The contacts of sampled walls; as an item they add the barrier's energy.

    areas : of each sample [mm^2]; gaps : of each contact [mm]; convex : see `Pairing`
    """

    areas: FloatArray
    _fade: tuple[float, float]
    """Cosines between the walls at which a contact weighs nothing and all; see `fading.faded`."""
    _zones: FloatArray
    """(n_facets, n_edges, 2) where contacts fade across edges; see `fading.placed`."""
    _shapes: FloatArray
    """(n, 3, n_nodes) shape functions at the samples and the slopes by which the wall's direction turns."""

    def __init__(
        self, mesh: Mesh, nodes: IntArray, n_sampled: int, kind: ElementKind, at: FloatArray, barrier: Barrier
    ):
        """Begin without contacts; who derives sets `areas`, `_shapes` and `_zones`.

        mesh : the mesh; nodes : (n_facets, n) of all facets; n_sampled : the first so many carry samples
        kind : of the facets; at : (n, 2) reference coordinates of the samples of a facet
        barrier : how samples and facets repel each other
        """
        self.barrier, self.nodes, self.convex = barrier, np.ascontiguousarray(nodes), False
        self._rest = mesh.points
        self._powers, self._coefficients = facet_powers(kind)
        self._edges = facet_edges(kind)
        self._shape = np.ascontiguousarray(kind.shape(at))
        self._sampled_nodes = self.nodes[:n_sampled]
        self._own = np.repeat(np.arange(n_sampled), len(at))
        self._sample, self._facet, self._row = np.zeros((3, 0), dtype=np.int64)
        self._places, self.gaps = np.zeros((0, 2)), np.zeros(0)
        self._elements = Elements.of(np.empty(0, dtype=np.int64), self.nodes)

    @property
    def pattern(self) -> IntArray:
        """(n_pairs, 6 n_nodes) numbers of the unknowns that each pair of facets couples."""
        return self._elements.pattern

    def _tangents_of_contacts(self, positions: FloatArray) -> FloatArray:
        """Two vectors across the direction in which each contact looks, (n_contacts, 2, 3)."""
        raise NotImplementedError

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the contact forces and their stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy, magnitude, smallest gap
        """
        if len(self._sample) == 0:
            return
        positions = self._positions(state)
        energy, deepest = assemble_contacts(
            self._sampled(positions)[self._sample],
            self._tangents_of_contacts(positions),
            self.areas[self._sample],
            self._sample % len(self._shape),
            self._facet,
            self._row,
            self._places,
            self.gaps,
            self._powers,
            self._coefficients,
            self._coefficients @ positions[self.nodes],
            self._shapes,
            (self.barrier.reach, self.barrier.stiffness),
            self._edges,
            self._zones,
            self._fade,
            sink.stiff,
            self._elements.residuals,
            self._elements.matrices,
        )
        if np.isnan(energy):
            found.min_gap = -np.inf
            return
        found.energy += energy
        found.min_gap = min(found.min_gap, deepest)
        found.magnitude = max(found.magnitude, float(np.abs(self._elements.residuals).max(initial=0.0)))
        matrices = self._elements.matrices
        if self.convex and sink.stiff:
            matrices = without_negative(matrices)
        sink.add(self, 0, matrices, self._elements.residuals)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """

    def _take(self, sample: IntArray, facet: IntArray, places: FloatArray, gaps: FloatArray) -> None:
        """Take contacts whose pairs are among the elements."""
        self._sample, self._facet, self._places, self.gaps = sample, facet, places, gaps
        self._row = np.searchsorted(self._elements.pairs, self._own[sample] * len(self.nodes) + facet)

    def _prepared(self, sample: IntArray, facet: IntArray) -> NDArray[np.bool_]:
        """Which contacts have an element."""
        return np.isin(self._own[sample] * len(self.nodes) + facet, self._elements.pairs)

    def _prepare(self, sample: IntArray, facet: IntArray, others: IntArray) -> None:
        """Make elements for contacts, and for the facets near their samples, `others`.

        Elements that none needs any more are dropped: each makes the factorisation dearer.
        """
        n = len(self.nodes)
        keys = self._own[sample] * n + facet
        mine = np.unique(sample)
        near, neighbour = np.nonzero(others[mine] >= 0)
        found = self._own[mine[near]] * n + others[mine[near], neighbour]
        self._elements = Elements.of(np.union1d(found, keys), self.nodes)

    def _positions(self, state: State) -> FloatArray:
        return self._rest + state.unknowns[: self._rest.size].reshape(-1, 3)

    def _sampled(self, positions: FloatArray) -> FloatArray:
        return np.einsum("qa,fai->fqi", self._shape, positions[self._sampled_nodes]).reshape(-1, 3)


def without_negative(matrices: FloatArray) -> FloatArray:
    """The nearest matrices that have no negative eigenvalue.

    matrices : (n, m, m) symmetric
    """
    acting = np.flatnonzero(np.abs(matrices).max(axis=(1, 2)) > 0.0)
    nearest = np.zeros_like(matrices)
    values, vectors = np.linalg.eigh(matrices[acting])
    nearest[acting] = (vectors * np.maximum(values, 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    return nearest


def bounding_spheres(corners: FloatArray) -> FloatArray:
    """Centre and radius of a sphere around each facet's nodes, (n_facets, 4).

    corners : (n_facets, n_nodes, 3)
    """
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    return np.column_stack([centres, radii])
