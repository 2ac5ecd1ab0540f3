"""What adds to residual and tangent: the one protocol that solids, cavities, contacts and films follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass
class State:
    """One state of a model.

    unknowns : (n,) displacements 3 * point + axis [mm], then the items' own unknowns
    pressures : (n_cavities,) gauge pressures of the fluids [MPa]
    parameter : the path parameter, for a coupled drive the pumped volume of the modelled part [mm^3]
    """

    unknowns: FloatArray
    pressures: FloatArray
    parameter: float

    def copy(self) -> State:
        """An independent copy."""
        return State(self.unknowns.copy(), self.pressures.copy(), self.parameter)


@dataclass
class Evaluation:
    """What the items found at a state.

    energy : stored energy [mJ]; min_jacobian : smallest det F; magnitude : largest cell force [N]
    interior : largest residual of an unknown that was eliminated [N]
    min_gap : smallest gap of a contact [mm], negative for a penetration, -inf where a partner got lost
    """

    energy: float = 0.0
    min_jacobian: float = np.inf
    interior: float = 0.0
    min_gap: float = np.inf
    magnitude: float = 0.0


class Sink(Protocol):
    """Where an item puts its parts.

    stiff : whether matrices are wanted; without, items may leave out what makes them costly
    """

    stiff: bool

    def add(self, item: Item, first: int, matrices: FloatArray, residuals: FloatArray) -> None:
        """Add element matrices (n, m, m) and residuals (n, m) of the elements from number `first` on.

        item : the item they belong to; first : number of the first element
        matrices : derivatives of the residuals [N/mm], ignored when not `stiff`
        residuals : derivatives of the energy [N]
        """


class Item(Protocol):
    """Something that stores energy (or does work) and so adds to residual and tangent."""

    @property
    def pattern(self) -> IntArray:
        """(n_elements, m) numbers of the unknowns that each element couples."""

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the element parts at a state into the sink and what was found into `found`.

        state : where to evaluate; sink : takes the parts; found : energy, smallest Jacobian, magnitude
        """

    def recover(self, step: FloatArray) -> None:
        """Fill in those unknowns of a Newton step that the item eliminated.

        step : (n,) in and out
        """


@runtime_checkable
class Pairing(Item, Protocol):
    """An item whose elements depend on the state: which walls are opposite each other.

    convex : whether its matrices count without their negative eigenvalues, for a structure far from rest
    """

    convex: bool

    def look(self, state: State) -> bool:
        """Choose the elements anew; whether any that matters changed.

        state : where to look
        """


@runtime_checkable
class Choosing(Pairing, Protocol):
    """A pairing whose choice can be taken back, when a step failed in the course of which it was changed."""

    choice: tuple[Any, ...]


@dataclass(frozen=True)
class Boundary:
    """Prescribed displacements: a mask over the unknowns that stay at zero."""

    fixed: NDArray[np.bool_]

    @classmethod
    def of(cls, n_unknowns: int, clamped: dict[int, IntArray] | None = None) -> Boundary:
        """A boundary with some displacement components held at zero.

        n_unknowns : number of all unknowns
        clamped : axis (0, 1, 2) to the point numbers held along it
        """
        fixed = np.zeros(n_unknowns, dtype=bool)
        for axis, points in (clamped or {}).items():
            fixed[3 * np.asarray(points) + axis] = True
        return cls(fixed)


@dataclass
class Timings:
    """Where the time of a solve goes [s]."""

    assembly: float = 0.0
    factorisation: float = 0.0
    substitution: float = 0.0
    analysis: float = 0.0
    pairing: float = 0.0
    factorisations: int = 0
    analyses: int = 0
