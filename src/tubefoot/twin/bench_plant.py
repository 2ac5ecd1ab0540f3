"""A small bench: pump, two branches with trapped air, tubes, two chambers of a linear finger, sensors.

Branch b: C_air p_b' = +-q - f, C_air = V0 p0 / (p0 + p_b)^2 (isothermal trapped air, gauge pressures).
Tube: f = (p_b - p_c) / R. Chambers: w = c p_c + m (p_c - p_other), a linear compliance of each chamber and
one of the partition between them. The pump has a dead band, a first-order lag and roller ripple. The branch
pressures are solved implicitly, so that the step of 1 ms is stable. Gravity, creep, bubbles, contact are left
out.

Inside units: MPa, mm^3, s.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, tau

import numpy as np

from tubefoot.lab.rig import FORWARD, REVERSE
from tubefoot.twin.plant import PumpDrive
from tubefoot.units import ATMOSPHERE_MPA, KPA, ML

TRANSDUCER_V_PER_KPA = 0.02
ZERO_V = 2.5
NOMINAL_V = 5.0


@dataclass(frozen=True)
class BenchParameters:
    """What the bench is made of.

    flow : at full duty, forward and reverse [mm^3/s]
    dead_duty : below it the pump stands, forward and reverse
    lag : time constant of the pump [s]
    ripple, rollers, stroke : depth of the flow ripple, rollers, volume of a turn [mm^3]
    trapped_air : air pocket of each branch at zero pressure [mm^3]
    tube_resistance : [MPa s/mm^3]
    chamber_compliance, partition_compliance : volume by own pressure, by pressure difference [mm^3/MPa]
    sensor_noise : standard deviation of a sensor's output [V]
    sensor_offset : zero shift of each sensor [V]
    supply_sag : drop of the 5 V rail at full duty, and its extra at motor start [V]
    ratiometric : whether the sensors' outputs scale with the supply
    """

    flow: tuple[float, float] = (1.45 * ML, 1.38 * ML)
    dead_duty: tuple[float, float] = (0.14, 0.16)
    lag: float = 0.05
    ripple: float = 0.35
    rollers: int = 3
    stroke: float = 0.9 * ML
    trapped_air: tuple[float, float] = (1.0 * ML, 1.1 * ML)
    tube_resistance: float = 1.9e-6
    chamber_compliance: float = 2.0 * ML / (100 * KPA)
    partition_compliance: float = 1.5 * ML / (100 * KPA)
    sensor_noise: float = 0.004
    sensor_offset: tuple[float, float] = (0.012, -0.008)
    supply_sag: tuple[float, float] = (0.10, 0.15)
    ratiometric: bool = True


class BenchPlant:
    """The bench of one finger; the same seed gives the same run.

    `vented` opens both branches to the air; `applied` holds a branch at a given pressure, as a syringe would;
    `dispensed` counts what leaves the right branch while vented; `overrides` replaces outputs by volts.
    """

    def __init__(self, parameters: BenchParameters | None = None, seed: int = 0):
        """Set the bench up at rest.

        parameters : what it is made of
        seed : of the sensor noise
        """
        self.parameters = parameters or BenchParameters()
        self.branch_pressure = np.zeros(2)
        self.chamber_volume = np.zeros(2)
        self.pump_flow = 0.0
        self.vented = False
        self.applied: dict[int, float] = {}
        self.dispensed = 0.0
        self.overrides: dict[int, float] = {}
        self._supply = NOMINAL_V
        self._roller = 0.0
        self._started = 0.0
        self._noise = np.random.default_rng(seed)

    @property
    def chamber_pressure(self) -> np.ndarray:
        """Pressures of the right and left chamber [MPa]."""
        c, m = self.parameters.chamber_compliance, self.parameters.partition_compliance
        stiffness = np.array([[c + m, m], [m, c + m]]) / (c * (c + 2 * m))
        pressure: np.ndarray = stiffness @ self.chamber_volume
        return pressure

    def step(self, duration: float, drive: PumpDrive) -> None:
        """Move on.

        duration : [s]
        drive : what the pump got meanwhile
        """
        self._turn_pump(duration, drive)
        self._sag(duration, drive)
        flow = self._rippled(duration)
        if self.vented:
            self.dispensed += flow * duration
            self.branch_pressure[:] = 0.0
        else:
            self._exchange(duration, flow)
        for branch, pressure in self.applied.items():
            self.branch_pressure[branch] = pressure

    def sensor_volts(self) -> tuple[float, float, float, float]:
        """Outputs of the two sensors [V]; the other two inputs are pulled to ground."""
        scale = self._supply / NOMINAL_V if self.parameters.ratiometric else 1.0
        clean = ZERO_V + TRANSDUCER_V_PER_KPA * self.branch_pressure / KPA + self.parameters.sensor_offset
        noisy = (clean + self.parameters.sensor_noise * self._noise.standard_normal(2)) * scale
        volts = [*np.clip(noisy, 0.25, 4.75).tolist(), 0.0, 0.0]
        for channel, value in self.overrides.items():
            volts[channel] = value
        return volts[0], volts[1], volts[2], volts[3]

    def supply_volts(self) -> float:
        """The board's 5 V rail [V]."""
        return self._supply

    def _turn_pump(self, duration: float, drive: PumpDrive) -> None:
        wanted = 0.0
        if drive.direction != 0:
            side = 0 if drive.direction == FORWARD else 1
            dead = self.parameters.dead_duty[side]
            sign = 1.0 if drive.direction == FORWARD else float(REVERSE)
            wanted = sign * self.parameters.flow[side] * max(0.0, drive.duty - dead) / (1.0 - dead)
        self.pump_flow += (wanted - self.pump_flow) * (1.0 - exp(-duration / self.parameters.lag))

    def _sag(self, duration: float, drive: PumpDrive) -> None:
        running, start = self.parameters.supply_sag
        on = drive.duty if drive.direction else 0.0
        self._started = self._started + duration if on else 0.0
        surge = start * exp(-self._started / self.parameters.lag) if on else 0.0
        self._supply = NOMINAL_V - on * (running + surge)

    def _rippled(self, duration: float) -> float:
        """Flow of the pump with the dips of its rollers, their mean removed [mm^3/s]."""
        p = self.parameters
        self._roller += abs(self.pump_flow) * duration / p.stroke * p.rollers * tau
        dip = max(0.0, cos(self._roller)) ** 4
        mean_dip = 3.0 / 16.0  # of max(0, cos)^4 over a turn
        return self.pump_flow * (1.0 - p.ripple * (dip - mean_dip))

    def _exchange(self, duration: float, flow: float) -> None:
        """Move fluid between pump, branches and chambers, branch and chamber pressures implicit."""
        p = self.parameters
        air = np.array(p.trapped_air) * ATMOSPHERE_MPA / (ATMOSPHERE_MPA + self.branch_pressure) ** 2
        c, m = p.chamber_compliance, p.partition_compliance
        stiffness = np.array([[c + m, m], [m, c + m]]) / (c * (c + 2 * m))
        source = np.array([flow, -flow])
        system = np.diag(p.tube_resistance + duration / air) + duration * stiffness
        driving = self.branch_pressure + duration * source / air - stiffness @ self.chamber_volume
        tube_flow = np.linalg.solve(system, driving)
        self.branch_pressure += duration * (source - tube_flow) / air
        np.maximum(self.branch_pressure, -0.99 * ATMOSPHERE_MPA, out=self.branch_pressure)
        self.chamber_volume += duration * tube_flow
