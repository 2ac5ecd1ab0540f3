"""What a calibrated pump moves in a pulse, with its uncertainty.

volume = flow (duty - dead) / (1 - dead) (duration - lag), zero where a factor is negative. Uncertainty by
first derivatives, the parameters taken as uncorrelated.
"""

from __future__ import annotations

from math import hypot

from tubefoot.lab.rig import FORWARD
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


def _volume_ml(law: FlowSettings, duty: float, duration: float) -> tuple[float, float]:
    lead, span, time = duty - law.dead_duty, 1.0 - law.dead_duty, duration - law.lag_s
    if lead <= 0 or time <= 0:
        return 0.0, 0.0
    volume = law.flow_ml_per_s * lead / span * time
    by_flow = volume / law.flow_ml_per_s * law.flow_sigma_ml_per_s
    by_dead = law.flow_ml_per_s * time * (lead - span) / span**2 * law.dead_duty_sigma
    by_lag = law.flow_ml_per_s * lead / span * law.lag_sigma_s
    return volume, hypot(by_flow, by_dead, by_lag)
