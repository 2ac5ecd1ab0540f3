"""How the fluids are driven, and what a step of the path holds fixed.

Each cavity has one equation g(V, p, s) = 0 with the path parameter s:

    volume    V - V_rest + air(p) - rate s = 0     fluid pumped in goes to the cavity and its air column
    pressure  p - rate s = 0

air(p) = V_air p / (p_atm + p) is the volume by which an isothermal air column shrinks (Boyle). One more
equation, the control, says where on the path the step ends: at a value of s, of a pressure, of a volume
change, or of any measure with a gradient. A drive with rates (+1, -1) is the cyclic pump.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import State
from tubefoot.units import ATMOSPHERE_MPA

FloatArray = NDArray[np.float64]


AIR_VACUUM_MPA = -0.999 * ATMOSPHERE_MPA
"""Gauge pressure below which a trapped-air column is treated as torn apart [MPa]."""


def air_uptake(pressure: float, air_volume: float) -> tuple[float, float]:
    """Volume by which a trapped-air column shrinks [mm^3], and its derivative by pressure [mm^3/MPa].

    pressure : gauge [MPa], above absolute vacuum; air_volume : at zero gauge [mm^3]
    """
    if air_volume == 0.0:
        return 0.0, 0.0
    absolute = ATMOSPHERE_MPA + pressure
    return air_volume * pressure / absolute, air_volume * ATMOSPHERE_MPA / absolute**2


@dataclass(frozen=True)
class Drive:
    """What is prescribed for each cavity.

    kind : "volume" or "pressure" for each cavity
    rate : change of the prescribed quantity per path parameter, [mm^3] or [MPa] each
    """

    kind: tuple[Literal["volume", "pressure"], ...]
    rate: tuple[float, ...]

    @classmethod
    def pump(cls) -> Drive:
        """The cyclic pump: what goes into the first cavity comes out of the second."""
        return cls(("volume", "volume"), (1.0, -1.0))

    @classmethod
    def pressures(cls, n_cavities: int) -> Drive:
        """The same gauge pressure in every cavity, the path parameter being that pressure [MPa].

        n_cavities : number of cavities
        """
        return cls(tuple("pressure" for _ in range(n_cavities)), (1.0,) * n_cavities)


@dataclass(frozen=True)
class Plane:
    """A plane across the path, in the space of all unknowns.

    origin : a state in it; normal : its normal, each part in the reciprocal unit of what it measures
    """

    origin: State
    normal: State

    def distance(self, state: State) -> float:
        """How far a state lies beyond the plane, dimensionless and signed.

        state : which
        """
        return float(
            self.normal.unknowns @ (state.unknowns - self.origin.unknowns)
            + self.normal.pressures @ (state.pressures - self.origin.pressures)
            + self.normal.parameter * (state.parameter - self.origin.parameter)
        )


@dataclass(frozen=True)
class Control:
    """Where a step ends: `quantity` = `target`.

    quantity : "parameter", "pressure" or "volume_change" (of cavity `cavity`), "measure", or "plane"
    target : value [mm^3, MPa, the measure's unit; none for the plane]
    cavity : number of the cavity
    measure : displacement vector to (value, gradient), for the quantity "measure"
    plane : what the distance is measured from, for the quantity "plane"
    """

    quantity: Literal["parameter", "pressure", "volume_change", "measure", "plane"]
    target: float
    cavity: int = 0
    measure: Callable[[FloatArray], tuple[float, FloatArray]] | None = None
    plane: Plane | None = None
