"""Contact of a finger with a rigid object that is put in its place after the finger has opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.barrier import Barrier
from tubefoot.fea.grasp_settings import GraspedObject
from tubefoot.fea.items import Evaluation, Item, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.obstacle import Box, Obstacle, Sphere
from tubefoot.fea.touch import Touch, Unheard

FloatArray = NDArray[np.float64]


class RigidContact:
    """Obstacles of one shape before several walls; `items` add to the model."""

    def __init__(
        self,
        mesh: Mesh,
        walls: Sequence[str],
        thing: GraspedObject,
        place: FloatArray,
        parked: float,
        barrier: Barrier,
    ):
        """Park the object.

        mesh : of the finger; walls : names of its facet sets; thing : a box or a sphere
        place : of its centre (3,) [mm]; parked : by how much it waits at smaller x [mm]
        barrier : how finger and object repel each other
        """
        centre = (float(place[0]), float(place[1]), float(place[2]))
        shape: Box | Sphere = (
            Box(centre, thing.sizes_mm, thing.rounding_mm)
            if thing.shape == "box"
            else Sphere(centre, thing.sizes_mm[0] / 2.0)
        )
        self._shapes = {True: shape, False: replace(shape, centre=(centre[0] - parked, *centre[1:]))}
        self._obstacles = [Obstacle(mesh, wall, self._shapes[False], barrier) for wall in walls]
        self._barrier = barrier

    @property
    def items(self) -> Sequence[Item]:
        """What adds to residual and tangent."""
        return self._obstacles

    def place(self, there: bool) -> None:
        """Put the object in its place, or back.

        there : whether it is in its place
        """
        for obstacle in self._obstacles:
            obstacle.shape = self._shapes[there]

    def resultant(self, state: State) -> tuple[FloatArray, float]:
        """Force of the half finger on the object (3,) [N], and sum z f_x over the patch [N mm].

        state : a converged one
        """
        self._evaluate(state)
        pushes = np.vstack([obstacle.pushes for obstacle in self._obstacles])
        places = np.vstack([obstacle.places for obstacle in self._obstacles])
        return pushes.sum(axis=0), float(places[:, 2] @ pushes[:, 0])

    def touch(self, state: State) -> Touch:
        """Pressures as the finger's samples see them.

        state : a converged one
        """
        self._evaluate(state)
        places = np.vstack([obstacle.places for obstacle in self._obstacles])
        gaps, areas = (
            np.concatenate([getattr(obstacle, name) for obstacle in self._obstacles])
            for name in ("gaps", "areas")
        )
        return Touch(places, self._barrier.pressure(gaps), areas)

    def clearance(self, state: State, within: float) -> float:
        """Smallest gap between finger and object [mm], negative for an overlap, infinite beyond `within`.

        state : where to look; within : largest gap looked for [mm]
        """
        self._evaluate(state)
        gap = min(float(obstacle.gaps.min()) for obstacle in self._obstacles)
        return gap if gap < within else np.inf

    def _evaluate(self, state: State) -> None:
        for obstacle in self._obstacles:
            obstacle.assemble(state, Unheard(), Evaluation())
