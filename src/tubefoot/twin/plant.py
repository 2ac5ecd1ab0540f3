"""What stands behind a simulated board: the contract of a plant on the stepped clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class PumpDrive:
    """What the board's pins did to the pump during a step.

    direction : 1 forward (into the right chamber), -1 reverse, 0 off or braked
    duty : share of the step in which the bridge was enabled, 0 to 1
    """

    direction: int
    duty: float


class Plant(Protocol):
    """Everything physical: pump, fluid, finger, sensors, supply; it knows nothing of the board."""

    def step(self, duration: float, drive: PumpDrive) -> None:
        """Move on.

        duration : [s]
        drive : what the pump got meanwhile
        """

    def sensor_volts(self) -> tuple[float, float, float, float]:
        """Outputs of the pressure sensors at the pins A0 to A3 [V]; 0 where none is connected."""

    def supply_volts(self) -> float:
        """The board's 5 V rail [V]."""
