"""Holding a body in one direction by the mean place of some of its points, without hindering it to deform.

Energy k n / 2 m^2 with the mean displacement m of n points along an axis: a rank-one stiffness. What a
frictionless contact cannot bear of the body's balance is borne here, evenly over the points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import Evaluation, Sink, State

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class MeanHold:
    """Keeps the mean displacement of points along an axis near zero; as an item it adds its energy."""

    def __init__(self, points: IntArray, axis: int, stiffness: float):
        """Take the points.

        points : their numbers; axis : 0, 1 or 2; stiffness : force over mean displacement [N/mm]
        """
        self.pattern: IntArray = (3 * np.asarray(points, np.int64) + axis)[None]
        self.stiffness = stiffness
        n = len(points)
        self._matrix = np.full((1, n, n), stiffness / n**2)

    def force(self, state: State) -> float:
        """Force on the body along the axis [N].

        state : where to evaluate
        """
        return -self.stiffness * float(state.unknowns[self.pattern].mean())

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put force and stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy
        """
        mean = float(state.unknowns[self.pattern].mean())
        n = self.pattern.shape[1]
        found.energy += 0.5 * self.stiffness * mean**2
        sink.add(self, 0, self._matrix, np.full((1, n), self.stiffness * mean / n))

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """
