"""Equilibrium of a model at one point of its path, by Newton's method.

The tangent is assembled and factorised where the last factors no longer bring the residual down fast; chord
iterations in between cost a residual and a substitution. Cavity pressures and the path parameter follow from
a small dense system (bordering): with K du = -r + sum_i b_i dp_i and b_i = dV_i/du,

    g_i + b_i . du + g_i,p dp_i - rate_i ds = 0   for each cavity,      c + c_u . du + c_p dp + c_s ds = 0.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.assembly import SparseSystem
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import AIR_VACUUM_MPA, Control, Drive, air_uptake
from tubefoot.fea.factorise import SingularMatrixError, factoriser
from tubefoot.fea.items import Boundary, Evaluation, Item, Pairing, State, Timings
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import Solid

FloatArray = NDArray[np.float64]


CHORD = 0.05
"""Largest share of the error that an iteration may leave for its factors to be used once more."""
CHORD_FROM = 1e4
"""Error over the tolerance above which they are not: far from equilibrium a share says little."""


class StepFailed(Exception):
    """Newton did not converge to the wanted point; the message says how it ended."""


@dataclass(frozen=True)
class Tolerance:
    """When a state counts as converged; all dimensionless.

    force : residual force over the largest cell force or cavity load
    volume : error of the fluid equations and of the control over the rest volume (or the target's scale)
    iterations : iterations before a step is given up
    min_jacobian : smallest det F that a trial state may have; below it the step is shortened
    min_gap : deepest penetration of a contact that a trial state may have, negative [mm]
    pairings : iterations of a step in which contacts may choose other partners
    """

    force: float = 1e-7
    volume: float = 1e-8
    iterations: int = 24
    min_jacobian: float = 0.1
    min_gap: float = -0.3
    pairings: int = 8

    def admits(self, found: Evaluation) -> bool:
        """Whether a trial state is one from which Newton may go on.

        found : at the trial state
        """
        return bool(found.min_jacobian > self.min_jacobian and found.min_gap > self.min_gap)

    def complaint(self, found: Evaluation) -> str:
        """What is wrong with a state that is not admitted.

        found : at the state
        """
        if found.min_jacobian > self.min_jacobian:
            return f"walls pass through each other: smallest gap {found.min_gap:.2g} mm"
        return f"a cell inverts: smallest det F {found.min_jacobian:.2g}"


@dataclass
class Step:
    """How a converged step went: the state, Newton iterations, energy [mJ], smallest det F and gap [mm]."""

    state: State
    iterations: int
    energy: float
    min_jacobian: float
    volumes: FloatArray
    residuals: list[float] = field(default_factory=list)
    negative_pivots: int | None = None
    tangent: State | None = None
    min_gap: float = np.inf


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
        self._number()
        self.rest_volumes = np.array([cavity.rest_volume for cavity in self.cavities])
        self._control_scale = float(self.rest_volumes.max()) if len(self.cavities) else 1.0

    def _number(self) -> None:
        """Find the sparse pattern of all items and prepare its factorisation."""
        started = time.perf_counter()
        self.system = SparseSystem(self.n_unknowns, self.items, self._fixed)
        self.solver = factoriser(self.system.indptr, self.system.indices)
        self._factorised = False
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

        Raises StepFailed when it does not converge, inverts, or leaves the range of the physics.
        """
        state = guess.copy()
        self.pair(state)
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
            if error < 1.0:
                volumes = np.array([cavity.volume for cavity in self.cavities])
                return Step(
                    state,
                    iteration,
                    found.energy,
                    found.min_jacobian,
                    volumes,
                    history,
                    self.solver.negative_pivots,
                    tangent,
                    found.min_gap,
                )
            if iteration >= 4 and error > 1e3 * min(history):
                raise StepFailed(f"residual grew to {error:.1e} times the tolerance")
            if iteration == self.tolerance.iterations:
                break
            near = iteration > 0 and error < min(CHORD * history[-2], CHORD_FROM)
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
        borders = self._borders(rest, goal)
        self._factorise(borders)
        _, along = self._newton_step(rest, borders)
        n = len(self.cavities)
        slope = borders.small[n, :n] @ along.pressures + borders.small[n, n]
        if borders.control_row is not None:
            slope += borders.control_row @ along.unknowns
        return float(slope)

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
                    self.pair(trial)
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

    def _borders(self, state: State, control: Control) -> _Borders:
        n = len(self.cavities)
        columns = np.zeros((self.n_unknowns, n))
        small, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
        couples = np.zeros(n + 1, dtype=bool)
        for i, (cavity, kind, rate) in enumerate(
            zip(self.cavities, self.drive.kind, self.drive.rate, strict=True)
        ):
            columns[:, i] = cavity.gradient(self.n_unknowns)
            small[i, n] = -rate
            if kind == "volume":
                uptake, slope = air_uptake(state.pressures[i], cavity.air_volume)
                right[i] = cavity.volume - cavity.rest_volume + uptake - rate * state.parameter
                small[i, i], couples[i] = slope, True
            else:
                right[i] = state.pressures[i] - rate * state.parameter
                small[i, i] = 1.0
        control_row: FloatArray | None = None
        scale = self._control_scale
        if control.quantity == "parameter":
            small[n, n], right[n] = 1.0, state.parameter - control.target
            scale = max(scale, 1.0) if "volume" in self.drive.kind else max(abs(control.target), 1e-9)
        elif control.quantity == "pressure":
            small[n, control.cavity], right[n] = 1.0, state.pressures[control.cavity] - control.target
            scale = max(abs(control.target), 1e-6)
        elif control.quantity == "volume_change":
            cavity = self.cavities[control.cavity]
            control_row = columns[:, control.cavity]
            right[n] = cavity.volume - cavity.rest_volume - control.target
        else:
            assert control.measure is not None
            value, gradient = control.measure(state.unknowns)
            control_row = np.zeros(self.n_unknowns)
            control_row[: len(gradient)] = gradient
            right[n], scale = value - control.target, max(abs(control.target), 1e-6)
        return _Borders(columns, small, right, couples, control_row, scale)

    def _error(self, state: State, found: Evaluation, borders: _Borders) -> float:
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

    def _factorise(self, borders: _Borders) -> None:
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
        self.timings.factorisation += factorised - started
        self.timings.substitution += time.perf_counter() - factorised
        self.timings.factorisations += 1

    def _newton_step(self, state: State, borders: _Borders) -> tuple[State, State]:
        """The step with the last factors and their borders, and the path's direction (per path parameter)."""
        free, n = self.system.free, len(self.cavities)
        started = time.perf_counter()
        right = -borders.right
        borders = self._bordered
        columns = borders.columns[free]
        relaxed = self.solver.solve(-self.system.residual[free][:, None])
        solved = np.column_stack([self._answers, relaxed])
        self.timings.substitution += time.perf_counter() - started
        small = borders.small.copy()
        for i in np.flatnonzero(borders.couples[:n]):
            small[i, :n] += columns[:, i] @ solved[:, :n]
            right[i] -= columns[:, i] @ solved[:, n]
        if borders.control_row is not None:
            row = borders.control_row[free]
            small[n, :n] += row @ solved[:, :n]
            right[n] -= row @ solved[:, n]
        try:
            change = np.asarray(np.linalg.solve(small, right), float)
            along = np.asarray(np.linalg.solve(small[:n, :n], -small[:n, n]), float) if n else np.zeros(0)
        except np.linalg.LinAlgError as error:
            raise StepFailed("the path has a turning point in the controlled quantity") from error
        unknowns = np.zeros(self.n_unknowns)
        unknowns[free] = solved[:, :n] @ change[:n] + solved[:, n]
        for item in self.items:
            item.recover(unknowns)
        direction = np.zeros(self.n_unknowns)
        direction[free] = solved[:, :n] @ along
        return State(unknowns, change[:n], float(change[n])), State(direction, along, 1.0)


@dataclass
class _Borders:
    """Columns dV/du (n_unknowns, n), the small matrix and right side (n + 1), and the control's row."""

    columns: FloatArray
    small: FloatArray
    right: FloatArray
    couples: NDArray[np.bool_]
    control_row: FloatArray | None
    scale: float
