"""What a recording is once it was read: pressures since rest, angles on the same clock, pulses of the pump.

Inside units (s, MPa, mm^3, rad) throughout; the first column of a pressure is the right branch. What is
doubtful is flagged and kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class RecordedPulse:
    """One run of the pump.

    start, end : on the recording's clock [s]
    direction : 1 forward, into the right chamber; -1 reverse
    duty : 0 to 1, nan where the source does not say
    volume : the host's own estimate, signed, nan where the source does not say [mm^3]
    """

    start: float
    end: float
    direction: int
    duty: float
    volume: float


@dataclass(frozen=True, slots=True)
class Rest:
    """The baseline that was subtracted.

    pressures : at rest, as the source has them, right and left [MPa]
    drift : slope of the line that was subtracted [MPa/s]; zero where it was not asked for
    drift_sigma : its standard error [MPa/s]
    angle : at rest [rad]
    sigma : scatter of one sample about it: right, left [MPa], angle [rad]
    """

    pressures: tuple[float, float]
    drift: tuple[float, float]
    drift_sigma: tuple[float, float]
    angle: float
    sigma: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Latency:
    """How much later the angles' stamps are than those of the pressures.

    seconds : estimated, nan where there was too little motion [s]
    sigma : its standard error [s]
    correlation : of the two rates at the best shift
    applied : whether it was taken off the angles' times
    """

    seconds: float
    sigma: float
    correlation: float
    applied: bool


NO_LATENCY = Latency(float("nan"), float("nan"), float("nan"), False)
"""Where there are no angles, or too few."""


@dataclass(frozen=True)
class BenchRecord:
    """A recording, ready to be judged.

    name : short name; units : of the finger, None where nobody said
    time : (n,) of the samples, 0 at the first [s]
    pressures : (n, 2) right and left branch, change since rest [MPa]
    drive : (n,) direction times duty of the pump, nan where unknown
    angle_time : (m,) of the angles, on the same clock [s]
    angle, angle_sigma : (m,) bend since rest and its standard uncertainty, nan where not seen [rad]
    pressure_outlier, angle_outlier : (n,), (m,) flagged, not deleted
    pulses : runs of the pump; rest : the baseline; latency : of the angles
    blind : stretches without samples that may hide a pulse [s]; none where the source lists its pulses
    provenance : file, its SHA-256, format, unit of each column in the source
    """

    name: str
    units: int | None
    time: FloatArray
    pressures: FloatArray
    drive: FloatArray
    angle_time: FloatArray
    angle: FloatArray
    angle_sigma: FloatArray
    pressure_outlier: BoolArray
    angle_outlier: BoolArray
    pulses: tuple[RecordedPulse, ...]
    rest: Rest
    latency: Latency
    blind: tuple[tuple[float, float], ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.time[-1])

    @property
    def odd_samples(self) -> int:
        """How many samples are flagged though both pressures are there."""
        return int((self.pressure_outlier & np.isfinite(self.pressures).all(axis=1)).sum())

    @property
    def has_angles(self) -> bool:
        """Whether any angle was seen."""
        return bool(np.isfinite(self.angle).any())


@dataclass(frozen=True, slots=True)
class RawSeries:
    """What a source holds, in inside units and before any correction; times on the source's clock.

    time, pressures, drive : (n,), (n, 2), (n,); drive nan where unknown
    angle_time, angle, angle_sigma : (m,)
    pulses : as the source lists them, empty where it lists none
    rest_pressures : the source's own reading at rest, None where it has none [MPa]
    units : of the finger, None where the source does not say
    provenance : see `BenchRecord`
    """

    time: FloatArray
    pressures: FloatArray
    drive: FloatArray
    angle_time: FloatArray
    angle: FloatArray
    angle_sigma: FloatArray
    pulses: tuple[RecordedPulse, ...]
    rest_pressures: tuple[float, float] | None
    units: int | None
    provenance: Mapping[str, str]
