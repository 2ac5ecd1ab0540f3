"""The three calibrations of a bench: readings in, corrected rig settings out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tubefoot.lab import calibration
from tubefoot.lab.operator import Operator
from tubefoot.lab.rig import Rig
from tubefoot.lab.settings import BRANCHES, PumpSettings, RigSettings

Rows = list[dict[str, Any]]
Say = Callable[[str], None]


def pressure(rig: Rig, operator: Operator, settings: RigSettings, say: Say) -> tuple[Rows, RigSettings]:
    """Readings and rig settings with every sensor's zero and span.

    rig : connected, the pump standing
    operator : who stands at the bench
    settings : to correct
    say : told about progress
    """
    rows = calibration.measure_pressures(rig, operator, say)
    sensors = {}
    for branch in BRANCHES[: settings.board.channels]:
        own = [row for row in rows if row["branch"] == branch]
        sensors[branch], worst = calibration.fit_sensor(own, settings.sensor(branch))
        sensor = sensors[branch]
        say(
            f"{branch}: zero {sensor.zero_fraction:.4f} +- {sensor.zero_sigma:.4f} of the supply, span "
            f"{sensor.span_kpa:.1f} +- {sensor.span_sigma_kpa:.1f} kPa, worst residual {worst:.2f} kPa"
        )
    return rows, settings.model_copy(update={"sensors": sensors})


def supply(rig: Rig, operator: Operator, settings: RigSettings, say: Say) -> tuple[Rows, RigSettings]:
    """Readings and rig settings with what the sagging supply does to every sensor.

    rig : connected, the pump standing
    operator : who stands at the bench
    settings : to correct
    say : told about progress
    """
    rows = calibration.measure_supply(rig, operator, say)
    sensors = {}
    for branch in BRANCHES[: settings.board.channels]:
        sensors[branch], sigma = calibration.fit_sag(rows, branch, settings.sensor(branch))
        say(f"{branch}: {sensors[branch].sag_kpa_per_v:+.2f} +- {sigma:.2f} kPa a volt of supply")
    return rows, settings.model_copy(update={"sensors": sensors})


def pump(rig: Rig, operator: Operator, settings: RigSettings, say: Say) -> tuple[Rows, RigSettings]:
    """Readings and rig settings with the pump's law in both directions.

    rig : connected, the pump standing
    operator : who stands at the bench
    settings : to correct
    say : told about progress
    """
    limits = settings.limits
    duties = sorted({min(duty, limits.duty_max) for duty in calibration.DUTIES})
    durations = sorted({min(duration, limits.pulse_max_s) for duration in calibration.DURATIONS_S})
    rows = calibration.measure_pump(rig, operator, say, duties, durations)
    flows = {}
    for name, direction in (("forward", 1), ("reverse", -1)):
        own = [row for row in rows if row["direction"] == direction]
        flows[name], scatter = calibration.fit_flow(own)
        flow = flows[name]
        say(
            f"{name}: {flow.flow_ml_per_s:.3f} +- {flow.flow_sigma_ml_per_s:.3f} mL/s at full duty, "
            f"dead below {flow.dead_duty:.3f} +- {flow.dead_duty_sigma:.3f}, lag {flow.lag_s * 1e3:.1f} +- "
            f"{flow.lag_sigma_s * 1e3:.1f} ms, scatter {scatter:.4f} mL a pulse"
        )
    return rows, settings.model_copy(update={"pump": PumpSettings(**flows)})


CALIBRATIONS = {"pressure": pressure, "supply": supply, "pump": pump}
