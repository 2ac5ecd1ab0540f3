"""How far the path parameter goes in one step: longer after easy steps, shorter after failed ones.

The goal alone would set it, by the tangent at rest; a soft finger's goal looks very far away from there, so
no step pumps more than a share of a chamber.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.step import Step

FIRST_SHARE = 0.1
"""Share of a chamber, trapped air included, that the first step pumps at most."""
MOST_SHARE = 0.2
"""The same of a later step."""
MOST_LEFT = 0.5
"""Share of what a chamber still holds that a step drains at most: walls that close find their rest slowly."""


@dataclass(frozen=True)
class StepControl:
    """How the path is stepped.

    states : how many states the way to the goal is cut into, about
    growth : factor on the step after an easy one; shrink : after a failed one
    smallest : shortest step over the first one before another way on is looked for
    most : states after which the path is given up
    """

    states: int = 8
    growth: float = 1.5
    shrink: float = 0.5
    smallest: float = 1 / 32
    most: int = 400


class Stride:
    """The present step length of a path, signed.

    value : change of the path parameter; first : size of the first one; shortest : below it no step is tried
    """

    def __init__(self, model: Model, goal: Control, stepping: StepControl, last: Step):
        """Choose the first one.

        model : what is solved; goal : where the path goes; stepping : step control
        last : where the path begins

        Raises ConvergenceError when the drive does not move the goal's quantity.
        """
        self._model, self._stepping = model, stepping
        slope = model.slope_at_rest(goal)
        if slope == 0.0:
            raise ConvergenceError(f"the drive does not move the goal's quantity ({goal.quantity})")
        share = goal.target / slope / stepping.states
        self._longest = abs(share)
        self.value = self._cut(share, FIRST_SHARE, last)
        self.first = abs(self.value)
        self.shortest = self.first * stepping.smallest

    @property
    def forward(self) -> float:
        """1 or -1: which way the path parameter goes."""
        return float(np.sign(self.value))

    def over_first(self) -> float:
        """Its size over the first one."""
        return abs(self.value) / self.first

    def lengthen(self, last: Step) -> None:
        """Make it longer.

        last : the last state of the path
        """
        longer = min(self._longest, abs(self.value) * self._stepping.growth)
        self.value = self._cut(self.forward * longer, MOST_SHARE, last)

    def shorten(self) -> bool:
        """Make it shorter; whether it is still long enough to be tried."""
        self.value *= self._stepping.shrink
        return abs(self.value) >= self.shortest

    def restart(self, share: float) -> None:
        """Begin again.

        share : of the first one
        """
        self.value = self.forward * share * self.first

    def _cut(self, stride: float, share: float, last: Step) -> float:
        """A stride, cut to a share of each chamber that it drains (at rest) or fills (by now)."""
        drive = self._model.drive
        for k, (cavity, kind, rate) in enumerate(
            zip(self._model.cavities, drive.kind, drive.rate, strict=True)
        ):
            if kind == "volume" and rate:
                if rate * stride > 0.0:
                    most = share * (max(cavity.rest_volume, last.volumes[k]) + cavity.air_volume)
                else:
                    left = MOST_LEFT * (last.volumes[k] + cavity.air_volume)
                    most = min(share * (cavity.rest_volume + cavity.air_volume), left)
                most /= abs(rate)
                stride = float(np.clip(stride, -most, most))
        return stride
