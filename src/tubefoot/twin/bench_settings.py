"""What a virtual bench is made of: pump, branches, finger, sensors, camera, climate, every number of them.

The defaults are the nominal bench: the 12-unit reference finger on the paper's parts. Where the paper or a
data sheet gives no number, the docstring says `assumed`. `population.py` draws benches about it.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tubefoot.config import Settings


class PumpMake(Settings):
    """The peristaltic pump and its bridge (NKP-DC-S10B, L298N)."""

    flow_forward_ml_per_s: float = Field(default=1.45, gt=0, le=20)
    """at full duty into the right chamber; the maker says 1.5 at most"""
    flow_reverse_ml_per_s: float = Field(default=1.38, gt=0, le=20)
    """at full duty into the left chamber"""
    dead_duty_forward: float = Field(default=0.14, ge=0, lt=0.9)
    """duty below which the motor does not turn forward"""
    dead_duty_reverse: float = Field(default=0.16, ge=0, lt=0.9)
    """duty below which the motor does not turn in reverse"""
    stiction_duty: float = Field(default=0.03, ge=0, le=0.5)
    """extra duty that a standing motor needs to start (friction; assumed)"""
    lag_s: float = Field(default=0.05, ge=0.001, le=2)
    """time constant of the motor, both ways (assumed)"""
    ripple: float = Field(default=0.35, ge=0, le=1)
    """depth of the dip when a roller lifts off, share of the flow"""
    rollers: int = Field(default=3, ge=1, le=12)
    """rollers of the head"""
    stroke_ml: float = Field(default=0.9, gt=0, le=20)
    """volume of one turn"""
    wear: float = Field(default=0.0, ge=0, le=0.9)
    """share of the flow that the tube has lost since new"""
    wear_per_l: float = Field(default=0.0, ge=0, le=1)
    """further share lost for each litre pumped"""
    leak_back_ul_per_s_kpa: float = Field(default=0.01, ge=0, le=100)
    """flow back through the rollers for each kPa between the branches, running or not (assumed)"""


class BranchMake(Settings):
    """Tube, trapped air and visible column of each branch."""

    air_right_ml: float = Field(default=1.0, ge=0, le=50)
    """air above the right column at zero gauge pressure"""
    air_left_ml: float = Field(default=1.1, ge=0, le=50)
    """air above the left column"""
    tube_kpa_s_per_ml: float = Field(default=1.9, ge=0, le=1000)
    """flow resistance of the tube from the branch to its chamber"""
    column_bore_mm: float = Field(default=4.0, gt=0, le=50)
    """inner diameter of the visible column (assumed)"""
    column_level_mm: float = Field(default=40.0, ge=0, le=1000)
    """level at rest above the column's foot (assumed)"""


class FingerMake(Settings):
    """The printed finger and what is in its chambers."""

    law: Literal["chain", "still", "linear"] = "chain"
    """the reduced model as a MuJoCo chain; the same without weight and inertia; or a linear stand-in"""
    model: str = ""
    """file of a reduced model, written by `tubefoot reduce`; the 12-unit reference finger if empty"""
    units: int | None = Field(default=None, ge=1, le=48)
    """number of units, made from the units of the model; as many as the model has if not given"""
    tilt_deg: float = Field(default=0.0, ge=-180, le=180)
    """of the straight finger against the vertical, to the left: 0 stands, 180 hangs; for the chain"""
    stiffness: float = Field(default=1.0, gt=0.05, le=20)
    """factor on every modulus of this print"""
    seam_stiffening: float = Field(default=0.0, ge=0, le=5)
    """bending stiffness that the bonded seam adds, share of the finger's own at rest"""
    creep: bool = True
    """whether the wall relaxes"""
    bubble_right_ml: float = Field(default=0.1, ge=0, le=20)
    """air left in the right chamber, at zero gauge pressure"""
    bubble_left_ml: float = Field(default=0.1, ge=0, le=20)
    """air left in the left chamber"""


class SensorMake(Settings):
    """Two gauge sensors of +-100 kPa and the 5 V rail that feeds them."""

    noise_v: float = Field(default=0.004, ge=0, le=1)
    """standard deviation of an output"""
    offset_right_v: float = Field(default=0.012, ge=-1, le=1)
    """zero shift of the right sensor"""
    offset_left_v: float = Field(default=-0.008, ge=-1, le=1)
    """zero shift of the left sensor"""
    gain_right: float = Field(default=1.0, gt=0.5, lt=2)
    """factor on the right sensor's 20 mV / kPa"""
    gain_left: float = Field(default=1.0, gt=0.5, lt=2)
    """factor on the left sensor's 20 mV / kPa"""
    lag_s: float = Field(default=0.001, ge=0, le=1)
    """time constant (data sheet: response 1 ms)"""
    ratiometric: bool = True
    """whether the outputs scale with the rail"""
    sag_running_v: float = Field(default=0.10, ge=0, le=1)
    """drop of the rail while the motor runs at full duty"""
    sag_start_v: float = Field(default=0.15, ge=0, le=1)
    """its extra at the start"""


class CameraMake(Settings):
    """The camera before the finger."""

    frames_per_s: float = Field(default=30.0, gt=0, le=500)
    """rate of capture"""
    latency_ms: float = Field(default=55.0, ge=0, le=2000)
    """from the middle of the exposure to the reader, mean"""
    jitter_ms: float = Field(default=5.0, ge=0, le=500)
    """standard deviation of the latency"""
    drop_share: float = Field(default=0.015, ge=0, le=1)
    """share of frames that never arrive"""
    exposure_ms: float = Field(default=8.0, ge=0, le=100)
    """time that a frame gathers light"""
    read_noise: float = Field(default=2.0, ge=0, le=50)
    """dark noise in grey levels"""
    timeout_s: float = Field(default=0.3, gt=0, le=60)
    """a reader gives up when no frame comes for so long"""
    angle_sigma_deg: float = Field(default=0.02, ge=0, le=5)
    """scatter of a measured angle from frame to frame; measured at 30 px markers (docs/verification.md)"""
    angle_offset_deg: float = Field(default=0.008, ge=-5, le=5)
    """error of the zero, one for a run; measured end to end"""
    angle_gain: float = Field(default=1.0, gt=0.5, lt=2)
    """error of scale by a tilted bending plane"""


class Climate(Settings):
    """Temperature about 23 degC, where the finger was identified."""

    start_k: float = Field(default=0.0, ge=-20, le=40)
    """difference from 23 degC at the start"""
    drift_k_per_h: float = Field(default=0.0, ge=-60, le=60)
    """steady drift of the room"""
    swing_k: float = Field(default=0.0, ge=0, le=20)
    """amplitude of a slow swing (air conditioning)"""
    swing_period_s: float = Field(default=900.0, ge=10, le=100000)
    """its period"""
    stiffness_per_k: float = Field(default=-0.03, ge=-0.3, le=0.1)
    """change of the wall's stiffness a kelvin; Agilus30 at 1 Hz loses 0.13, at rest less (assumed)"""


class BenchSettings(Settings):
    """A whole virtual bench."""

    pump: PumpMake = PumpMake()
    branches: BranchMake = BranchMake()
    finger: FingerMake = FingerMake()
    sensors: SensorMake = SensorMake()
    camera: CameraMake = CameraMake()
    climate: Climate = Climate()
