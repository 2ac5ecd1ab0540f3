"""How a finger's chambers take up fluid: the contract that the hydraulics uses, and a linear finger.

`LinearFinger` has closed forms, for tests and for work on the hydraulics alone; the reduced model is in
`still_finger.py`. Angles in rad, pressures in MPa, volumes in mm^3.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tubefoot.units import DEG, KPA, ML

Volumes = tuple[float, float, float, float, float]
"""Volume changes right and left; their derivatives right by right, right by left and back, left by left."""


class FingerResponse(Protocol):
    """A finger between two chambers."""

    @property
    def bend(self) -> float:
        """Direction of the tip [rad]."""

    @property
    def unit_angles(self) -> NDArray[np.float64]:
        """Angle of each unit, from the base [rad]."""

    def volumes(self, right: float, left: float, duration: float) -> Volumes:
        """Volume changes of the chambers at the end of a step, and their derivatives by the pressures.

        right, left : pressures at the end of the step [MPa]
        duration : [s]
        """

    def advance(self, right: float, left: float, duration: float) -> None:
        """Accept a step.

        right, left : pressures at its end [MPa]
        duration : [s]
        """

    def scale_stiffness(self, factor: float) -> None:
        """Make the walls stiffer or softer than they are at rest, for warm and cold days.

        factor : on every modulus
        """


class LinearFinger:
    """A linear finger: V = +-A phi + c p, A (p_R - p_L) = K phi + sum h, memory h' = K g phi' - h / tau.

    One energy gives both laws. In equilibrium phi = (A / K) (p_R - p_L), and the partition's compliance is
    A^2 / K.
    """

    def __init__(
        self,
        compliance: float = 2.0 * ML / (100 * KPA),
        partition: float = 1.5 * ML / (100 * KPA),
        gain: float = 0.85 * DEG / KPA,
        memory: tuple[tuple[float, float], ...] = (),
        units: int = 12,
    ):
        """Build it.

        compliance : c, of each chamber at a given angle [mm^3/MPa]
        partition : A^2 / K, volume moved by a pressure difference in equilibrium [mm^3/MPa]
        gain : angle in equilibrium over pressure difference [rad/MPa]
        memory : shares g and times tau of the wall's relaxation [-, s]
        units : that the angle is spread over
        """
        self.angle = 0.0
        self._compliance, self._arm, self._bending = compliance, partition / gain, partition / gain**2
        self._memory = memory
        self._held_back = [0.0] * len(memory)
        self._units = units
        self._factor = 1.0

    @property
    def bend(self) -> float:
        """Direction of the tip [rad]."""
        return self.angle

    @property
    def unit_angles(self) -> NDArray[np.float64]:
        """Angle of each unit, all alike [rad]."""
        return np.full(self._units, self.angle / self._units)

    def volumes(self, right: float, left: float, duration: float) -> Volumes:
        """Volume changes and their derivatives.

        right, left : pressures [MPa]
        duration : [s]
        """
        angle, stiffness = self._balanced(right, left, duration)
        cross = self._arm**2 / stiffness
        own = self._compliance / self._factor
        turned = self._arm * angle
        return turned + own * right, own * left - turned, own + cross, -cross, own + cross

    def advance(self, right: float, left: float, duration: float) -> None:
        """Accept a step.

        right, left : pressures [MPa]
        duration : [s]
        """
        angle, _ = self._balanced(right, left, duration)
        turned = self._bending * self._factor * (angle - self.angle)
        self._held_back = [
            (held + share * turned) / (1.0 + duration / tau)
            for held, (share, tau) in zip(self._held_back, self._memory, strict=True)
        ]
        self.angle = angle

    def scale_stiffness(self, factor: float) -> None:
        """Scale bending and ballooning.

        factor : on every modulus
        """
        self._factor = factor

    def _balanced(self, right: float, left: float, duration: float) -> tuple[float, float]:
        """Angle at the end of the step, and the stiffness against it."""
        bending = self._bending * self._factor
        stiffness, remembered = bending, 0.0
        for held, (share, tau) in zip(self._held_back, self._memory, strict=True):
            decay = 1.0 / (1.0 + duration / tau)
            stiffness += bending * share * decay
            remembered += (held - bending * share * self.angle) * decay
        return (self._arm * (right - left) - remembered) / stiffness, stiffness
