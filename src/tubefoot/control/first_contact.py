"""First contact of a finger without a sensor for it: angles and pressures against free bending.

Between two pauses of the closing phase a free finger turns alike in both halves, and by as much as its
pressures say. An object holds the lower half back: theta1 lags behind theta2, the bend lags behind the
pressures. How the free finger does it is learnt from the pulses before, as two ratios, so that stiffness,
bubbles, creep and weight of this print drop out; what lags are summed (a one-sided cumulative sum), and
contact is where both sums are large.

After contact the two halves tell the force. The pressures' moment A dp bends every unit alike; the force F at
the height z_c takes its moment F (z_c - z) from each unit below it, arms that sum to a_1 over the lower and
a_2 over the upper half. The wall, of stiffness k, bears what is left:

    theta2 - theta1 = F (a_1 - a_2) / k,     free: bend = n A dp / k = g dp
    F = n A / g (theta2 - theta1) / (a_1 - a_2)

counted from the last free pause. The stiffness of this print, and how far it has relaxed, are in g, which was
measured; A is geometry, from the reduced finger.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import isfinite

import numpy as np

from tubefoot.control.grasp_settings import ContactSettings
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.units import DEG, KPA

RATIO_PRIOR, RATIO_WEIGHT = 1.0, 1.0 * DEG
"""Turn of the lower over the upper half of a free finger before any is seen, and its weight as a turn
[rad]."""
RATIO_RANGE = (0.5, 2.5)
LEAST_TURN, LEAST_PRESSURE = 0.15 * DEG, 0.5 * KPA
"""Changes below which a pulse teaches nothing [rad, MPa]."""
SOON_OVER_RELAXED = 0.4
"""Bend some seconds after a pulse over the relaxed one, for a finger that touches before its own is
learnt."""


@dataclass(frozen=True)
class Pause:
    """What a finger showed in the pause after a pulse; angles inward positive.

    theta1, theta2 : turn of the lower and the upper half [rad]; nan where markers were lost
    bend : of the tip [rad]
    pressure : of the chamber that bends inward less that of the other [MPa]
    """

    theta1: float
    theta2: float
    bend: float
    pressure: float

    @property
    def known(self) -> bool:
        """Whether both halves and the bend were seen."""
        return isfinite(self.theta1 + self.theta2 + self.bend)


@dataclass(frozen=True)
class GripLever:
    """How a contact force acts on the finger.

    moment : moment of all units for a pressure difference, n A [N mm/MPa]
    arm : arms summed over the lower half less those over the upper one [mm]
    gain : bend for a pressure difference while the wall has hardly relaxed, before it is learnt [rad/MPa]
    """

    moment: float
    arm: float
    gain: float


def grip_lever(finger: ReducedFinger, height: float) -> GripLever:
    """The lever of a contact at a height.

    finger : the reduced finger; height : of the contact above the base's outer face [mm]
    """
    at_rest = finger.respond(np.zeros(finger.n_units), np.zeros(2))
    moment = float((at_rest.coupling[0] - at_rest.coupling[1]).sum() / 2.0)
    middles = finger.cap + finger.pitch * (np.arange(finger.n_units) + 0.5)
    arms = np.maximum(height - middles, 0.0)
    lower = middles < finger.length / 2
    relaxed = float((at_rest.coupling / at_rest.stiffness).sum(axis=1) @ (0.5, -0.5))
    return GripLever(moment, float(arms[lower].sum() - arms[~lower].sum()), SOON_OVER_RELAXED * relaxed)


class ContactSense:
    """Watches one finger close.

    touching : whether contact is sure
    shape_lag, pressure_lag : the sums [rad]
    """

    def __init__(self, settings: ContactSettings, lever: GripLever):
        """Begin before the first inward pulse.

        settings : thresholds; lever : of the object's height
        """
        self.settings = settings
        self._lever = lever
        self.touching = False
        self.shape_lag = self.pressure_lag = 0.0
        self._last: Pause | None = None
        self._free: deque[tuple[float, float, float, float]] = deque(maxlen=settings.learnt_pulses)
        self._gain = lever.gain
        self._from: Pause | None = None

    def observe(self, pause: Pause) -> bool:
        """Whether the finger touches, with one more pause seen.

        pause : after an inward pulse, or before the first one; one in which markers were lost tells nothing,
            the next is compared with the last one known
        """
        if not pause.known:
            return self.touching
        last, self._last = self._last, pause
        if last is None or self.touching:
            return self.touching
        lower, upper = pause.theta1 - last.theta1, pause.theta2 - last.theta2
        turned, pressed = pause.bend - last.bend, pause.pressure - last.pressure
        lag_shape, lag_pressure = self._lags(lower, upper, turned, pressed)
        slack = self.settings.slack_deg * DEG
        self.shape_lag = max(0.0, self.shape_lag + lag_shape - slack)
        self.pressure_lag = max(0.0, self.pressure_lag + lag_pressure - slack)
        if self.shape_lag == 0.0 or self._from is None:
            self._from = last if self.shape_lag > 0.0 else pause
        self.touching = self._sure()
        if not self.touching and self.shape_lag < 0.5 * self.settings.shape_deg * DEG:
            self._free.append((lower, upper, turned, pressed))
        return self.touching

    def force(self, pause: Pause) -> float:
        """Estimated contact force [N], never negative; 0 before contact.

        pause : the newest, its angles known
        """
        if not self.touching or self._from is None:
            return 0.0
        start = self._from
        apart = (pause.theta2 - start.theta2) - (pause.theta1 - start.theta1)
        return max(0.0, self._lever.moment / self._gain * apart / self._lever.arm)

    def _lags(self, lower: float, upper: float, turned: float, pressed: float) -> tuple[float, float]:
        """How far the lower half and the whole finger lag behind free bending in one pulse [rad]."""
        sums = np.array(list(self._free) or [(0.0, 0.0, 0.0, 0.0)]).sum(axis=0)
        ratio = (sums[0] + RATIO_PRIOR * RATIO_WEIGHT) / (sums[1] + RATIO_WEIGHT)
        ratio = float(np.clip(ratio, *RATIO_RANGE))
        shape = ratio * upper - lower
        known = len(self._free) >= 2 and sums[3] > LEAST_PRESSURE and sums[2] > LEAST_TURN
        if not known:
            return shape, 0.0
        self._gain = float(sums[2] / sums[3])
        return shape, self._gain * pressed - turned

    def _sure(self) -> bool:
        """Whether the sums are large: that of the shape alone, or both."""
        settings = self.settings
        if self.shape_lag > settings.shape_deg * DEG:
            return True
        both = min(self.shape_lag / settings.shape_deg, self.pressure_lag / settings.pressure_deg)
        return both > settings.both_share * DEG
