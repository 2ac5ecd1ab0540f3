"""First contact of a finger without a sensor for it: angles and pressures against free bending.

Between two pauses of the closing phase a free finger turns alike in both halves, and by as much as its
pressures say. An object holds the lower half back: theta1 lags behind theta2, the bend lags behind the
pressures. How the free finger does it is learnt from the pulses before, as two ratios, so that stiffness,
bubbles, creep and weight of this print drop out; what lags are summed (a one-sided cumulative sum), and
contact is where both sums are large.

After contact the two halves tell the force. The pressures' moment A dp bends every unit alike; the force F at
the height z_c takes its moment F (z_c - z) from each unit below it, arms that sum to a_1 over the lower and
a_2 over the upper half. The wall bears what is left: k b_i, with its stiffness k at rest and b_i the turn of
a half at which the relaxed wall would bear as much (`wall_memory`; the angles themselves creep):

    free:  b_1 = r b_2,  b_1 + b_2 = n A dp / k = g dp
    F = n A / g (r b_2 - b_1) / (a_1 - r a_2)

counted from the last free pause. The stiffness of this print is in g, which was measured; A is geometry, from
the reduced finger.
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
GAIN_RANGE = (0.2, 5.0)
"""Of the ratios that are learnt: lower over upper half; bend for a pressure over the identified one."""
LEAST_TURN, LEAST_PRESSURE = 0.15 * DEG, 0.5 * KPA
"""Changes below which a pulse teaches nothing [rad, MPa]."""


@dataclass(frozen=True)
class Pause:
    """What a finger showed in the pause after a pulse; angles inward positive.

    theta1, theta2 : turn of the lower and the upper half [rad]; nan where markers were lost
    bend : of the tip [rad]
    pressure : of the chamber that bends inward less that of the other [MPa]
    borne : turns of both halves at which the relaxed wall would bear as much [rad]; the turns themselves, as
        of a wall without memory, if not given
    """

    theta1: float
    theta2: float
    bend: float
    pressure: float
    borne: tuple[float, float] | None = None

    @property
    def load(self) -> tuple[float, float]:
        """What the walls of the lower and the upper half bear, as turns of the relaxed wall [rad]."""
        return self.borne or (self.theta1, self.theta2)

    @property
    def known(self) -> bool:
        """Whether both halves and the bend were seen."""
        return isfinite(self.theta1 + self.theta2 + self.bend)


@dataclass(frozen=True)
class GripLever:
    """How a contact force acts on the finger.

    moment : moment of all units for a pressure difference, n A [N mm/MPa]
    lower, upper : arms summed over the units of either half [mm]
    gain : bend of the relaxed finger for a pressure difference, before it is learnt [rad/MPa]
    half : number of units of a half
    """

    moment: float
    lower: float
    upper: float
    gain: float
    half: float

    def reach(self, pause: Pause) -> float:
        """How far inward the flank has moved at the contact's height, against the straight finger [mm].

        pause : its angles; each half is taken as an arc
        """
        return (self.lower * pause.theta1 + self.upper * pause.theta2) / self.half


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
    return GripLever(
        moment, float(arms[lower].sum()), float(arms[~lower].sum()), relaxed, finger.n_units / 2.0
    )


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
        self._free: deque[tuple[float, ...]] = deque(maxlen=settings.learnt_pulses)
        self._gain, self._ratio = lever.gain, RATIO_PRIOR
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
        loaded = sum(pause.load) - sum(last.load)
        lag_shape, lag_pressure = self._lags(lower, upper, turned, pressed)
        slack = self.settings.slack_deg * DEG
        self.shape_lag = max(0.0, self.shape_lag + lag_shape - slack)
        self.pressure_lag = max(0.0, self.pressure_lag + lag_pressure - slack)
        if self.shape_lag == 0.0 or self._from is None:
            self._from = last if self.shape_lag > 0.0 else pause
        self.touching = self._sure()
        if not self.touching and self.shape_lag < 0.5 * self.settings.shape_deg * DEG:
            self._free.append((lower, upper, turned, pressed, loaded))
        return self.touching

    def force(self, pause: Pause) -> float:
        """Estimated contact force [N], never negative; 0 before contact.

        pause : the newest, its angles known
        """
        if not self.touching or self._from is None:
            return 0.0
        lower, upper = (now - then for now, then in zip(pause.load, self._from.load, strict=True))
        apart = self._ratio * upper - lower
        arm = self._lever.lower - self._ratio * self._lever.upper
        return max(0.0, self._lever.moment / self._gain * apart / arm)

    def _lags(self, lower: float, upper: float, turned: float, pressed: float) -> tuple[float, float]:
        """How far the lower half and the whole finger lag behind free bending in one pulse [rad]."""
        sums = np.array(list(self._free) or [(0.0,) * 5]).sum(axis=0)
        ratio = (sums[0] + RATIO_PRIOR * RATIO_WEIGHT) / (sums[1] + RATIO_WEIGHT)
        self._ratio = float(np.clip(ratio, *RATIO_RANGE))
        shape = self._ratio * upper - lower
        known = len(self._free) >= 2 and sums[3] > LEAST_PRESSURE and sums[2] > LEAST_TURN
        if not known:
            return shape, 0.0
        self._gain = max(float(sums[4] / sums[3]), GAIN_RANGE[0] * self._lever.gain)
        self._gain = min(self._gain, GAIN_RANGE[1] * self._lever.gain)
        return shape, float(sums[2] / sums[3]) * pressed - turned

    def _sure(self) -> bool:
        """Whether the sums are large: that of the shape alone, or both."""
        settings = self.settings
        if self.shape_lag > settings.shape_deg * DEG:
            return True
        both = min(self.shape_lag / settings.shape_deg, self.pressure_lag / settings.pressure_deg)
        return both > settings.both_share * DEG
