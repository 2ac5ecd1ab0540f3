"""Simulated hands: set pressures and weigh water on the bench plant, with a reference's own scatter."""

from __future__ import annotations

import numpy as np

from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.units import KPA, ML

GAUGE_SIGMA_KPA = 0.05
SCALE_SIGMA_ML = 0.01


class SimulatedOperator:
    """Does on a plant what a person is asked to do on a bench."""

    def __init__(self, plant: BenchPlant, seed: int = 1):
        """Stand at a bench.

        plant : the bench
        seed : of the readings' scatter
        """
        self._plant = plant
        self._noise = np.random.default_rng(seed)
        self._weighed = 0.0

    def vent(self) -> None:
        """Open both branches."""
        self._plant.vent()

    def apply_pressure(self, branch: str, pressure_kpa: float) -> float:
        """What the reference gauge shows [kPa].

        branch : which
        pressure_kpa : what is set
        """
        self._plant.hold(branch, pressure_kpa * KPA)
        return pressure_kpa + GAUGE_SIGMA_KPA * float(self._noise.standard_normal())

    def pumped_ml(self, direction: int) -> float:
        """What the scale shows [mL].

        direction : 1 forward, -1 reverse
        """
        moved = direction * (self._plant.dispensed - self._weighed) / ML
        self._weighed = self._plant.dispensed
        return moved + SCALE_SIGMA_ML * float(self._noise.standard_normal())
