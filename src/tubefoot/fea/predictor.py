"""Where the path goes next: the polynomial through the last states.

Its degree is the one that would have foretold the last state best: high where the path is smooth, a line
behind a kink such as a beginning contact. From a single state it goes along the tangent there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import State
from tubefoot.fea.step import Step

FloatArray = NDArray[np.float64]
Blend = list[tuple[float, FloatArray]]
"""Shares and unknowns of states."""

HIGHEST_DEGREE = 3


def predict(steps: Sequence[Step], parameter: float) -> State:
    """The state that the polynomial through the last states has at a parameter.

    steps : the last ones, without a jump between them; parameter : where
    """
    if _along_tangent(steps):
        last, along = steps[0].state, steps[0].tangent
        assert along is not None
        share = (parameter - last.parameter) / along.parameter
        return State(
            last.unknowns + share * along.unknowns, last.pressures + share * along.pressures, parameter
        )
    shares, recent = _recent(steps, parameter)
    return State(
        sum((w * s.unknowns for w, s in zip(shares, recent, strict=True)), np.zeros(1)),
        sum((w * s.pressures for w, s in zip(shares, recent, strict=True)), np.zeros(1)),
        parameter,
    )


def blend(steps: Sequence[Step], parameter: float) -> Blend:
    """Shares of states whose strains, added up, are those to expect at a parameter.

    steps : the last ones, without a jump between them; parameter : where
    """
    if _along_tangent(steps):
        return straight(steps[0].state.unknowns, predict(steps, parameter).unknowns)
    shares, recent = _recent(steps, parameter)
    return [(share, state.unknowns) for share, state in zip(shares, recent, strict=True)]


def straight(start: FloatArray, end: FloatArray) -> Blend:
    """Shares of displacements whose strains add up to that of the end to first order in the way there.

    The strain is quadratic along a straight way: start, middle and end tell its slope.

    start, end : (n,) unknowns
    """
    return [(-2.0, start), (4.0, 0.5 * (start + end)), (-1.0, end)]


def _along_tangent(steps: Sequence[Step]) -> bool:
    return len(steps) == 1 and steps[0].tangent is not None and steps[0].tangent.parameter != 0.0


def _recent(steps: Sequence[Step], parameter: float) -> tuple[list[float], list[State]]:
    """The states that foretell best, and their shares."""
    recent = [step.state for step in steps[-best_degree(steps) - 1 :]]
    return weights([state.parameter for state in recent], parameter), recent


def best_degree(steps: Sequence[Step]) -> int:
    """Degree of the polynomial that would have foretold the last state best; few states allow a low one.

    steps : the last ones, without a jump between them
    """
    last, before = steps[-1].state, [step.state for step in steps[:-1]]
    errors = {}
    for degree in range(1, min(HIGHEST_DEGREE, len(before) - 1) + 1):
        recent = before[-degree - 1 :]
        shares = weights([state.parameter for state in recent], last.parameter)
        foretold = sum((w * s.unknowns for w, s in zip(shares, recent, strict=True)), np.zeros(1))
        errors[degree] = float(np.linalg.norm(foretold - last.unknowns))
    return min(errors, key=lambda degree: errors[degree]) if errors else len(before)


def weights(parameters: Sequence[float], at: float) -> list[float]:
    """Lagrange weights of the polynomial through the given parameters.

    parameters : of the states; at : where the polynomial is wanted
    """
    found = []
    for i, p in enumerate(parameters):
        others = [q for j, q in enumerate(parameters) if j != i]
        found.append(float(np.prod([(at - q) / (p - q) for q in others])))
    return found
