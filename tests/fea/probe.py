"""Items seen from outside: their element parts summed to dense arrays, interior unknowns in equilibrium."""

from __future__ import annotations

import numpy as np

from tubefoot.fea.items import Evaluation, State


class DenseSink:
    """Sums what an item adds to a dense matrix and residual over all unknowns."""

    stiff = True

    def __init__(self, size):
        self.matrix, self.residual = np.zeros((size, size)), np.zeros(size)

    def add(self, item, first, matrices, residuals):
        for offset, (matrix, residual) in enumerate(zip(matrices, residuals, strict=True)):
            numbers = item.pattern[first + offset]
            self.matrix[np.ix_(numbers, numbers)] += matrix
            np.add.at(self.residual, numbers, residual)


def settled(solid, unknowns):
    """Unknowns with the eliminated ones in equilibrium, the sink and what was found there.

    Uses the item's protocol only: `recover` with no change of the kept unknowns is Newton's method inside
    the cells.
    """
    values = unknowns.copy()
    for _ in range(20):
        sink, found = DenseSink(len(values)), Evaluation()
        solid.assemble(State(values, np.zeros(0), 0.0), sink, found)
        step = np.zeros(len(values))
        solid.recover(step)
        values = values + step
        if np.abs(step).max() < 1e-15:
            break
    assert np.abs(step).max() < 1e-12, "interior unknowns did not settle"
    return values, sink, found
