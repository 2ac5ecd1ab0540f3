"""Frictionless contact of a wall with itself: a barrier that grows smoothly from a small reach on.

Each quadrature point of the wall looks along its normal for the facets opposite (`proximity`) and carries for
each, per undeformed area, half of

    w(g) = k / (3 d) max(0, d - g)^3,   pressure -w'(g) = k / d (d - g)^2,

the other half coming from the points over there, so that neither side is master. The gap g is the distance
from the plane that touches the wall opposite where it is seen; nothing acts beyond the reach d. Derivatives
are exact (`barrier`); forces and moments of both sides cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.contacts import Contacts, Elements, bounding_spheres
from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.proximity import BEYOND, OPPOSED, TO_PLANE, edge_zones, find_opposite, gaps_along

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MANY = 12
"""Facets opposite one sample that are remembered."""
FULLY = 0.5
"""Cosine between two walls from which on they press each other as walls that face each other."""
SHEETS = 8
"""Facets that one sample may press against at a time: more than one where folds meet."""


class Choice(NamedTuple):
    """Contacts, and what tells which the next ones are.

    sample, facet : (n,) facet that each meets; places : (n, 2) there; gaps : (n,) [mm]
    elements : of both facets; looked_at : unknowns at the last look
    around : keys sample * n_facets + facet of walls that are seen around a corner
    """

    sample: IntArray
    facet: IntArray
    places: FloatArray
    gaps: FloatArray
    elements: Elements
    looked_at: FloatArray | None
    around: IntArray


class SelfContact(Contacts):
    """Contact of a surface with itself; as an item it adds the barrier's energy."""

    _fade = (-OPPOSED, FULLY)

    def __init__(self, mesh: Mesh, surface: Sequence[str], barrier: Barrier | None = None):
        """Prepare the samples; the reach is cut to half the smallest gap at rest.

        mesh : the mesh; surface : names of the facet sets that make up the surface, of one facet kind
        barrier : how its parts repel each other

        Raises ConfigError for facets of several kinds, GeometryError when the walls touch at rest.
        """
        sets = [mesh.facet_set(name) for name in surface]
        if len({found.kind for found in sets}) != 1:
            raise ConfigError(f"the surface {', '.join(surface)} has facets of several kinds")
        kind = element_kind(sets[0].kind)
        nodes = np.vstack([found.nodes for found in sets])
        super().__init__(mesh, nodes, len(nodes), kind, kind.quadrature_points, barrier or Barrier())
        names = np.repeat(np.arange(len(sets)), [len(found.nodes) for found in sets])
        self._labels = [surface[int(k)] for k in names]
        slopes = np.moveaxis(kind.shape_gradient(kind.quadrature_points), -1, 1)
        self._shapes = np.ascontiguousarray(np.concatenate([self._shape[:, None], slopes], axis=1))
        normals = self._area_vectors(mesh.points)
        shares = np.tile(kind.quadrature_weights, len(self.nodes))
        self.areas = 0.5 * shares * np.linalg.norm(normals, axis=1)
        self._zones = edge_zones(kind, self.nodes, mesh.points)
        self._extents = np.ascontiguousarray(self._zones[:, :, 1])
        self._looked_at: FloatArray | None = None
        self._around = np.empty(0, dtype=np.int64)
        self._clearance = 0.0
        rest = State(np.zeros(mesh.points.size), np.zeros(0), 0.0)
        gap, where = self.smallest_gap(rest, 2 * self.barrier.reach)
        if gap < 0.01:
            raise GeometryError(f"walls touch at rest: {where}, gap {gap:.3g} mm, must be at least 0.01 mm")
        self.barrier = replace(self.barrier, reach=min(self.barrier.reach, gap / 2))

    def look(self, state: State) -> bool:
        """Choose the facets opposite anew; whether one acts that was not known.

        state : where to look
        """
        if self._far(state):
            return False
        hits, places, gaps, others = self._opposite(state, self.barrier.ahead, self._extents)
        before, self._looked_at = self._looked_at, state.unknowns[: self._rest.size].copy()
        self._clearance = min(float(gaps.min()), self.barrier.ahead)
        sample, slot = np.nonzero(gaps < self._close)
        facet, place, gap = hits[sample, slot], places[sample, slot], gaps[sample, slot]
        n = len(self.nodes)
        known = sample * n + facet
        seen = self._seen(before, sample, facet, place, gap)
        self._around = known[~seen]
        sample, facet, place, gap = sample[seen], facet[seen], place[seen], gap[seen]
        new = ~np.isin(known[seen], self._sample * n + self._facet)
        changed = bool((gap[new] < self.barrier.reach).any())
        able = self._prepared(sample, facet)
        if (gap[~able] < self.barrier.reach).any():
            self._prepare(sample, facet, others)
        else:
            sample, facet, place, gap = sample[able], facet[able], place[able], gap[able]
        self._take(sample, facet, place, gap)
        return changed

    @property
    def choice(self) -> Choice:
        """The present contacts."""
        places, gaps = self._places.copy(), self.gaps.copy()
        return Choice(self._sample, self._facet, places, gaps, self._elements, self._looked_at, self._around)

    @choice.setter
    def choice(self, kept: Choice) -> None:
        """Take contacts back.

        kept : as they were
        """
        self._elements, self._looked_at, self._around = kept.elements, kept.looked_at, kept.around
        self._take(kept.sample, kept.facet, kept.places.copy(), kept.gaps.copy())

    def _seen(
        self,
        looked_at: FloatArray | None,
        sample: IntArray,
        facet: IntArray,
        place: FloatArray,
        gap: FloatArray,
    ) -> NDArray[np.bool_]:
        """Which of these walls are in front of their samples, or were and came through.

        An overlap that appears where the wall did not stand in front before is seen around a corner, through
        the sample's own wall. That goes on until it is beyond the reach: no contact begins under load.
        """
        around = (gap < self.barrier.reach) & np.isin(sample * len(self.nodes) + facet, self._around)
        seen = (gap > 0.0) & ~around
        for k in np.flatnonzero(~seen):
            seen[k] = self._continues(sample[k], facet[k], gap[k])
        behind = np.flatnonzero(~seen & ~around)
        seen[behind] = self._stood_before(looked_at, sample[behind], facet[behind], place[behind])
        return seen

    def _continues(self, sample: int, facet: int, gap: float) -> bool:
        """Whether this goes on from a contact of the same sample, as deep, on the same facet or beside it."""
        alike = (self._sample == sample) & (np.abs(self.gaps - gap) < self.barrier.reach)
        return bool(np.isin(self.nodes[self._facet[alike]], self.nodes[facet]).any())

    def _stood_before(
        self, looked_at: FloatArray | None, sample: IntArray, facet: IntArray, place: FloatArray
    ) -> NDArray[np.bool_]:
        """Of overlaps that appear: whether the wall stood in front at the last look."""
        moved = 0.0 if looked_at is None else looked_at.reshape(-1, 3)
        positions = self._rest + moved
        normals = self._area_vectors(positions)[sample]
        gaps = gaps_along(
            self._sampled(positions)[sample],
            normals / np.linalg.norm(normals, axis=1)[:, None],
            facet,
            place,
            self._powers,
            self._coefficients @ positions[self.nodes],
        )
        return np.asarray(gaps > 0.0)

    def _tangents_of_contacts(self, positions: FloatArray) -> FloatArray:
        return self._tangents(positions)[self._sample]

    def smallest_gap(self, state: State, within: float) -> tuple[float, str]:
        """The smallest gap [mm], negative for a penetration, and between which walls.

        Infinite where none is smaller than `within`.

        state : where to look; within : largest gap looked for [mm]
        """
        hits, _, gaps, _ = self._opposite(state, within, np.full(self._zones.shape[:2], BEYOND), remembered=0)
        sample, slot = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
        if hits[sample, slot] < 0:
            return float("inf"), ""
        pair = sorted({self._labels[self._own[sample]], self._labels[hits[sample, slot]]})
        return float(gaps[sample, slot]), " and ".join(name.replace("_", " ") for name in pair)

    def _far(self, state: State) -> bool:
        """Whether nothing can have come close since the last look."""
        if self._looked_at is None or len(self._sample):
            return False
        moved = (state.unknowns[: self._rest.size] - self._looked_at).reshape(-1, 3)
        spare = self._clearance - self._close
        return 2.0 * float(np.linalg.norm(moved, axis=1).max()) < spare

    @property
    def _close(self) -> float:
        """Gap below which a sample has a partner [mm]: before the reach, since Newton moves the walls."""
        return (self.barrier.reach + self.barrier.ahead) / 3

    def _tangents(self, positions: FloatArray) -> FloatArray:
        return np.einsum("qda,fai->fqdi", self._shapes[:, 1:], positions[self.nodes]).reshape(-1, 2, 3)

    def _area_vectors(self, positions: FloatArray) -> FloatArray:
        tangents = self._tangents(positions)
        return np.cross(tangents[:, 0], tangents[:, 1])

    def _opposite(
        self, state: State, within: float, extents: FloatArray, remembered: int = MANY
    ) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
        """Of each sample: facets that its normal meets (-1 for none), places, gaps, neighbours found."""
        positions = self._positions(state)
        normals = self._area_vectors(positions)
        facing = normals.reshape(len(self.nodes), -1, 3).sum(axis=1)
        corners = positions[self.nodes]
        spheres = bounding_spheres(corners)
        axis = int(np.argmax(np.ptp(spheres[:, :3], axis=0)))
        n = len(self._own)
        hits, gaps = np.empty((n, SHEETS), dtype=np.int64), np.empty((n, SHEETS))
        places = np.empty((n, SHEETS, 2))
        others = np.empty((n, remembered), dtype=np.int64)
        find_opposite(
            self._sampled(positions),
            normals / np.linalg.norm(normals, axis=1)[:, None],
            self._own,
            self.nodes,
            self._powers,
            self._coefficients @ corners,
            spheres,
            facing / np.linalg.norm(facing, axis=1)[:, None],
            np.argsort(spheres[:, axis]),
            axis,
            self._edges,
            extents,
            TO_PLANE,
            within,
            self.barrier.depth,
            hits,
            places,
            gaps,
            others,
        )
        return hits, places, gaps, others
