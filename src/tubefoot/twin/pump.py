"""The peristaltic pump: dead zone, stiction, lag, ripple of the rollers, wear.

A roller that lifts off takes its share of the tube with it: the flow dips once for each roller and turn,
q = q_mean (1 - ripple (max(0, cos phase)^4 - 3/16)), 3/16 being the mean of the dip. What flows back through
the rollers is the hydraulics' affair. mm^3, s.
"""

from __future__ import annotations

from math import cos, exp, tau

from tubefoot.twin.bench_settings import PumpMake
from tubefoot.units import ML

MEAN_DIP = 3.0 / 16.0
MM3_PER_L = 1e6
STOPPED = 0.5
"""Flow below which friction holds the motor [mm^3/s], a three-thousandth of its full one; not known of real
pumps. The lean bench's pulses fade out: where rollers stop at 3 mm^3/s, fitted flows are too low."""


class Pump:
    """A pump that stands at first.

    flow : of the motor's present speed, without ripple, positive into the right branch [mm^3/s]
    turned : volume that passed either way [mm^3]
    """

    def __init__(self, make: PumpMake, phase: float = 0.0):
        """Mount it.

        make : what it is made of
        phase : where the rollers stand [rad]
        """
        self.flow = 0.0
        self.turned = 0.0
        self._make = make
        self._lag = make.lag_s
        self._stroke = make.stroke_ml * ML
        self._phase = phase
        self._full = {1: make.flow_forward_ml_per_s * ML, -1: make.flow_reverse_ml_per_s * ML}
        self._dead = {1: make.dead_duty_forward, -1: make.dead_duty_reverse}
        self._decay = (0.0, 1.0)

    def step(self, duration: float, direction: int, duty: float) -> float:
        """Flow over the step [mm^3/s], positive into the right branch.

        duration : [s]
        direction : 1 forward, -1 reverse, 0 off
        duty : 0 to 1
        """
        wanted = self._wanted(direction, duty) if direction else 0.0
        if wanted == 0.0 and abs(self.flow) < STOPPED:
            self.flow = 0.0
            return 0.0
        self.flow += (wanted - self.flow) * (1.0 - self._decayed(duration))
        self.turned += abs(self.flow) * duration
        self._phase = (
            self._phase + abs(self.flow) * duration / self._stroke * self._make.rollers * tau
        ) % tau
        lift = cos(self._phase)
        dip = lift**4 if lift > 0.0 else 0.0
        return self.flow * (1.0 - self._make.ripple * (dip - MEAN_DIP))

    def _wanted(self, direction: int, duty: float) -> float:
        dead = self._dead[direction]
        standing = self.flow * direction <= 0.0
        if duty <= dead + (self._make.stiction_duty if standing else 0.0):
            return 0.0
        worn = self._make.wear + self._make.wear_per_l * self.turned / MM3_PER_L
        return direction * self._full[direction] * max(0.0, 1.0 - worn) * (duty - dead) / (1.0 - dead)

    def _decayed(self, duration: float) -> float:
        if self._decay[0] != duration:
            self._decay = (duration, exp(-duration / self._lag))
        return self._decay[1]
