"""A drag on every node, which lets a structure that lost its balance come to rest elsewhere.

Over a pseudo-time step the drag does c / 2 m_k |u_k - u_k,0|^2 with m_k the node's volume: an implicit Euler
step of the gradient flow, energy falling from step to step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import Evaluation, Sink, State

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Drag:
    """Springs of equal density that hold the points where they were."""

    def __init__(self, volumes: FloatArray):
        """Start without any.

        volumes : (n_points,) of the solid that belong to each point [mm^3]
        """
        self._mass = np.repeat(volumes, 3)
        self.pattern: IntArray = np.arange(len(self._mass))[:, None]
        self.density = 0.0
        self._held: FloatArray = np.zeros(len(self._mass))

    def hold(self, state: State, density: float) -> None:
        """Hold the points where they are.

        state : where they are; density : [N/mm per mm^3]
        """
        self._held, self.density = state.unknowns[: len(self._mass)].copy(), density

    def release(self) -> None:
        """Let go of all points."""
        self.density = 0.0

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put forces and stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy and magnitude
        """
        if self.density == 0.0:
            return
        stiffness = self.density * self._mass
        moved = state.unknowns[: len(self._mass)] - self._held
        found.energy += 0.5 * float(stiffness @ moved**2)
        sink.add(self, 0, stiffness[:, None, None], (stiffness * moved)[:, None])

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """
