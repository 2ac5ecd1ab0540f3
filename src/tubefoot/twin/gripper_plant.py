"""The benches of a gripper's fingers on one pace: their fluids step together, so that the scene can.

A single bench lets its fluid wait while little changes. Two fingers in one scene must wait for each other:
`Pace` says for all of them, a millisecond ahead, when the next step is due.
"""

from __future__ import annotations

from tubefoot.twin.bench_plant import CLIMATE_S, QUIET_MPA_PER_S, BenchPlant
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.finger_response import FingerResponse
from tubefoot.twin.plant import PumpDrive

BUSY_S, QUIET_S = 2e-3, 4e-3
"""Steps of the fluid while a pump runs or pressures change, and while all is quiet [s]."""


class Pace:
    """When the fluid of all plants steps.

    due : whether it does in the present round
    """

    def __init__(self, plants: int):
        """Begin with a step.

        plants : that keep the pace; each reports once a round
        """
        self.due = True
        self._plants = plants
        self._reports = 0
        self._busy = False

    def report(self, busy: bool, waiting: float, ahead: float) -> None:
        """One plant's round is over; the last one's decides about the next.

        busy : whether its fluid must not wait long; waiting : since its last step [s]; ahead : one round [s]
        """
        self._busy = self._busy or busy
        self._reports += 1
        if self._reports == self._plants:
            self.due = waiting + ahead >= (BUSY_S if self._busy else QUIET_S) - 1e-9
            self._reports, self._busy = 0, False


class PacedPlant(BenchPlant):
    """The bench of one finger whose fluid keeps a pace with others."""

    def __init__(self, make: BenchSettings, seed: int, finger: FingerResponse, pace: Pace):
        """Set it up at rest.

        make : what it is made of; seed : of noise and rollers
        finger : of the gripper, or both joined; pace : kept with the other bench
        """
        super().__init__(make, seed, finger)
        self._pace = pace
        self._brought = 0.0
        self._quiet = True

    def step(self, duration: float, drive: PumpDrive) -> None:
        """Move on.

        duration : [s]; drive : what the pump got meanwhile
        """
        self.time += duration
        if self.time >= self._climate_due:
            self._climate_due = self.time + CLIMATE_S
            self._warm()
        flow = 0.0
        if drive.direction or self._turning:
            self.rail.step(duration, drive.duty if drive.direction else 0.0)
            flow = self.pump.step(duration, drive.direction, drive.duty)
            self._turning = bool(drive.direction) or flow != 0.0
        self._brought += flow * duration
        self._waiting += duration
        if self._pace.due:
            before = self.hydraulics.branch_pressure
            self.hydraulics.step(self._waiting, self._brought / self._waiting)
            after = self.hydraulics.branch_pressure
            change = max(abs(after[0] - before[0]), abs(after[1] - before[1]))
            self._quiet = change < QUIET_MPA_PER_S * self._waiting
            self._brought = self._waiting = 0.0
        self._pace.report(flow != 0.0 or not self._quiet, self._waiting, duration)
        self.transducers.step(duration, self.hydraulics.branch_pressure)
