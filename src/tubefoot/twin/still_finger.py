"""The reduced finger in free bending, without inertia: angles balance pressures, seam and the wall's memory.

The law is asked once in an interval of 10 ms, 20 ms where little happens. Within it angles and volumes follow
the pressures by the law's exact derivatives, and the wall's creep evenly in time. As the hydraulics keep the
liquid and ask for whole volumes, not for increments, the error of an interval does not add up. A stiffer
print, or a colder one, is the same law at pressures over its factor; the seam is an elastic bending stiffness
beside it. rad, MPa, mm^3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import Prony, RelaxingFinger
from tubefoot.twin.finger_response import Volumes
from tubefoot.units import KPA

FloatArray = NDArray[np.float64]

SHORT_S, LONG_S = 10e-3, 20e-3
QUIET_MPA = 0.1 * KPA
"""Change of pressure in an interval below which the next one is long."""
MOST_ITERATIONS = 8
TOLERANCE = 5e-4
"""Of the unit angles, from which on the next correction is below a hundredth of it [rad]."""


class StillFinger:
    """A reduced finger that is always in equilibrium; fulfils `FingerResponse`."""

    def __init__(self, law: ReducedFinger, memory: Prony, stiffness: float = 1.0, seam: float = 0.0):
        """Begin straight and relaxed.

        law : the reduced finger at its identified stiffness
        memory : relaxation of its wall
        stiffness : of this print over the identified one
        seam : bending stiffness it adds to each unit, share of the unit's own at rest
        """
        self._law = RelaxingFinger(law, memory)
        self._print = stiffness
        self._factor = stiffness
        self._seam = seam * stiffness * law.unit_stiffness if seam else 0.0
        self._angles = np.zeros(law.n_units)
        self._creep = np.zeros(law.n_units)
        self._turn = np.zeros((2, law.n_units))
        self._at = (0.0, 0.0)
        self._now = (0.0, 0.0)
        self._passed = 0.0
        self._interval = SHORT_S
        self._start = self._end = (0.0, 0.0)
        self._slope = (1.0, 0.0, 1.0)
        self._linearise(0.0, 0.0)

    @property
    def bend(self) -> float:
        """Direction of the tip [rad]."""
        return float(self.unit_angles.sum())

    @property
    def unit_angles(self) -> FloatArray:
        """Angle of each unit, from the base [rad]."""
        by = np.array([self._now[0] - self._at[0], self._now[1] - self._at[1]])
        return np.asarray(self._angles + self._passed / self._interval * self._creep + by @ self._turn)

    def volumes(self, right: float, left: float, duration: float) -> Volumes:
        """Volume changes and their derivatives.

        right, left : pressures [MPa]
        duration : of the step [s]
        """
        by_right, by_left = right - self._at[0], left - self._at[1]
        (start_r, start_l), (end_r, end_l), (rr, rl, ll) = self._start, self._end, self._slope
        share = (self._passed + duration) / self._interval
        return (
            start_r + share * (end_r - start_r) + rr * by_right + rl * by_left,
            start_l + share * (end_l - start_l) + rl * by_right + ll * by_left,
            rr,
            rl,
            ll,
        )

    def advance(self, right: float, left: float, duration: float) -> None:
        """Accept a step.

        right, left : pressures [MPa]
        duration : [s]
        """
        self._now = (right, left)
        self._passed += duration
        if self._passed < SHORT_S - 1e-9:
            return
        moved = max(abs(right - self._at[0]), abs(left - self._at[1]))
        if self._passed < self._interval - 1e-9 and moved < QUIET_MPA:
            return
        self._angles = self.unit_angles
        self._start = self.volumes(right, left, 0.0)[:2]
        self._law.commit(self._angles, np.array([right, left]) / self._factor, self._passed)
        self._passed = 0.0
        self._interval = LONG_S if moved < QUIET_MPA else SHORT_S
        self._linearise(right, left)

    def scale_stiffness(self, factor: float) -> None:
        """Scale the walls, from the next interval on.

        factor : on the stiffness of this print
        """
        self._factor = self._print * factor

    def _linearise(self, right: float, left: float) -> None:
        """Find angles and volumes at the end of the next interval, and how they follow the pressures."""
        factor, seam = self._factor, self._seam
        pressures = np.array([right, left]) / factor
        angles = self._angles
        for _ in range(MOST_ITERATIONS):
            found = self._law.respond(angles, pressures, self._interval)
            stiffness = factor * found.stiffness + seam
            turn = -(factor * found.moments + seam * angles) / stiffness
            angles = angles + turn
            if abs(turn).max() < TOLERANCE:
                break
        volumes = found.volumes + found.coupling @ turn
        self._turn = found.coupling / stiffness
        compliance = found.compliance / factor + self._turn @ found.coupling.T
        self._creep = angles - self._angles
        self._at = self._now = (right, left)
        self._end = (float(volumes[0]), float(volumes[1]))
        self._slope = (float(compliance[0, 0]), float(compliance[0, 1]), float(compliance[1, 1]))
