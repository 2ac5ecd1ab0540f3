"""What both fingers show in the pauses between pulses: means over a pause's last part.

Views are kept while the pumps stand and forgotten when one runs; the memory of the walls sees all of them.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.first_contact import Pause
from tubefoot.control.grasp_contract import FingerView, GripView
from tubefoot.control.wall_memory import WallMemory
from tubefoot.reduced.relaxation import Prony

FloatArray = NDArray[np.float64]

JUDGED_S = 0.25
"""Last part of a pause, over which frames and pressures are averaged [s]."""
KEPT_VIEWS = 300
"""Views kept of a pause; more than are judged, at any camera's rate."""


class PauseWatch:
    """Sees every view of the gripper, and tells pauses.

    now : time of the newest view while the pumps stand [s]; still_since : when the pumps stopped, as seen [s]
    """

    def __init__(self, memory: Prony):
        """Begin before the first view.

        memory : how the fingers' walls relax
        """
        self._walls = (WallMemory(memory), WallMemory(memory))
        self._views: deque[tuple[GripView, tuple[FloatArray, FloatArray]]] = deque(maxlen=KEPT_VIEWS)
        self._pulsed_until = -np.inf
        self.now = self.still_since = 0.0

    def see(self, view: GripView) -> None:
        """Take a view.

        view : the newest; times never go back
        """
        for wall, finger in zip(self._walls, view.fingers, strict=True):
            wall.see(finger.seen_at, finger.theta1, finger.theta2)
        self.now = view.time
        if view.pumping:
            self._views.clear()
            self._pulsed_until = view.time
            return
        if not self._views:
            self.still_since = view.time
        self._views.append((view, (self._walls[0].borne, self._walls[1].borne)))

    def begin_anew(self, pulse: float = 0.0) -> None:
        """Forget what was seen of this pause.

        pulse : duration of a pulse that begins now [s]
        """
        if pulse:
            self._pulsed_until = self.now + pulse
        self._views.clear()

    def judgeable(self, pause: float) -> bool:
        """Whether the pause has lasted, and enough of it was seen.

        pause : after a pulse [s]
        """
        if not self._views:
            return False
        return self.now >= max(self._pulsed_until + pause, self.still_since + JUDGED_S)

    def pauses(self) -> tuple[Pause, Pause]:
        """What the right and the left finger showed in the last part of the pause."""
        judged = [(view, borne) for view, borne in self._views if view.time >= self.now - JUDGED_S]
        right, left = (
            _mean([view.fingers[side] for view, _ in judged], [borne[side] for _, borne in judged])
            for side in (0, 1)
        )
        return right, left


def _mean(views: list[FingerView], borne: list[FloatArray]) -> Pause:
    angles = np.array([(view.theta1, view.theta2, view.bend) for view in views])
    pressures = np.array([view.pressures for view in views])
    known = np.isfinite(angles)
    means = [
        float(column[mask].mean()) if mask.any() else float("nan")
        for column, mask in zip(angles.T, known.T, strict=True)
    ]
    lower, upper = np.mean(borne, axis=0)
    pressure = float((pressures[:, 0] - pressures[:, 1]).mean())
    return Pause(means[0], means[1], means[2], pressure, (float(lower), float(upper)))
