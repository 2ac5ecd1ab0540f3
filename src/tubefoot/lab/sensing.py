"""From counts to pressures: sensor law, correction of the sagging supply, the neutral reading.

The board's converter measures against its 5 V supply. Its own 1.1 V reference, read the same way, tells what
the supply is: V = V_ref x 1024 / reading. A ratiometric sensor on the same supply sags with it and needs no
correction; one with its own regulator reads too high while the pump starts. What is left (wiring, ground
shift) is linear in the supply and is identified by `tubefoot rig calibrate supply`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tubefoot.errors import LinkError
from tubefoot.lab.messages import ADC_FULL_SCALE, COUNT_SCALE, SUPPLY_SCALE
from tubefoot.lab.rig import Neutral, Reading, Rig
from tubefoot.lab.settings import SensorSettings
from tubefoot.units import KPA

NOMINAL_V = 5.0


def supply_voltage(supply_reading: int, reference_v: float) -> float:
    """The board's supply [V], nan before the first reading.

    supply_reading : the 1.1 V reference against the supply [1/16 count]
    reference_v : the calibrated reference [V]
    """
    if supply_reading == 0:
        return float("nan")
    return reference_v * ADC_FULL_SCALE * SUPPLY_SCALE / supply_reading


def gauge_pressure(reading: int, supply_v: float, sensor: SensorSettings) -> float:
    """Gauge pressure [MPa] behind a sensor's reading, corrected for the supply.

    reading : mean reading [1/64 count]
    supply_v : the supply at the same time [V]
    sensor : the sensor's law
    """
    fraction = reading / (COUNT_SCALE * ADC_FULL_SCALE)
    if not sensor.ratiometric:
        fraction *= supply_v / NOMINAL_V
    pressure_kpa = sensor.span_kpa * (fraction - sensor.zero_fraction)
    return (pressure_kpa - sensor.sag_kpa_per_v * (supply_v - NOMINAL_V)) * KPA


def counts_at(pressure: float, sensor: SensorSettings) -> int:
    """The converter's reading [count] at a pressure and the nominal supply, for the board's own limits.

    pressure : gauge pressure [MPa]
    sensor : the sensor's law
    """
    return round(ADC_FULL_SCALE * (sensor.zero_fraction + pressure / KPA / sensor.span_kpa))


def measure_neutral(rig: Rig, duration: float = 1.0) -> Neutral:
    """The neutral reading and its scatter, which the rig takes as zero from then on.

    rig : a connected rig whose pump stands
    duration : how long to average [s]

    Raises LinkError when fewer than ten samples came.
    """
    readings = [reading for reading in rig.wait(duration) if reading.direction == 0]
    if len(readings) < 10:
        raise LinkError(
            f"only {len(readings)} samples in {duration:g} s with the pump standing; wait for the pulse "
            "to end, or average for longer"
        )
    neutral = neutral_of(readings)
    rig.set_neutral(neutral)
    return neutral


def neutral_of(readings: Sequence[Reading]) -> Neutral:
    """Mean and scatter of some readings.

    readings : two or more, taken with the pump standing
    """
    pressures = np.array([reading.gauge_pressures for reading in readings])
    mean, scatter = pressures.mean(axis=0), pressures.std(axis=0, ddof=1)
    return Neutral(tuple(mean.tolist()), tuple(scatter.tolist()), len(readings))
