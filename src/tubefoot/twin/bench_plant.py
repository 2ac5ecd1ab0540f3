"""Everything physical of one finger's bench as the board's pins see it: pump, fluid, finger, sensors, rail.

The parts have files of their own (`pump`, `hydraulics`, `finger_response`, `transducers`); here they are
stepped in turn, and hands may vent a branch, hold it at a pressure or spoil a sensor. MPa, mm^3, s.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin, tau

import numpy as np
from numpy.typing import NDArray

from tubefoot.lab.settings import BRANCHES
from tubefoot.reduced.relaxation import ROOM_C
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.finger_response import FingerResponse
from tubefoot.twin.fingers import finger_of
from tubefoot.twin.hydraulics import Hydraulics
from tubefoot.twin.plant import PumpDrive
from tubefoot.twin.pump import Pump
from tubefoot.twin.transducers import Rail, Transducers
from tubefoot.units import KPA

ROOM_K = 273.15 + ROOM_C
"""Absolute temperature at which the finger was identified [K]."""
CLIMATE_S = 0.1
"""How often the temperature is looked at [s]."""
QUIET_S = 5e-3
"""Step of the fluid while the pump stands and little changes [s]; sensors and board keep theirs."""
QUIET_MPA_PER_S = 20.0 * KPA
"""Rate of the pressures below which little changes: 0.1 kPa in a quiet step, as much as a sample scatters."""


@dataclass(frozen=True, slots=True)
class Truth:
    """The bench as it is, for tests and reports; nothing that steers may look at it.

    time : since power-up [s]
    bend : direction of the finger's tip [rad]
    unit_angles : from the base [rad]
    chamber_pressures, branch_pressures : gauge, right and left [MPa]
    chamber_volumes : liquid that entered each chamber since the start [mm^3]
    column_levels : of the visible columns, right and left [mm]
    pump_flow : of the motor's speed, without ripple [mm^3/s]
    temperature : difference from 23 degC [K]
    """

    time: float
    bend: float
    unit_angles: NDArray[np.float64]
    chamber_pressures: tuple[float, float]
    branch_pressures: tuple[float, float]
    chamber_volumes: tuple[float, float]
    column_levels: tuple[float, float]
    pump_flow: float
    temperature: float


class BenchPlant:
    """The bench of one finger; the same settings and seed give the same run.

    `vent` and `hold` are what hands do to the branches; `dispensed` counts what leaves the right branch while
    vented [mm^3]; `overrides` replaces sensor outputs, by input, with volts.
    """

    def __init__(
        self, make: BenchSettings | None = None, seed: int = 0, finger: FingerResponse | None = None
    ):
        """Set the bench up at rest.

        make : what it is made of; the nominal bench if not given
        seed : of the sensor noise and of where the rollers stand
        finger : how the chambers respond; by the settings if not given
        """
        self.make = make or BenchSettings()
        rollers, noise = np.random.default_rng(seed).spawn(2)
        self.time = 0.0
        self.finger = finger or finger_of(self.make.finger, self.make.climate.start_k)
        self.hydraulics = Hydraulics(self.make, self.finger)
        self.pump = Pump(self.make.pump, rollers.uniform(0.0, tau))
        self.rail = Rail(self.make.sensors)
        self.transducers = Transducers(self.make.sensors, noise)
        self.dispensed = 0.0
        self.overrides: dict[int, float] = {}
        self._vented = False
        self._climate_due = 0.0
        self._turning = False
        self._waiting = self._next_step = 0.0

    def vent(self) -> None:
        """Open both branches to the air."""
        self._vented = True
        for side in self.hydraulics.sides:
            side.held = 0.0

    def hold(self, branch: str, pressure: float) -> None:
        """Hold one branch at a pressure, as a syringe would; the other one is closed.

        branch : `right` or `left`
        pressure : gauge [MPa]
        """
        self._vented = False
        for name, side in zip(BRANCHES, self.hydraulics.sides, strict=False):
            side.held = pressure if name == branch else None

    def seal(self) -> None:
        """Close both branches."""
        self._vented = False
        for side in self.hydraulics.sides:
            side.held = None

    def truth(self) -> Truth:
        """The bench as it is."""
        fluid = self.hydraulics
        return Truth(
            self.time,
            self.finger.bend,
            self.finger.unit_angles,
            fluid.chamber_pressure,
            fluid.branch_pressure,
            fluid.chamber_volumes,
            fluid.column_levels,
            self.pump.flow,
            self._kelvin(),
        )

    def step(self, duration: float, drive: PumpDrive) -> None:
        """Move on.

        duration : [s]
        drive : what the pump got meanwhile
        """
        self.time += duration
        if self.time >= self._climate_due:
            self._climate_due = self.time + CLIMATE_S
            self._warm()
        if drive.direction or self._turning:
            self.rail.step(duration, drive.duty if drive.direction else 0.0)
            flow = self.pump.step(duration, drive.direction, drive.duty)
            self._turning = bool(drive.direction) or flow != 0.0
        else:
            flow = 0.0
        if self._vented:
            self.dispensed += flow * duration
        self._waiting += duration
        if flow != 0.0 or self._waiting >= self._next_step - 1e-9:
            self._move_fluid(flow)
        self.transducers.step(duration, self.hydraulics.branch_pressure)

    def sensor_volts(self) -> tuple[float, float, float, float]:
        """Outputs of the two sensors [V]; the other two inputs are pulled to ground."""
        right, left = self.transducers.volts(self.rail.volts)
        if not self.overrides:
            return right, left, 0.0, 0.0
        volts = [right, left, 0.0, 0.0]
        for channel, value in self.overrides.items():
            volts[channel] = value
        return volts[0], volts[1], volts[2], volts[3]

    def supply_volts(self) -> float:
        """The board's 5 V rail [V]."""
        return self.rail.volts

    def _move_fluid(self, flow: float) -> None:
        """Step the fluid by the time that waits for it, and choose how long the next step may wait."""
        before = self.hydraulics.branch_pressure
        self.hydraulics.step(self._waiting, flow)
        after = self.hydraulics.branch_pressure
        change = max(abs(after[0] - before[0]), abs(after[1] - before[1]))
        quiet = flow == 0.0 and change < QUIET_MPA_PER_S * self._waiting
        self._next_step = QUIET_S if quiet else 0.0
        self._waiting = 0.0

    def _kelvin(self) -> float:
        climate = self.make.climate
        swing = climate.swing_k * sin(tau * self.time / climate.swing_period_s)
        return climate.start_k + climate.drift_k_per_h * self.time / 3600.0 + swing

    def _warm(self) -> None:
        """Let air and walls take the room's temperature; the loop was closed at that of the start."""
        climate, now = self.make.climate, self._kelvin()
        self.hydraulics.temperature = (ROOM_K + now) / (ROOM_K + climate.start_k)
        self.finger.scale_stiffness(max(0.05, 1.0 + climate.stiffness_per_k * now))
