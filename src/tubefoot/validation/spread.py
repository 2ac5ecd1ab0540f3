"""Confidence by the bootstrap: whole strokes are drawn anew, for states of one stroke are not independent.

A stroke is the loading of one side in one cycle. With fewer than four strokes single states are drawn, which
makes intervals too narrow; the record says which was done.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tubefoot.validation.recording import FloatArray

DRAWS = 1000
LEAST_STROKES = 4
SHARE = 0.95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number and its confidence interval of 95 %, nan where there is none."""

    value: float
    low: float
    high: float

    def scaled(self, factor: float) -> Estimate:
        """The same in another unit.

        factor : to multiply with, above 0
        """
        return Estimate(self.value * factor, self.low * factor, self.high * factor)


Figures = Callable[[np.ndarray], FloatArray]
"""From the numbers of the states in use to some figures, (k,)."""


def with_confidence(figures: Figures, strokes: Sequence[np.ndarray], seed: int = 0) -> list[Estimate]:
    """Each figure with its interval, by percentiles of the bootstrap.

    figures : of the states
    strokes : numbers of the states of each stroke
    seed : of the draws
    """
    everything = np.concatenate(strokes)
    values = figures(everything)
    blocks = list(strokes) if by_strokes(strokes) else [np.array([one]) for one in everything]
    chance = np.random.default_rng(seed)
    drawn = np.full((DRAWS, len(values)), np.nan)
    for number in range(DRAWS):
        chosen = chance.integers(len(blocks), size=len(blocks))
        drawn[number] = figures(np.concatenate([blocks[one] for one in chosen]))
    tail = 50.0 * (1.0 - SHARE)
    with np.errstate(all="ignore"):
        finite = [column[np.isfinite(column)] for column in drawn.T]
    found = []
    for value, column in zip(values, finite, strict=True):
        low, high = (
            np.percentile(column, [tail, 100.0 - tail]) if len(column) > DRAWS / 2 else (np.nan, np.nan)
        )
        found.append(Estimate(float(value), float(low), float(high)))
    return found


def by_strokes(strokes: Sequence[np.ndarray]) -> bool:
    """Whether there are enough strokes to draw whole ones.

    strokes : numbers of the states of each stroke
    """
    return len(strokes) >= LEAST_STROKES
