"""A structure on its way to rest: Newton's method held back by a drag that fades as it falls.

With m_k the volume of node k, the gradient flow c m_k du_k/dt = -dE/du_k, fluids and control kept, takes one
linearly implicit step of pseudo-time an iteration: the tangent gets c m_k on its diagonal. The density c
grows where a step led too far, and falls otherwise, so that the last iterations are Newton's own
(pseudo-transient continuation, Kelley and Keyes, SIAM J. Numer. Anal. 35, 1998).
Where Newton's method wanders, beside a buckling wall or where contacts begin, this goes downhill.

Contacts that slide over curved walls have a stiffness with large negative eigenvalues. Where the tangent is
not stable with them they count without (the nearest matrix that has none), which costs a fall nothing, while
a drag that outweighs them would hold the whole structure still.

The drag is no viscosity of the material: states on the way mean nothing, where they end is what counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.bordering import Borders
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.newton import admitted, advanced, converged
from tubefoot.fea.stability import nodal_volumes
from tubefoot.fea.step import Step, StepFailed

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST = 60
"""Iterations after which there is no rest."""
LONGEST = 0.3
"""Largest displacement in one iteration over the size of a cell (the cube root of the median volume)."""
CONVEX = 3e5
"""Error over the tolerance above which contacts whose stiffness was made convex once stay so."""
DEEPER = 0.05
"""By how much a penetration may grow in one iteration [mm]: deep ones throw walls apart in the next."""
TOO_FAR = 0.5
"""Force against a step where it ends, over that along it where it begins, from which on it is cut."""
SHORTEST, CUTS = 0.2, 3
"""Least factor of a cut, and how often a step is cut."""
HARDER, EASIER = 4.0, 0.1
"""Factors on the drag after a step that led too far, and after another one."""
NO_DRAG = 1e-6
"""Density over the first one below which there is none."""
LEAST = 0.01
"""Density over the first one from which it is raised after a step that led nowhere."""
AFTER_REFUSAL, REFUSALS = 8.0, 5
"""Factor on the density after a step that led nowhere, and how often in a row."""


@dataclass
class _Drag:
    """The drag as it goes: its density [N/mm per mm^3] and that of the beginning.

    length : of the last step over the longest one, before it was cut; too_far : whether it had led too far
    convex : whether contacts count without what makes them unstable
    refused : steps in a row that led nowhere
    """

    density: float
    first: float
    length: float = 1.0
    too_far: bool = False
    convex: bool = False
    refused: int = 0

    def adapt(self, error: float) -> None:
        """Choose the next density by how the last step went.

        error : at the new state
        """
        if self.too_far:
            self.density *= HARDER
        elif self.length <= 1.0:
            self.density *= EASIER
        if self.density < NO_DRAG * self.first:
            self.density = 0.0
        self.convex = self.convex and error > CONVEX

    def raise_density(self) -> None:
        """Hold the structure much more."""
        self.density = AFTER_REFUSAL * max(self.density, LEAST * self.first)

    def refuse(self) -> bool:
        """Hold the structure much more after a step that led nowhere; False after too many."""
        self.raise_density()
        self.too_far, self.length = False, np.inf
        self.refused += 1
        return self.refused <= REFUSALS


@dataclass(frozen=True)
class _Way:
    """A step, and what tells how long it should be.

    step : the change of the state; free : numbers of the free unknowns
    press : forces of the pressures' changes on them; downhill : force along the step where it begins
    """

    step: State
    free: IntArray
    press: FloatArray
    downhill: float

    def part(self, share: float) -> State:
        """A share of the step.

        share : of its length
        """
        step = self.step
        return State(share * step.unknowns, share * step.pressures, share * step.parameter)

    def gone(self, moved: FloatArray) -> float:
        """What share of the step a displacement is.

        moved : (n_unknowns,)
        """
        along = self.step.unknowns[self.free]
        return float(along @ moved[self.free]) / float(along @ along)

    def slope(self, residual: FloatArray, share: float) -> float:
        """Force along the step over that at its beginning, with the new pressures: -1 there, 0 at best.

        residual : (n_unknowns,) at a share of the step
        """
        left = residual[self.free] - (1.0 - share) * self.press
        return float(self.step.unknowns[self.free] @ left) / abs(self.downhill)


class PseudoTime:
    """The gradient flow of a model."""

    def __init__(self, model: Model):
        """Prepare the masses.

        model : what moves
        """
        self.model = model
        volumes = nodal_volumes(model)
        self._size = 3 * len(volumes)
        mass = np.zeros(model.n_unknowns)
        mass[: self._size] = np.repeat(volumes, 3)
        self._mass = mass[model.system.free]
        cells = np.concatenate([solid.weights.sum(axis=1) for solid in model.solids])
        self._longest = LONGEST * float(np.cbrt(np.median(cells)))

    def softness(self, last: Step) -> float:
        """A density of the size of the structure's own stiffness, 2 E / sum m u^2 [N/mm per mm^3].

        last : a deformed state
        """
        moved = np.zeros(self.model.n_unknowns)
        moved[: self._size] = last.state.unknowns[: self._size]
        return 2.0 * abs(last.energy) / max(float(self._mass @ moved[self.model.system.free] ** 2), 1e-12)

    def fall(self, start: State, control: Control, density: float) -> Step:
        """The equilibrium in which the structure comes to rest, its unstable directions counted there.

        start : from where; control : which quantity is kept at which value
        density : of the drag at first [N/mm per mm^3]

        Raises StepFailed, contacts as they were, when it does not come to rest.
        """
        if density <= 0.0:
            raise StepFailed("no drag holds a structure that is not deformed yet")
        choices = self.model.choices()
        try:
            return self._fall(start.copy(), control, _Drag(density, density))
        except StepFailed:
            self.model.choose(choices)
            raise

    def _fall(self, state: State, control: Control, drag: _Drag) -> Step:
        model = self.model
        found = admitted(model, state)
        history: list[float] = []
        for iteration in range(MOST):
            borders = model.borders(state, control)
            error = model.error(state, found, borders)
            history.append(error)
            if error < 1.0 and not model.pair(state):
                # Of the last factors the drag was part.
                found = model.evaluate(state)
                model.factorise(model.borders(state, Control("parameter", state.parameter)))
                return converged(model, state, found, iteration, history, model.direction())
            drag.adapt(error)
            try:
                state, found = self._moved(state, found.min_gap, borders, drag)
                drag.refused = 0
            except StepFailed:
                if not drag.refuse():
                    raise
                found = model.evaluate(state, stiff=False)
        raise StepFailed(f"no rest after {MOST} steps of pseudo-time, residual {min(history):.1e} at best")

    def _moved(self, state: State, gap: float, borders: Borders, drag: _Drag) -> tuple[State, Evaluation]:
        """The state after one step with the drag, cut where it is long or leads far into a wall."""
        model = self.model
        self._hold(state, borders, drag)
        way = self._way(state, borders)
        drag.length = float(np.abs(way.step.unknowns[: self._size]).max()) / self._longest
        exact = model.tolerance
        model.tolerance = replace(exact, min_gap=max(exact.min_gap, min(gap, 0.0) - DEEPER))
        try:
            return self._gone(state, way, drag)
        finally:
            model.tolerance = exact

    def _way(self, state: State, borders: Borders) -> _Way:
        """The step by the last factors from a state that was evaluated last."""
        model, free = self.model, self.model.system.free
        force = model.system.residual[free].copy()
        step, _ = model.newton_step(state, borders)
        press = borders.columns[free] @ step.pressures
        return _Way(step, free, press, float(step.unknowns[free] @ (press - force)))

    def _gone(self, state: State, way: _Way, drag: _Drag) -> tuple[State, Evaluation]:
        """The state so far along a step that little force is left along it."""
        model, choices = self.model, self.model.choices()
        share = 1.0 / max(drag.length, 1.0)
        drag.too_far = False
        for _ in range(CUTS):
            moved, found = advanced(model, state, way.part(share))
            gone = way.gone(moved.unknowns - state.unknowns)
            slope = way.slope(model.system.residual, gone)
            if slope < TOO_FAR:
                return moved, found
            drag.too_far = True
            model.choose(choices)
            share = gone * max(1.0 / (1.0 + slope), SHORTEST)
        return advanced(model, state, way.part(share))

    def _hold(self, state: State, borders: Borders, drag: _Drag) -> None:
        """Factorise with drag enough that the structure is stable under it: else it would be led uphill."""
        model = self.model
        bare = self._stiffness(state, drag.convex)
        for _ in range(REFUSALS + 1):
            model.system.data[model.system.indptr[:-1]] = bare + drag.density * self._mass
            model.factorise(borders)
            if not model.unstable:
                return
            if drag.convex or not model.pairings:
                drag.raise_density()
            else:
                drag.convex = True
                bare = self._stiffness(state, drag.convex)
        raise StepFailed(f"{model.unstable} directions stay unstable under any drag")

    def _stiffness(self, state: State, convex: bool) -> FloatArray:
        """Assemble the tangent; its diagonal."""
        model = self.model
        for pairing in model.pairings:
            pairing.convex = convex
        model.evaluate(state)
        for pairing in model.pairings:
            pairing.convex = False
        return model.system.data[model.system.indptr[:-1]]
