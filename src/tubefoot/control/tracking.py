"""Continuous tracking: at each frame the pump gets the flow that brings the finger onto the trajectory soon.

The flow is solved from the learnt creep model, so that latency and creep are anticipated. Near its dead zone
the pump is driven in bursts. Before it turns round it is stopped for a frame.
"""

from __future__ import annotations

import numpy as np

from tubefoot.control.contract import Command, Finished, Measurement, Pulse, Stop, Wait
from tubefoot.control.creep import CreepLaw
from tubefoot.control.estimator import BendEstimator
from tubefoot.control.settings import TrackingSettings
from tubefoot.control.trajectory import Trajectory
from tubefoot.lab.pump import pumped_volume
from tubefoot.lab.settings import PumpSettings
from tubefoot.units import DEG

SHORTEST_S = 4e-3
FRAME_S = 1 / 30
BISECTIONS = 12


class TrackingController:
    """Follows a trajectory from its first frame on."""

    name = "tracking"

    def __init__(
        self,
        trajectory: Trajectory,
        law: CreepLaw,
        pump: PumpSettings,
        settings: TrackingSettings | None = None,
    ):
        """Take the trajectory.

        trajectory : wanted bend over time
        law : creep of this kind of finger
        pump : as calibrated
        settings : how it is driven
        """
        self.estimator = BendEstimator(law)
        self.trajectory = trajectory
        self.settings = settings or TrackingSettings()
        self._pump = pump
        self._began: float | None = None

    def target_at(self, time: float) -> float:
        """Wanted bend [rad].

        time : on the rig's clock [s]
        """
        return self.trajectory.at(time - self._began if self._began is not None else 0.0)

    def decide(self, seen: Measurement) -> Command:
        """The pump's drive until the next frame.

        seen : the newest frame
        """
        if self._began is None:
            self._began = seen.time
        self.estimator.observe(seen)
        if seen.seen_at - self._began >= self.trajectory.duration:
            return Finished(True, "trajectory done")
        settings, ahead = self.settings, self.estimator.forecast(seen)
        at = np.array([settings.ahead_s])
        missing = self.target_at(seen.time + settings.ahead_s) - float(ahead.free(at)[0])
        rate = missing / (settings.ahead_s * float(ahead.step(at, settings.ahead_s)[0]))
        direction = 1 if rate > 0 else -1
        if abs(rate) < settings.quiet_deg_per_s * DEG:
            return Stop("on the trajectory") if seen.direction else Wait("on the trajectory")
        if seen.direction and seen.direction != direction:
            return Stop("before turning round")
        return self._drive(direction, abs(rate) / ahead.gain(direction))

    def _drive(self, direction: int, flow: float) -> Command:
        """A run of the pump with a mean flow [mm^3/s]."""
        settings = self.settings
        least = self._flow(direction, settings.least_duty)
        if flow < least:
            duration = FRAME_S * flow / least
            if duration < SHORTEST_S:
                return Wait("less than the shortest burst")
            return Pulse(direction, settings.least_duty, duration, "burst", in_place=True)
        return Pulse(direction, self._duty(direction, flow), settings.burst_s, "drive", in_place=True)

    def _duty(self, direction: int, flow: float) -> float:
        """Duty that gives a flow, 1 where the pump cannot [-]."""
        low, high = self.settings.least_duty, 1.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._flow(direction, middle) < flow else (low, middle)
        return high

    def _flow(self, direction: int, duty: float) -> float:
        """Flow at a duty, as calibrated [mm^3/s]."""
        return abs(pumped_volume(self._pump, direction, duty, 1.0)[0])
