"""What a finger's wall bears now, from its angles up to now.

The wall relaxes: by G(t) = 1 + sum_i g_i exp(-t / tau_i) over its equilibrium stiffness k
(`reduced.relaxation`). The moment that a half of the finger bears is k times

    borne(t) = int G(t - t') d angle / dt' dt'

the angle at which the relaxed wall would bear it. Held at one angle, the wall bears six times as much half a
second after a step as in the end; so a force told from angles alone is wrong by such factors. A step is
exact where the angles grow linearly over it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.reduced.relaxation import Prony

FloatArray = NDArray[np.float64]


class WallMemory:
    """The memory of one finger, fed with both halves' turns.

    borne : (2,) turn of the lower and the upper half at which the relaxed wall would bear as much [rad]; nan
        before anything was seen
    """

    def __init__(self, prony: Prony):
        """Begin relaxed at the first angles seen.

        prony : how the wall relaxes
        """
        self._strengths = np.asarray(prony.strengths, dtype=float)[:, None]
        self._times = np.asarray(prony.times_s, dtype=float)[:, None]
        self._over = np.zeros((len(prony.strengths), 2))
        self._before: FloatArray | None = None
        self._at = 0.0
        self.borne: FloatArray = np.full(2, np.nan)

    def see(self, time: float, theta1: float, theta2: float) -> None:
        """Take what was seen; nothing is learnt from lost markers or from a frame seen before.

        time : of the frame, not going back [s]; theta1, theta2 : turn of the lower and the upper half [rad]
        """
        now = np.array([theta1, theta2])
        if not np.isfinite(now).all():
            return
        if self._before is None:
            self._before, self._at, self.borne = now, time, now.copy()
            return
        if time <= self._at:
            return
        ratio = (time - self._at) / self._times
        gain = -self._strengths * np.expm1(-ratio) / ratio
        self._over = np.exp(-ratio) * self._over + gain * (now - self._before)
        self._before, self._at = now, time
        self.borne = now + self._over.sum(axis=0)
