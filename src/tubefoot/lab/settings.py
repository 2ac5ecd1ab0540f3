"""The rig file: what hangs on the board, how it is calibrated, what it may do."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.lab.rig import RigLimits
from tubefoot.units import KPA, ML

BRANCHES = ("right", "left", "right_2", "left_2")
"""Names of the pressure inputs A0 to A3."""


class BoardSettings(Settings):
    """How to reach the board and how fast it reports."""

    port: str = "/dev/ttyACM0"
    """Serial port."""
    channels: Literal[2, 4] = 2
    """Pressure sensors: 2, or 4 with a second finger."""
    sample_rate_hz: Literal[10, 20, 25, 40, 50, 100, 200] = 200
    """Samples a second; each is the mean of the 1 kHz readings since the last."""
    reference_v: float = Field(default=1.1, ge=0.9, le=1.3)
    """The chip's own reference: 1.0 to 1.2 V by its data sheet, so calibrate it against a voltmeter."""


class SensorSettings(Settings):
    """A pressure sensor: gauge pressure = span x (output / supply - zero) - sag x (supply - nominal)."""

    zero_fraction: float = Field(default=0.5, ge=0.05, le=0.95)
    """Output at zero gauge pressure, as a fraction of the supply."""
    zero_sigma: float = Field(default=0.0, ge=0.0)
    """Standard uncertainty of `zero_fraction`."""
    span_kpa: float = Field(default=250.0, ge=1.0, le=10000.0)
    """Pressure that moves the output by the whole supply: 200 kPa over 0.5 to 4.5 V of 5 V is 250 kPa."""
    span_sigma_kpa: float = Field(default=0.0, ge=0.0)
    """Standard uncertainty of `span_kpa`."""
    ratiometric: bool = True
    """Whether the output scales with the supply; false for a sensor with its own regulator."""
    sag_kpa_per_v: float = Field(default=0.0, ge=-1000.0, le=1000.0)
    """What is left of the supply's influence, by `tubefoot rig calibrate supply`."""


UNCALIBRATED = SensorSettings()
"""A sensor of which the rig file says nothing."""


class FlowSettings(Settings):
    """What the pump moves in one direction: flow (duty - dead) / (1 - dead) (duration - lag), not below 0."""

    flow_ml_per_s: float = Field(default=1.5, gt=0.0, le=100.0)
    """Flow at full duty."""
    flow_sigma_ml_per_s: float = Field(default=0.15, ge=0.0)
    """Its standard uncertainty; 10 % until calibrated."""
    dead_duty: float = Field(default=0.15, ge=0.0, lt=1.0)
    """Duty below which the pump stands."""
    dead_duty_sigma: float = Field(default=0.05, ge=0.0)
    """Its standard uncertainty."""
    lag_s: float = Field(default=0.0, ge=-0.5, le=0.5)
    """Part of a pulse that moves nothing."""
    lag_sigma_s: float = Field(default=0.01, ge=0.0)
    """Its standard uncertainty."""


class PumpSettings(Settings):
    """The pump in its two directions."""

    forward: FlowSettings = FlowSettings()
    reverse: FlowSettings = FlowSettings()


class LimitSettings(Settings):
    """What the bench may do; the board enforces pressures, duty, duration and silence by itself."""

    pressure_low_kpa: float = Field(default=-90.0, ge=-100.0, lt=0.0)
    """Lowest gauge pressure of any branch; see the highest."""
    pressure_high_kpa: float = Field(default=90.0, gt=0.0, le=100.0)
    """Highest gauge pressure of any branch: what fast pumping needs, docs/decisions/0005-relaxation.md."""
    duty_max: float = Field(default=1.0, gt=0.0, le=1.0)
    """Largest duty."""
    pulse_max_s: float = Field(default=5.0, ge=0.001, le=10.0)
    """Longest pulse."""
    volume_max_ml: float = Field(default=12.0, gt=0.0)
    """Largest net volume either way from neutral."""
    silence_ms: int = Field(default=400, ge=50, le=450)
    """The board stops the pump when it hears nothing for so long."""


class RigSettings(Settings):
    """A bench."""

    name: str = "bench"
    """What this bench is called in recordings."""
    board: BoardSettings = BoardSettings()
    limits: LimitSettings = LimitSettings()
    sensors: dict[Literal["right", "left", "right_2", "left_2"], SensorSettings] = Field(default={})
    """One table for each branch; those left out have the defaults."""
    pump: PumpSettings = PumpSettings()

    @model_validator(mode="after")
    def _limits_within_sensors(self) -> RigSettings:
        for branch in BRANCHES[: self.board.channels]:
            sensor = self.sensor(branch)
            for key, pressure in (
                ("pressure_low_kpa", self.limits.pressure_low_kpa),
                ("pressure_high_kpa", self.limits.pressure_high_kpa),
            ):
                volts = 5.0 * (sensor.zero_fraction + pressure / sensor.span_kpa)
                if not 0.25 <= volts <= 4.75:
                    raise ValueError(
                        f"`limits.{key}` = {pressure:g}: the {branch} sensor would give {volts:.2f} V there, "
                        "outside the 0.25 to 4.75 V in which the board tells a reading from a broken wire; "
                        "lower the limit or use a sensor with more span"
                    )
        return self

    def sensor(self, branch: str) -> SensorSettings:
        """The sensor of a branch.

        branch : one of BRANCHES
        """
        return self.sensors.get(branch, UNCALIBRATED)  # type: ignore[call-overload]

    def on_port(self, port: str) -> RigSettings:
        """The same bench on another port.

        port : serial port
        """
        return self.model_copy(update={"board": self.board.model_copy(update={"port": port})})

    def rig_limits(self) -> RigLimits:
        """The limits in inside units."""
        return RigLimits(
            pressure_low=self.limits.pressure_low_kpa * KPA,
            pressure_high=self.limits.pressure_high_kpa * KPA,
            duty=self.limits.duty_max,
            pulse_duration=self.limits.pulse_max_s,
            pumped_volume=self.limits.volume_max_ml * ML,
            silence=self.limits.silence_ms * 1e-3,
            channels=self.board.channels,
        )
