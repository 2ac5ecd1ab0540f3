"""What the finger would do after each of some pulses: paths of `BenchModel` from the present bench on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import BenchModel
from tubefoot.lab.pump import pumped_volume
from tubefoot.lab.settings import PumpSettings

FloatArray = NDArray[np.float64]

EDGES_S = np.array([0, 0.04, 0.08, 0.13, 0.2, 0.3, 0.4, 0.55, 0.75, 1, 1.3, 1.6, 2, 2.4, 2.8, 3.3, 4, 5])
"""Ends of the steps, from now on [s]."""


@dataclass(frozen=True, slots=True)
class Planned:
    """A run of the pump from now on: direction 1 or -1, duty, duration [s]."""

    direction: int
    duty: float
    duration: float


@dataclass(frozen=True)
class Paths:
    """What comes of each planned run, a row each, at `EDGES_S`.

    bends : bend angle [rad]; pressures : of the branch that is pressed more [MPa]
    """

    bends: FloatArray
    pressures: FloatArray

    def bend_at(self, times: FloatArray) -> FloatArray:
        """Bend angles (rows, times) [rad].

        times : (n,) from now on [s]
        """
        return _between(self.bends, times)


def foresee(
    model: BenchModel,
    present: FloatArray,
    pump: PumpSettings,
    plans: Sequence[Planned],
    horizon: float = float(EDGES_S[-1]),
) -> Paths:
    """The paths of the present bench after each plan.

    model : of the finger; present : (rows, 1) state; pump : as calibrated
    plans : each begins now; horizon : how far to look at least [s]
    """
    flows = np.array([pumped_volume(pump, plan.direction, plan.duty, 1.0)[0] for plan in plans])
    durations = np.array([plan.duration for plan in plans])
    edges = EDGES_S[: int(np.searchsorted(EDGES_S, horizon)) + 1]
    sent = np.diff(flows[:, None] * np.minimum(edges, durations[:, None]), axis=1)
    state = np.repeat(present, len(plans), axis=1)
    bends, pressures = [model.bend(state)], [model.branch_pressures(state).max(axis=0)]
    for duration, volumes in zip(np.diff(edges), sent.T, strict=True):
        state = model.step(state, float(duration), volumes)
        bends.append(model.bend(state))
        pressures.append(model.branch_pressures(state).max(axis=0))
    return Paths(np.array(bends).T, np.array(pressures).T)


def _between(rows: FloatArray, times: FloatArray) -> FloatArray:
    """Rows at the first `EDGES_S`, interpolated at other times."""
    last = rows.shape[1] - 1
    place = np.clip(np.searchsorted(EDGES_S, times, side="right") - 1, 0, last - 1)
    share = np.minimum((times - EDGES_S[place]) / (EDGES_S[place + 1] - EDGES_S[place]), 1.0)
    return np.asarray(rows[:, place] + share * (rows[:, place + 1] - rows[:, place]))
