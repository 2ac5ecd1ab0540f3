"""A pulse within the limits, and what a calibrated pump moves in it, with its uncertainty.

volume = flow (duty - dead) / (1 - dead) (duration - lag), zero where a factor is negative. Uncertainty by
first derivatives, the parameters taken as uncorrelated.
"""

from __future__ import annotations

from math import hypot

from tubefoot.errors import ConfigError
from tubefoot.lab.rig import FORWARD, RigLimits, SentPulse
from tubefoot.lab.settings import FlowSettings, PumpSettings
from tubefoot.units import ML


def pumped_volume(pump: PumpSettings, direction: int, duty: float, duration: float) -> tuple[float, float]:
    """Signed volume of a pulse and its standard uncertainty [mm^3].

    pump : the calibrated pump
    direction : 1 forward, -1 reverse
    duty : 0 to 1
    duration : [s]
    """
    law = pump.forward if direction == FORWARD else pump.reverse
    volume, sigma = _volume_ml(law, duty, duration)
    return direction * volume * ML, sigma * ML


def plan_pulse(
    limits: RigLimits, pump: PumpSettings, direction: int, duty: float, duration: float
) -> SentPulse:
    """A pulse cut to the limits and put on the board's grid, its time still 0.

    limits : of the rig
    pump : the calibrated pump
    direction : 1 forward, -1 reverse
    duty : above 0, to 1
    duration : at least 0.001 [s]

    Raises ConfigError when the pulse is none at all.
    """
    if direction not in (1, -1) or not 0 < duty <= 1 or not 0.001 <= duration < float("inf"):
        raise ConfigError(
            f"pulse of direction {direction}, duty {duty:g}, {duration:g} s: direction is 1 or -1, "
            "duty above 0 and at most 1, duration at least 0.001 s"
        )
    most = max(1, int(limits.duty * 255 + 1e-9))
    counts = min(most, max(1, round(duty * 255)))
    milliseconds = round(min(duration, limits.pulse_duration) * 1e3)
    clipped = duty > limits.duty or duration > limits.pulse_duration
    volume, sigma = pumped_volume(pump, direction, counts / 255, milliseconds * 1e-3)
    return SentPulse(0.0, direction, counts / 255, milliseconds * 1e-3, volume, sigma, clipped)


def _volume_ml(law: FlowSettings, duty: float, duration: float) -> tuple[float, float]:
    lead, span, time = duty - law.dead_duty, 1.0 - law.dead_duty, duration - law.lag_s
    if lead <= 0 or time <= 0:
        return 0.0, 0.0
    volume = law.flow_ml_per_s * lead / span * time
    by_flow = volume / law.flow_ml_per_s * law.flow_sigma_ml_per_s
    by_dead = law.flow_ml_per_s * time * (lead - span) / span**2 * law.dead_duty_sigma
    by_lag = law.flow_ml_per_s * lead / span * law.lag_sigma_s
    return volume, hypot(by_flow, by_dead, by_lag)
