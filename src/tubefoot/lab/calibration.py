"""Calibrating sensors, supply and pump: what to do, and what the readings say, with uncertainty.

Each measurement takes a rig and an operator and returns rows for a table; each fit takes rows and returns
settings for the rig file. Uncertainties are standard ones from the scatter about the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.operator import Operator
from tubefoot.lab.rig import FORWARD, REVERSE, Rig
from tubefoot.lab.sensing import NOMINAL_V, neutral_of
from tubefoot.lab.settings import BRANCHES, FlowSettings, SensorSettings
from tubefoot.units import KPA

Progress = Callable[[str], None]
PRESSURES_KPA = (-40.0, -20.0, 0.0, 20.0, 40.0)
DUTIES = (0.3, 0.5, 0.75, 1.0)
DURATIONS_S = (0.1, 0.3, 1.0)
PULSES = 3
REST_S = 0.3


def measure_pressures(
    rig: Rig, operator: Operator, say: Progress, steps: Sequence[float] = PRESSURES_KPA
) -> list[dict[str, Any]]:
    """One row a branch and step: reference and indicated pressure [kPa].

    rig : connected, pump standing
    operator : who sets the pressures
    say : told about progress
    steps : pressures to set, about [kPa]
    """
    rows = []
    for channel, branch in enumerate(BRANCHES[: rig.limits.channels]):
        for step in steps:
            reference = operator.apply_pressure(branch, step)
            rig.wait(REST_S)
            reading = neutral_of(rig.wait(1.0))
            indicated = reading.pressures[channel] / KPA
            say(f"{branch}: reference {reference:.2f} kPa, indicated {indicated:.2f} kPa")
            row = {"branch": branch, "reference_kpa": reference, "indicated_kpa": indicated}
            rows.append(row | {"scatter_kpa": reading.scatter[channel] / KPA})
    return rows


def fit_sensor(rows: Sequence[Mapping[str, Any]], sensor: SensorSettings) -> tuple[SensorSettings, float]:
    """The sensor's law by least squares, and the largest residual [kPa].

    rows : of one branch, from `measure_pressures`, taken with the law `sensor`
    sensor : the law to correct
    """
    if len(rows) < 3:
        raise ConfigError(
            f"{len(rows)} pressures are too few for a line with its uncertainty; take 3 or more"
        )
    indicated = np.array([row["indicated_kpa"] for row in rows])
    reference = np.array([row["reference_kpa"] for row in rows])
    # indicated = span (fraction - zero): back to the fraction, then forward with the new law
    fraction = indicated / sensor.span_kpa + sensor.zero_fraction
    centre = float(fraction.mean())
    if np.ptp(fraction) < 0.02:
        raise ConfigError(
            "the sensor hardly moved (below 2 % of its supply); is it that branch, is it tight?"
        )
    design = np.stack([fraction - centre, np.ones_like(fraction)], axis=1)
    values, covariance = _least_squares(design, reference)
    span, middle = values
    fitted = sensor.model_copy(
        update={
            "span_kpa": float(span),
            "span_sigma_kpa": float(np.sqrt(covariance[0, 0])),
            "zero_fraction": float(centre - middle / span),
            "zero_sigma": float(np.sqrt(covariance[1, 1]) / span),
        }
    )
    return fitted, float(np.abs(design @ values - reference).max())


def measure_supply(rig: Rig, operator: Operator, say: Progress) -> list[dict[str, Any]]:
    """One row a sample, with the branches open and the pump at several duties: supply [V], indicated [kPa].

    rig : connected
    operator : who opens the branches
    say : told about progress
    """
    operator.vent()
    rows = []
    for duty in (0.4, 0.7, 1.0):
        rig.pulse(FORWARD, duty, 0.5)
        readings = rig.wait(0.4) + rig.wait(0.6)
        rig.pulse(REVERSE, duty, 0.5)
        readings += rig.wait(0.4) + rig.wait(0.6)
        say(f"duty {duty:g}: supply down to {min(reading.supply for reading in readings):.3f} V")
        for reading in readings:
            row: dict[str, Any] = {"supply_v": reading.supply}
            for branch, pressure in zip(BRANCHES, reading.gauge_pressures, strict=False):
                row[f"gauge_{branch}_kpa"] = pressure / KPA
            rows.append(row)
    return rows


def fit_sag(
    rows: Sequence[Mapping[str, Any]], branch: str, sensor: SensorSettings
) -> tuple[SensorSettings, float]:
    """The sensor with the supply's remaining influence, and that influence's uncertainty [kPa/V].

    rows : from `measure_supply`, taken with the law `sensor`
    branch : which
    sensor : the law to correct
    """
    supply = np.array([row["supply_v"] for row in rows]) - NOMINAL_V
    pressure = np.array([row[f"gauge_{branch}_kpa"] for row in rows])
    if np.ptp(supply) < 0.02:
        raise ConfigError(
            f"the supply moved by {np.ptp(supply) * 1e3:.0f} mV only while the pump ran: nothing to correct"
        )
    values, covariance = _least_squares(np.stack([supply, np.ones_like(supply)], axis=1), pressure)
    sag = sensor.sag_kpa_per_v + float(values[0])
    return sensor.model_copy(update={"sag_kpa_per_v": sag}), float(np.sqrt(covariance[0, 0]))


def measure_pump(
    rig: Rig,
    operator: Operator,
    say: Progress,
    duties: Sequence[float] = DUTIES,
    durations: Sequence[float] = DURATIONS_S,
) -> list[dict[str, Any]]:
    """One row a direction, duty and duration: volume of a pulse [mL], the mean of three.

    rig : connected
    operator : who opens the branches and weighs
    say : told about progress
    duties : to try, within the rig's limit
    durations : to try, within the rig's limit [s]
    """
    operator.vent()
    rows = []
    for direction in (FORWARD, REVERSE):
        operator.pumped_ml(direction)
        for duty in duties:
            for duration in durations:
                ran = [_whole_pulse(rig, direction, duty, duration) for _ in range(PULSES)]
                rig.set_neutral(neutral_of(rig.wait(REST_S)))  # vented: nothing has gone into a finger
                volume = operator.pumped_ml(direction) / PULSES
                way = "forward" if direction == FORWARD else "reverse"
                say(f"{way}, duty {duty:g}, {duration:g} s: {volume:.3f} mL a pulse")
                row = {
                    "direction": direction,
                    "duty": ran[0][0],
                    "duration_s": float(np.mean(ran, axis=0)[1]),
                }
                rows.append(row | {"volume_ml": volume, "pulses": PULSES})
    return rows


def fit_flow(rows: Sequence[Mapping[str, Any]]) -> tuple[FlowSettings, float]:
    """The pump's law in one direction by least squares, and the scatter of a pulse about it [mL].

    rows : of one direction, from `measure_pump`; those in the dead zone (below 2 % of the largest) are
        left out
    """
    largest = max((row["volume_ml"] for row in rows), default=0.0)
    used = [row for row in rows if row["volume_ml"] > 0.02 * largest]
    if len(used) < 5:
        raise ConfigError(
            f"{len(used)} pulses that moved fluid are too few; is the tube in the pump head, is it open?"
        )
    duty = np.array([row["duty"] for row in used])
    duration = np.array([row["duration_s"] for row in used])
    volume = np.array([row["volume_ml"] for row in used])
    law = np.array([largest / duration.max(), 0.1, 0.0])  # flow, dead duty, lag
    for _ in range(50):
        flow, dead, lag = law
        lead, time = (duty - dead) / (1 - dead), duration - lag
        slopes = np.stack([lead * time, flow * time * (duty - 1) / (1 - dead) ** 2, -flow * lead], axis=1)
        change, covariance = _least_squares(slopes, volume - flow * lead * time)
        law = law + change
        law[1] = np.clip(law[1], 0.0, 0.9)
        if np.abs(change).max() < 1e-10:
            break
    sigma = np.sqrt(np.diag(covariance))
    lead, time = (duty - law[1]) / (1 - law[1]), duration - law[2]
    scatter = float(np.std(volume - law[0] * lead * time, ddof=3))
    settings = FlowSettings(
        flow_ml_per_s=float(law[0]),
        flow_sigma_ml_per_s=float(sigma[0]),
        dead_duty=float(law[1]),
        dead_duty_sigma=float(sigma[1]),
        lag_s=float(law[2]),
        lag_sigma_s=float(sigma[2]),
    )
    return settings, scatter


def _whole_pulse(rig: Rig, direction: int, duty: float, duration: float) -> tuple[float, float]:
    """Duty and duration [s] of a pulse that has run to its end."""
    sent = rig.pulse(direction, duty, duration)
    rig.wait(sent.duration + REST_S)
    ended = rig.last_pulse
    if ended is None or abs(ended.duration - sent.duration) > 2e-3:
        raise LinkError("a calibration pulse did not run to its end; see `tubefoot rig check`")
    return sent.duty, ended.duration


def _least_squares(design: np.ndarray, data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution and its covariance, the data's variance taken from the residuals."""
    values, *_ = np.linalg.lstsq(design, data, rcond=None)
    freedom = max(1, len(data) - design.shape[1])
    variance = float(np.sum((design @ values - data) ** 2)) / freedom
    return values, variance * np.linalg.inv(design.T @ design)
