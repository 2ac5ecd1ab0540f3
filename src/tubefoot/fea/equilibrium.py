"""Equilibrium of a model at one point of its path, by Newton's method.

The tangent is assembled and factorised where the last factors no longer bring the residual down fast; chord
iterations in between cost a residual and a substitution. Cavity pressures and the path parameter follow from
a small dense system (`bordering`). How many of the tangent's eigenvalues are negative comes with the factors.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.assembly import SparseSystem
from tubefoot.fea.bordering import Borders
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import AIR_VACUUM_MPA, Control, Drive
from tubefoot.fea.factorise import SingularMatrixError, factoriser
from tubefoot.fea.items import Boundary, Choosing, Evaluation, Item, Pairing, State, Timings
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import Solid
from tubefoot.fea.step import Step, StepFailed, Tolerance

FloatArray = NDArray[np.float64]

CHORD = 0.05
"""Largest share of the error that an iteration may leave for its factors to be used once more."""
CHORD_FROM = 1e4
"""Error over the tolerance above which they are not: far from equilibrium a share says little."""


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
        self.system = SparseSystem(self.n_unknowns, self.items, self._fixed)
        self.solver = factoriser(self.system.indptr, self.system.indices)
        self._factorised = False
        self._unstable: int | None = None
        self.timings.analysis += time.perf_counter() - started
        self.timings.analyses += 1

    def pair(self, state: State, keep: bool = False) -> bool:
        """Let contacts choose their partners; whether any choice that matters changed.

        state : where they look; keep : leave choices as they are where they still serve
        """
        started = time.perf_counter()
        looked = [pairing.look(state, keep) for pairing in self.pairings]
        self.timings.pairing += time.perf_counter() - started
        if any(grew for _, grew in looked):
            self._number()
        return any(changed for changed, _ in looked)

    def rest(self) -> State:
        """The undeformed state."""
        return State(np.zeros(self.n_unknowns), np.zeros(len(self.cavities)), 0.0)

    def evaluate(self, state: State, stiff: bool = True) -> Evaluation:
        """Assemble residual and tangent at a state; the cavities keep their volumes and gradients.

        state : where to evaluate; stiff : whether the tangent is wanted
        """
        started = time.perf_counter()
        found = self.system.evaluate(self.items, state, stiff)
        self.timings.assembly += time.perf_counter() - started
        return found

    def solve(self, guess: State, control: Control) -> Step:
        """The converged step that the control asks for.

        guess : where Newton starts; control : which quantity ends at which value

        Raises StepFailed when it does not converge, inverts, or leaves the range of the physics; contacts
        then have the partners that they had before.
        """
        choices = [(item, item.choice) for item in self.pairings if isinstance(item, Choosing)]
        try:
            return self._converge(guess, control)
        except StepFailed:
            for item, choice in choices:
                item.choice = choice
            raise

    def _converge(self, guess: State, control: Control) -> Step:
        """Newton's iterations from a guess."""
        state = guess.copy()
        self.pair(state, keep=True)
        found = self._admissible(state)
        history: list[float] = []
        tangent = None
        for iteration in range(self.tolerance.iterations + 1):
            borders = self._borders(state, control)
            error = self._error(state, found, borders)
            history.append(error)
            if error < 1.0 and self.pair(state, keep=True):
                found = self.evaluate(state, stiff=False)
                borders = self._borders(state, control)
                error = self._error(state, found, borders)
                # With other partners it is another problem, whose residual may well be larger.
                history = [error]
            if error < 1.0:
                volumes = np.array([cavity.volume for cavity in self.cavities])
                return Step(
                    state,
                    iteration,
                    found.energy,
                    found.min_jacobian,
                    volumes,
                    history,
                    self._unstable,
                    tangent,
                    found.min_gap,
                )
            if iteration >= 4 and error > 1e3 * min(history):
                raise StepFailed(f"residual grew to {error:.1e} times the tolerance")
            if iteration == self.tolerance.iterations:
                break
            near = len(history) > 1 and error < min(CHORD * history[-2], CHORD_FROM)
            if not (near and self._factorised):
                if not self.system.stiff:
                    found = self.evaluate(state)
                self._factorise(borders)
            step, tangent = self._newton_step(state, borders)
            state, found = self._advance(state, step, iteration < self.tolerance.pairings)
        raise StepFailed(
            f"no convergence in {self.tolerance.iterations} iterations, residual {history[-1]:.1e}"
        )

    def slope_at_rest(self, goal: Control) -> float:
        """Derivative of a control's quantity by the path parameter, at rest.

        goal : the control
        """
        rest = self.rest()
        self.evaluate(rest)
        borders = self._borders(rest, Control("parameter", 0.0))
        self._factorise(borders)
        self._pivots_at_rest = self.solver.negative_pivots
        _, along = self._newton_step(rest, borders)
        n, wanted = len(self.cavities), self._borders(rest, goal)
        slope = wanted.small[n, :n] @ along.pressures + wanted.small[n, n]
        if wanted.control_row is not None:
            slope += wanted.control_row @ along.unknowns
        return float(slope)

    def linearise(self, state: State) -> int | None:
        """Factorise the tangent at a state, the path parameter fixed; how many directions are unstable.

        state : where, with its contacts as they are
        """
        self.evaluate(state)
        self._factorise(self._borders(state, Control("parameter", state.parameter)))
        return self._unstable

    def response(self, forces: FloatArray) -> State:
        """Small change by forces at a fixed path parameter, where the model was linearised.

        forces : (n_unknowns,) on the displacements [N]
        """
        relaxed = self.solver.solve(forces[self.system.free][:, None])[:, 0]
        return self._bordered_answer(relaxed, np.zeros(len(self.cavities) + 1))

    def add(self, item: Item) -> None:
        """Take one more item into the model.

        item : couples displacements only
        """
        self.items.append(item)
        self._number()

    def _admissible(self, state: State) -> Evaluation:
        if self._tears_air(state):
            raise StepFailed("the pressure of an air column is at absolute vacuum")
        found = self.evaluate(state)
        if not self.tolerance.admits(found):
            raise StepFailed(self.tolerance.complaint(found))
        return found

    def _advance(self, state: State, step: State, pairing: bool) -> tuple[State, Evaluation]:
        """The state after a step, shortened until it is admitted and no air column is torn apart."""
        fraction = 1.0
        for _ in range(5):
            trial = State(
                state.unknowns + fraction * step.unknowns,
                state.pressures + fraction * step.pressures,
                state.parameter + fraction * step.parameter,
            )
            if not self._tears_air(trial):
                if pairing:
                    self.pair(trial, keep=True)
                found = self.evaluate(trial, stiff=False)
                if self.tolerance.admits(found):
                    return trial, found
            fraction *= 0.5
        raise StepFailed("a cell inverts, walls cross or an air column is torn apart, however short the step")

    def _tears_air(self, state: State) -> bool:
        """Whether a fluid with an air column has a pressure at which Boyle's law ends."""
        return any(
            cavity.air_volume > 0 and pressure <= AIR_VACUUM_MPA
            for cavity, pressure in zip(self.cavities, state.pressures, strict=True)
        )

    def _borders(self, state: State, control: Control) -> Borders:
        return Borders.of(state, self.cavities, self.drive, control, self._control_scale)

    def _error(self, state: State, found: Evaluation, borders: Borders) -> float:
        """Largest residual over its tolerance; below one means converged."""
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

    def _factorise(self, borders: Borders) -> None:
        """Factorise the tangent with its borders: find what a unit of each pressure does to the unknowns."""
        started = time.perf_counter()
        try:
            self.solver.factorise(self.system.data)
        except SingularMatrixError as error:
            raise StepFailed(str(error)) from error
        factorised = time.perf_counter()
        columns = borders.columns[self.system.free]
        self._answers = self.solver.solve(columns) if self.cavities else columns
        self._bordered = borders
        self._factorised = True
        self._unstable = self._count_unstable(borders)
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

    def _newton_step(self, state: State, borders: Borders) -> tuple[State, State]:
        """The step with the last factors, and the path's direction per unit of the control."""
        started = time.perf_counter()
        relaxed = self.solver.solve(-self.system.residual[self.system.free][:, None])[:, 0]
        self.timings.substitution += time.perf_counter() - started
        step = self._bordered_answer(relaxed, -borders.right)
        for item in self.items:
            item.recover(step.unknowns)
        one = np.zeros(len(self.cavities) + 1)
        one[-1] = 1.0
        return step, self._bordered_answer(None, one)

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
