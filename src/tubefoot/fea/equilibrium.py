"""A model: residual, tangent and linear step of a mesh with its items, fluids and boundary.

Cavity pressures and the path parameter follow from a small dense system (`bordering`). How many of the
tangent's eigenvalues are negative comes with the factors. The iterations are `newton`'s and, where a
structure has to come to rest first, `pseudo_time`'s.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.approach import approach
from tubefoot.fea.assembly import SparseSystem
from tubefoot.fea.bordering import Borders
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import AIR_VACUUM_MPA, Control, Drive
from tubefoot.fea.factorise import SingularMatrixError, factoriser
from tubefoot.fea.items import Boundary, Choosing, Evaluation, Item, Pairing, State, Timings
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.newton import converge
from tubefoot.fea.predictor import Blend
from tubefoot.fea.solid import Solid
from tubefoot.fea.step import Step, StepFailed, Tolerance

FloatArray = NDArray[np.float64]

Choices = list[tuple[Choosing, tuple[Any, ...]]]


class Model:
    """A mesh with its items, cavities and boundary, ready to be solved."""

    def __init__(
        self,
        mesh: Mesh,
        solids: Sequence[Solid],
        clamped: dict[int, NDArray[np.int64]],
        cavities: Sequence[Cavity] = (),
        drive: Drive | None = None,
        others: Sequence[Item] = (),
        tolerance: Tolerance | None = None,
    ):
        """Number the unknowns and find the sparse pattern.

        mesh : the mesh; solids : its solid blocks; clamped : axis to the points held along it
        cavities : the fluids; drive : what is prescribed for each; others : further items
        tolerance : when a state counts as converged
        """
        self.mesh = mesh
        self.solids, self.cavities = list(solids), list(cavities)
        self.items: list[Item] = [*solids, *cavities, *others]
        self.drive = drive or Drive.pressures(len(self.cavities))
        self.tolerance = tolerance or Tolerance()
        self.pairings = [item for item in self.items if isinstance(item, Pairing)]
        self.n_unknowns = mesh.points.size + sum(solid.n_own for solid in solids)
        self._fixed = Boundary.of(self.n_unknowns, clamped).fixed
        for solid in solids:
            self._fixed[solid.eliminated] = True
        self.timings = Timings()
        self._pivots_at_rest: int | None = None
        self._number()
        self.rest_volumes = np.array([cavity.rest_volume for cavity in self.cavities])
        self._control_scale = float(self.rest_volumes.max()) if len(self.cavities) else 1.0

    def _number(self) -> None:
        """Find the sparse pattern of all items and prepare its factorisation."""
        started = time.perf_counter()
        self._numbered = [pairing.pattern for pairing in self.pairings]
        self.system = SparseSystem(self.n_unknowns, self.items, self._fixed)
        self.solver = factoriser(self.system.indptr, self.system.indices)
        self.factorised = False
        self.unstable: int | None = None
        self.timings.analysis += time.perf_counter() - started
        self.timings.analyses += 1

    def pair(self, state: State) -> bool:
        """Let contacts choose their partners; whether any choice that matters changed.

        state : where they look
        """
        started = time.perf_counter()
        changed = [pairing.look(state) for pairing in self.pairings]
        self.timings.pairing += time.perf_counter() - started
        return any(changed)

    def choices(self) -> Choices:
        """The partners that contacts have now, for `choose`."""
        return [(item, item.choice) for item in self.pairings if isinstance(item, Choosing)]

    def choose(self, choices: Choices) -> None:
        """Give contacts partners back that they had.

        choices : of `choices`
        """
        for item, choice in choices:
            item.choice = choice

    def rest(self) -> State:
        """The undeformed state."""
        return State(np.zeros(self.n_unknowns), np.zeros(len(self.cavities)), 0.0)

    def evaluate(self, state: State, stiff: bool = True) -> Evaluation:
        """Assemble residual and tangent at a state; the cavities keep their volumes and gradients.

        Elements that contacts have taken since are numbered where a tangent is wanted: a residual alone
        needs no pattern, and many a trial state is thrown away.

        state : where to evaluate; stiff : whether the tangent is wanted
        """
        if stiff and any(
            pairing.pattern is not known for pairing, known in zip(self.pairings, self._numbered, strict=True)
        ):
            self._number()
        started = time.perf_counter()
        found = self.system.evaluate(self.items, state, stiff)
        self.timings.assembly += time.perf_counter() - started
        return found

    def solve(
        self, guess: State, control: Control, blend: Blend | None = None, last: State | None = None
    ) -> Step:
        """The converged step that the control asks for.

        Where Newton's method does not get there from the guess, an `approach` brings it near first.

        guess : where Newton starts; control : which quantity ends at which value
        blend, last : what the approach knows of the states before

        Raises StepFailed when it does not converge, inverts, or leaves the range of the physics; contacts
        then have the partners that they had before.
        """
        choices = self.choices()
        try:
            return converge(self, guess, control)
        except StepFailed as failure:
            self.choose(choices)
            try:
                return converge(self, approach(self, guess, control, blend, last), control)
            except StepFailed:
                self.choose(choices)
            raise failure

    def slope_at_rest(self, goal: Control) -> float:
        """Derivative of a control's quantity by the path parameter, at rest.

        goal : the control
        """
        rest = self.rest()
        self.evaluate(rest)
        borders = self.borders(rest, Control("parameter", 0.0))
        self.factorise(borders)
        self._pivots_at_rest = self.solver.negative_pivots
        _, along = self.newton_step(rest, borders)
        n, wanted = len(self.cavities), self.borders(rest, goal)
        slope = wanted.small[n, :n] @ along.pressures + wanted.small[n, n]
        if wanted.control_row is not None:
            slope += wanted.control_row @ along.unknowns
        return float(slope)

    def linearise(self, state: State) -> int | None:
        """Factorise the tangent at a state, the path parameter fixed; how many directions are unstable.

        state : where, with its contacts as they are
        """
        self.evaluate(state)
        self.factorise(self.borders(state, Control("parameter", state.parameter)))
        return self.unstable

    def response(self, forces: FloatArray) -> State:
        """Small change by forces at a fixed path parameter, where the model was linearised.

        forces : (n_unknowns,) on the displacements [N]
        """
        relaxed = self.solver.solve(forces[self.system.free][:, None])[:, 0]
        return self._bordered_answer(relaxed, np.zeros(len(self.cavities) + 1))

    def tears_air(self, state: State) -> bool:
        """Whether a fluid with an air column has a pressure at which Boyle's law ends.

        state : whose pressures
        """
        return any(
            cavity.air_volume > 0 and pressure <= AIR_VACUUM_MPA
            for cavity, pressure in zip(self.cavities, state.pressures, strict=True)
        )

    def borders(self, state: State, control: Control) -> Borders:
        """Equations of the fluids and of a control at a state that has just been evaluated.

        state : where; control : the last equation
        """
        return Borders.of(state, self.cavities, self.drive, control, self._control_scale)

    def error(self, state: State, found: Evaluation, borders: Borders) -> float:
        """Largest residual over its tolerance; below one means converged.

        state : evaluated last; found : what was found there; borders : there
        """
        free = self.system.free
        residual = self.system.residual[free]
        loads = np.abs(borders.columns[free]) @ np.abs(state.pressures) if len(state.pressures) else 0.0
        force_scale = max(found.magnitude, float(np.max(loads, initial=0.0)), 1e-6)
        largest = max(float(np.abs(residual).max(initial=0.0)), found.interior)
        force = largest / force_scale / self.tolerance.force
        n = len(self.cavities)
        errors = [force, abs(borders.right[n]) / borders.scale / self.tolerance.volume]
        for i in range(n):
            scale = self._control_scale if borders.couples[i] else max(abs(state.pressures[i]), 1e-6)
            errors.append(abs(borders.right[i]) / scale / self.tolerance.volume)
        return max(errors) if np.isfinite(errors).all() else np.inf

    def factorise(self, borders: Borders) -> None:
        """Factorise the tangent with its borders: find what a unit of each pressure does to the unknowns.

        borders : at the state where the tangent was assembled

        Raises StepFailed when it cannot be factorised.
        """
        started = time.perf_counter()
        try:
            self.solver.factorise(self.system.data)
        except SingularMatrixError as error:
            raise StepFailed(str(error)) from error
        factorised = time.perf_counter()
        columns = borders.columns[self.system.free]
        self._answers = self.solver.solve(columns) if self.cavities else columns
        self._bordered = borders
        self.factorised = True
        self.unstable = self._count_unstable(borders)
        self.timings.factorisation += factorised - started
        self.timings.substitution += time.perf_counter() - factorised
        self.timings.factorisations += 1

    def _count_unstable(self, borders: Borders) -> int | None:
        """Negative eigenvalues of the bordered tangent at a fixed path parameter, beyond those at rest.

        Those of K by the signs of its pivots; eliminating K leaves one for each coupled fluid, which is
        negative where the fluid's pressure rises with its volume.
        """
        pivots = self.solver.negative_pivots
        if pivots is None or self._pivots_at_rest is None:
            return None
        fluids = np.flatnonzero(borders.couples[:-1])
        stiffness = borders.condensed(self.system.free, self._answers)[np.ix_(fluids, fluids)]
        rising = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T)) > 0.0
        return pivots - self._pivots_at_rest - int((~rising).sum())

    def newton_step(self, state: State, borders: Borders) -> tuple[State, State]:
        """The step with the last factors, and the path's direction per unit of the control.

        state : evaluated last; borders : there
        """
        started = time.perf_counter()
        relaxed = self.solver.solve(-self.system.residual[self.system.free][:, None])[:, 0]
        self.timings.substitution += time.perf_counter() - started
        step = self._bordered_answer(relaxed, -borders.right)
        for item in self.items:
            item.recover(step.unknowns)
        return step, self.direction()

    def direction(self) -> State:
        """The path's direction by the last factors, per unit of their control."""
        one = np.zeros(len(self.cavities) + 1)
        one[-1] = 1.0
        return self._bordered_answer(None, one)

    def _bordered_answer(self, relaxed: FloatArray | None, right: FloatArray) -> State:
        """Change of everything by the last factors.

        relaxed : (n_free,) answer of K to forces, None for no forces; right : of the borders, (n + 1,)
        """
        free, n = self.system.free, len(self.cavities)
        if relaxed is not None:
            right = right - self._bordered.answered(free, relaxed)
        try:
            small = self._bordered.condensed(free, self._answers)
            change = np.asarray(np.linalg.solve(small, right), float)
        except np.linalg.LinAlgError as error:
            raise StepFailed("the path has a turning point in the controlled quantity") from error
        unknowns = np.zeros(self.n_unknowns)
        unknowns[free] = self._answers @ change[:n]
        if relaxed is not None:
            unknowns[free] += relaxed
        return State(unknowns, change[:n], float(change[n]))
