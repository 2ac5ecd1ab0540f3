"""A converged step of a model, and when a state counts as converged."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import Evaluation, State

FloatArray = NDArray[np.float64]


class StepFailed(Exception):
    """Newton did not converge to the wanted point; the message says how it ended."""


@dataclass(frozen=True)
class Tolerance:
    """When a state counts as converged; all dimensionless.

    force : residual force over the largest cell force or cavity load
    volume : error of the fluid equations and of the control over the rest volume (or the target's scale)
    iterations : iterations before a step is given up
    min_jacobian : smallest det F that a trial state may have; below it the step is shortened
    min_gap : deepest penetration of a contact that a trial state may have, negative [mm]
    """

    force: float = 1e-7
    volume: float = 1e-8
    iterations: int = 24
    min_jacobian: float = 0.1
    min_gap: float = -0.3

    def admits(self, found: Evaluation) -> bool:
        """Whether a trial state is one from which Newton may go on.

        found : at the trial state
        """
        return bool(found.min_jacobian > self.min_jacobian and found.min_gap > self.min_gap)

    def complaint(self, found: Evaluation) -> str:
        """What is wrong with a state that is not admitted.

        found : at the state
        """
        if found.min_jacobian > self.min_jacobian:
            return f"walls pass through each other: smallest gap {found.min_gap:.2g} mm"
        return f"a cell inverts: smallest det F {found.min_jacobian:.2g}"


@dataclass
class Step:
    """How a converged step went: the state, Newton iterations, energy [mJ], smallest det F and gap [mm].

    unstable : directions in which the energy falls at a given path parameter, by the step's last factors;
        None where they are not counted
    tangent : the path's direction there, per unit of the step's control
    event : what happened between the state before and this one, when it was no smooth step
    """

    state: State
    iterations: int
    energy: float
    min_jacobian: float
    volumes: FloatArray
    residuals: list[float] = field(default_factory=list)
    unstable: int | None = None
    tangent: State | None = None
    min_gap: float = np.inf
    event: str = ""
