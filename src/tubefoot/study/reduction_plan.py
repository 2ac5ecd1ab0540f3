"""Which finite element states identify the reduced model.

They lie on branches: straight ways in the four numbers that `loaded_finger` asks for, each from rest or
from a state of an earlier branch. They leave the pump's own path in every direction that a bench can take:
one chamber filled alone, both together, a tip couple or force at rest, half and far bent. Mirror images
need not be solved. Branches marked `check` are held out of the fit.

Shares are of the pump's reach: the volume at which the right chamber has the wanted pressure (or at which the
path ends before), the couple that bends the resting finger as far as the pump does there, and the force that
makes this couple at half the finger's length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.study.loaded_finger import Asked

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Branch:
    """A straight way to a state.

    name : of the branch; start : (branch, step) that it leaves from, None for rest
    end : shares of pumped volume right and left, couple, force; steps : states on the way
    check : whether its states are held out of the fit
    """

    name: str
    start: tuple[str, int] | None
    end: tuple[float, float, float, float]
    steps: int
    check: bool = False


PLAN = (
    Branch("pump", None, (1.0, -1.0, 0.0, 0.0), 8),
    Branch("right", None, (0.6, 0.0, 0.0, 0.0), 3),
    Branch("left", None, (0.0, -0.6, 0.0, 0.0), 3),
    Branch("both_filled", None, (0.25, 0.25, 0.0, 0.0), 2),
    Branch("both_drained", None, (-0.25, -0.25, 0.0, 0.0), 2),
    Branch("more_right", ("pump", 4), (1.0, -0.5, 0.0, 0.0), 3),
    Branch("more_left", ("pump", 4), (0.5, -1.0, 0.0, 0.0), 3),
    Branch("couple", None, (0.0, 0.0, 0.8, 0.0), 4),
    Branch("force", None, (0.0, 0.0, 0.0, 0.7), 4),
    Branch("couple_filled", ("both_filled", 2), (0.25, 0.25, 0.6, 0.0), 3),
    Branch("couple_drained", ("both_drained", 2), (-0.25, -0.25, 0.5, 0.0), 3),
    Branch("half_couple", ("pump", 4), (0.5, -0.5, 0.5, 0.0), 3),
    Branch("half_back", ("pump", 4), (0.5, -0.5, -1.0, 0.0), 4),
    Branch("half_force", ("pump", 4), (0.5, -0.5, 0.0, -0.7), 3),
    Branch("far_couple", ("pump", 7), (0.875, -0.875, 0.3, 0.0), 2),
    Branch("far_back", ("pump", 7), (0.875, -0.875, -1.0, 0.0), 4),
    Branch("right_back", ("right", 3), (0.6, 0.0, -0.7, 0.0), 3),
    Branch("left_back", ("left", 3), (0.0, -0.6, -0.7, 0.0), 3),
    Branch("check_mixed", None, (0.65, -0.45, 0.0, 0.0), 3, check=True),
    Branch("check_pushed", ("check_mixed", 3), (0.65, -0.45, 0.0, -0.5), 2, check=True),
    Branch("check_pulled", ("check_mixed", 2), (0.30, -0.50, 0.25, 0.25), 2, check=True),
    Branch("check_bench", ("pump", 3), (0.55, -0.70, -0.35, 0.0), 2, check=True),
)


FILLING_PLAN = tuple(branch for branch in PLAN if branch.end[2:] == (0.0, 0.0))
"""The branches without tip loads; on a second, longer finger they tell units from ends."""


@dataclass(frozen=True)
class Reach:
    """What a share of one stands for: pumped volume [mm^3], couple [N mm], force [N], whole finger."""

    volume: float
    couple: float
    force: float

    def asked(self, shares: FloatArray) -> Asked:
        """The state at given shares.

        shares : (4,) of volume right, volume left, couple, force
        """
        right, left, couple, force = (float(share) for share in shares)
        return Asked((right * self.volume, left * self.volume), couple * self.couple, force * self.force)
