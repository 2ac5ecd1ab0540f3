"""The middle line of a finger whose units are arcs: where a height of the straight finger has gone.

x to the right, z up, base at the origin; an angle is positive towards -x, as everywhere in vision. [mm, rad]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tubefoot.vision.layout import MarkerLayout

FloatArray = NDArray[np.float64]


class BentAxis:
    """The middle line at given unit angles.

    The units share the length between the rigid ends evenly; each is an arc.
    """

    def __init__(self, layout: MarkerLayout, unit_angles: FloatArray):
        """Bend it.

        layout : gives the length and the rigid ends
        unit_angles : (n,) from the base [rad]
        """
        bending = layout.length_mm - layout.rigid_base_mm - layout.rigid_tip_mm
        count = len(unit_angles)
        self._lengths = np.array(
            [layout.rigid_base_mm, *[bending / count] * count, layout.rigid_tip_mm], dtype=float
        )
        self._starts = np.concatenate([[0.0], np.cumsum(self._lengths)])
        self._turns = np.concatenate([[0.0], unit_angles, [0.0]])
        self._directions = np.concatenate([[0.0], np.cumsum(self._turns)])
        steps = _chords(self._lengths, self._directions[:-1], self._turns)
        self._places = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])

    @property
    def tip_direction(self) -> float:
        """Direction of the tip [rad]."""
        return float(self._directions[-1])

    def at(self, heights: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Places (n, 2) [mm] and directions (n,) [rad]; beyond the ends the line goes on straight.

        heights : (n,) on the straight finger [mm]
        """
        height = np.asarray(heights, dtype=float)
        piece = np.clip(np.searchsorted(self._starts, height, side="right") - 1, 0, len(self._lengths) - 1)
        along = height - self._starts[piece]
        turn = self._turns[piece] * along / np.maximum(self._lengths[piece], 1e-12)
        places = self._places[piece] + _chords(along, self._directions[piece], turn)
        return places, self._directions[piece] + turn


def _chords(lengths: FloatArray, directions: FloatArray, turns: FloatArray) -> FloatArray:
    """From start to end (n, 2) of arcs of given lengths, first directions and turns."""
    chord = lengths * np.sinc(turns / (2 * np.pi))
    middle = directions + turns / 2
    return np.column_stack([-chord * np.sin(middle), chord * np.cos(middle)])
