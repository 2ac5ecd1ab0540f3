"""Steps along the path by its length, which go around folds where the path parameter turns back.

The length of a step is that of the displacements and of the parameter, each over its size in the chord from
which the arc begins. A step ends on the plane across the last chord at a given distance (pseudo-arclength,
Riks 1979; Keller 1977).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.drive import Control, Plane
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.step import Step, StepFailed

FloatArray = NDArray[np.float64]

SHORTEST = 1 / 256
"""Shortest step over the first chord before the arc is given up."""
LONGEST = 4.0
"""Longest step over the first chord."""
EASY = 6
"""Iterations up to which a step was easy enough for a longer one to follow."""


class Arc:
    """The way on from two states of a path."""

    def __init__(self, model: Model, before: State, last: State):
        """Take the chord between two states as the measure of length.

        model : what is solved; before, last : two states in a row, at different parameters
        """
        self.model, self.before, self.last = model, before, last
        free = model.system.free
        self._displacements = free[free < model.mesh.points.size]
        moved = (self.last.unknowns - self.before.unknowns)[self._displacements]
        pumped = self.last.parameter - self.before.parameter
        self._weights = 0.5 / max(float(moved @ moved), 1e-12), 0.5 / pumped**2
        self.stride = 0.25

    def steps(self, most: int) -> Iterator[Step]:
        """Converged steps along the arc.

        most : how many at most

        Raises StepFailed when no step is short enough.
        """
        for _ in range(most):
            step = self._step()
            self.before, self.last = self.last, step.state
            if step.iterations <= EASY:
                self.stride = min(1.5 * self.stride, LONGEST)
            yield step

    def _step(self) -> Step:
        while True:
            plane, towards = self._plane()
            guess = State(
                self.last.unknowns + self.stride * towards.unknowns,
                self.last.pressures + self.stride * towards.pressures,
                self.last.parameter + self.stride * towards.parameter,
            )
            try:
                return self.model.solve(guess, Control("plane", self.stride, plane=plane))
            except StepFailed:
                self.stride *= 0.5
                if self.stride < SHORTEST:
                    raise

    def _plane(self) -> tuple[Plane, State]:
        """The plane across the last chord, and the chord of unit length."""
        chord = State(
            self.last.unknowns - self.before.unknowns,
            self.last.pressures - self.before.pressures,
            self.last.parameter - self.before.parameter,
        )
        of_displacement, of_parameter = self._weights
        moved = chord.unknowns[self._displacements]
        length = float(np.sqrt(of_displacement * moved @ moved + of_parameter * chord.parameter**2))
        normal = State(
            np.zeros_like(chord.unknowns),
            np.zeros_like(chord.pressures),
            of_parameter * chord.parameter / length,
        )
        normal.unknowns[self._displacements] = of_displacement * moved / length
        unit = State(chord.unknowns / length, chord.pressures / length, chord.parameter / length)
        return Plane(self.last, normal), unit
