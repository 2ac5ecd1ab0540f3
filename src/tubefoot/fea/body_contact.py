"""Frictionless contact of a finger's side with the smooth front of an object, and what is read off it.

Samples of the finger's wall look along a fixed direction, across the gripper, for the object's skin: with the
gap g along that direction each carries the barrier energy w(g) of `barrier` per area across it. g falls where
the skin rises, dg/dx = -n / (n . e) with n the skin's normal and e the direction, so forces act along the
normal of the object, whichever edge of the finger presses it: crests are sharp, the object is smooth. Forces
of both sides cancel; where they are oblique to e they act across the gap, a couple of at most g times them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.barrier import Barrier
from tubefoot.fea.contacts import UNFADED, Contacts, bounding_spheres
from tubefoot.fea.elements import element_kind, gauss_line
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.proximity import ALONG_NORMAL, BEYOND, find_opposite, outside_facet
from tubefoot.fea.touch import Touch, Unheard, across_area, quarters

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SAMPLES = 5
"""Samples along each edge of a facet of the finger."""
CLOSE = 0.5
"""Gap beyond the reach at which a sample has a partner already, since Newton moves the walls [mm]."""
KEPT = 0.3
"""How far outside its facet a place may have slid within a step: the facet goes on as the same polynomial."""
REMEMBERED = 12
"""Facets near one sample that are prepared for."""


class BodyContact(Contacts):
    """Contact of a finger's walls with an object's skin; as an item it adds the barrier's energy."""

    _fade = UNFADED

    def __init__(
        self,
        mesh: Mesh,
        walls: Sequence[str],
        skin: str,
        direction: tuple[float, float, float] = (-1.0, 0.0, 0.0),
        barrier: Barrier | None = None,
    ):
        """Prepare the samples; both surfaces are of nine-node facets.

        mesh : of both bodies; walls : names of the finger's facet sets; skin : of the object's
        direction : unit vector from the finger to the object; barrier : how they repel each other
        """
        wall = np.vstack([mesh.facet_set(name).nodes for name in walls])
        self._n_wall = len(wall)
        line, weight = gauss_line(SAMPLES)
        at = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        nodes = np.vstack([wall, mesh.facet_set(skin).nodes])
        super().__init__(mesh, nodes, len(wall), element_kind("quad9"), at, barrier or Barrier())
        # The skin is smooth: one facet at a time acts, wherever on it or beside it.
        self._zones = np.broadcast_to(np.array([1e9, 2e9]), (len(nodes), 4, 2)).copy()
        self._direction = np.array(direction)
        # The direction does not turn with the wall: no slopes in the shape functions.
        self._shapes = np.ascontiguousarray(
            np.stack([self._shape, *np.zeros((2, *self._shape.shape))], axis=1)
        )
        weights = np.outer(weight, weight).ravel()
        self.areas = across_area(mesh.points[wall], at, weights, self._direction).ravel()
        helper = np.eye(3)[int(np.argmin(np.abs(self._direction)))]
        first = np.cross(helper, self._direction)
        first /= np.linalg.norm(first)
        self._tangents = np.array([first, np.cross(self._direction, first)])

    def look(self, state: State) -> bool:
        """Choose the facets opposite anew where the choice no longer serves; whether so.

        state : where to look
        """
        hits, places, gaps, others = self._opposite(state, self.barrier.ahead, REMEMBERED)
        if self._serves(hits, gaps):
            return False
        sample = np.flatnonzero(gaps < self.barrier.reach + CLOSE)
        if not self._prepared(sample, hits[sample]).all():
            self._prepare(sample, hits[sample], others)
        self._take(sample, hits[sample], places[sample], gaps[sample])
        return True

    def _tangents_of_contacts(self, positions: FloatArray) -> FloatArray:
        return np.broadcast_to(self._tangents, (len(self._sample), 2, 3)).copy()

    def forces(self, state: State) -> FloatArray:
        """Contact forces on all points, (n_points, 3) [N]: on the finger's and, opposite, on the object's.

        state : a converged one
        """
        self.look(state)
        self.assemble(state, Unheard(), Evaluation())
        nodal = np.zeros(self._rest.size)
        if len(self._sample):
            np.add.at(nodal, self.pattern, -self._elements.residuals)
        return nodal.reshape(-1, 3)

    def resultant(self, state: State) -> tuple[FloatArray, float]:
        """Force of the finger on the object (3,) [N], and sum z f_x over the object's points [N mm].

        state : a converged one
        """
        on_object = np.unique(self.nodes[self._n_wall :])
        nodal, heights = self.forces(state)[on_object], self._positions(state)[on_object, 2]
        return nodal.sum(axis=0), float(heights @ nodal[:, 0])

    def touch(self, state: State) -> Touch:
        """What the finger's samples see of the object.

        state : a converged one
        """
        self.look(state)
        self.assemble(state, Unheard(), Evaluation())
        pressure = np.zeros(len(self._own))
        pressure[self._sample] = self.barrier.pressure(self.gaps)
        return Touch(self._sampled(self._positions(state)), pressure, self.areas)

    def point_pressures(self, state: State) -> FloatArray:
        """Pressure at the points of the object's skin, (n_points,) with zero elsewhere [MPa].

        Each sample's force goes to the corners of that quarter of the facet in which it acts; a point's share
        is divided by the undeformed area across the gripper that it has of all quarters around it.

        state : a converged one
        """
        self.look(state)
        self.assemble(state, Unheard(), Evaluation())
        n = len(self._rest)
        push = self.areas[self._sample] * self.barrier.pressure(self.gaps)
        force = np.bincount(
            self.nodes[self._facet].ravel(), (push[:, None] * quarters(self._places)).ravel(), minlength=n
        )
        line, weight = gauss_line(4)
        at = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        skin = self.nodes[self._n_wall :]
        area = across_area(self._rest[skin], at, np.outer(weight, weight).ravel(), self._direction)
        carried = np.bincount(skin.ravel(), (area @ quarters(at)).ravel(), minlength=n)
        return np.divide(force, carried, out=np.zeros(n), where=carried > 1e-6)

    def clearance(self, state: State, within: float) -> float:
        """Smallest gap between finger and object [mm], negative for an overlap, infinite beyond `within`.

        state : where to look; within : largest gap looked for [mm]
        """
        return float(self._opposite(state, within, 0)[2].min(initial=np.inf))

    def _serves(self, hits: IntArray, gaps: FloatArray) -> bool:
        """Whether the present contacts are still the right ones, up to sliding a little over an edge."""
        acting = self.gaps < self.barrier.reach
        if any(outside_facet(place, self._edges) > KEPT for place in self._places[acting]):
            return False
        touching = np.flatnonzero((gaps < self.barrier.reach) & (hits >= 0))
        return bool(np.isin(touching, self._sample).all())

    def _opposite(
        self, state: State, within: float, remembered: int
    ) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
        """Of each sample: the facet of the skin before it (-1 for none), place, gap, neighbours found."""
        positions = self._positions(state)
        corners = positions[self.nodes]
        spheres = bounding_spheres(corners)
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
        skin = np.arange(self._n_wall, len(self.nodes))
        axis = int(np.argmax(np.ptp(spheres[skin, :3], axis=0)))
        n = len(self._own)
        hits, gaps, places = np.empty((n, 1), dtype=np.int64), np.empty((n, 1)), np.empty((n, 1, 2))
        others = np.empty((n, remembered), dtype=np.int64)
        find_opposite(
            self._sampled(positions),
            np.broadcast_to(self._direction, (n, 3)).copy(),
            self._own,
            self.nodes,
            self._powers,
            self._coefficients @ corners,
            spheres,
            facing / np.linalg.norm(facing, axis=1)[:, None],
            skin[np.argsort(spheres[skin, axis])],
            axis,
            self._edges,
            np.full(self._zones.shape[:2], BEYOND),
            ALONG_NORMAL,
            within,
            self.barrier.depth,
            hits,
            places,
            gaps,
            others,
        )
        return hits[:, 0], places[:, 0], gaps[:, 0], others
