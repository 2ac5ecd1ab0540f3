"""The paper's own procedure: independent pressure-driven states on a grid, filtered by volume changes.

Each pair of pressures is solved by itself, without any coupling of the volumes. Accepted are the states whose
chambers' volume changes have opposite signs and differ in size by less than 3 %: these approximate the cyclic
loop. The grid has even steps of the right pressure and, at each, left pressures in a geometric series of 5 %;
the series goes on either way until no state on it is near acceptance. The direct coupling (`drive`) gives the
same states in one path; this is here to compare, and to judge how good the paper's filter is.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.drive import Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.landing import Limit
from tubefoot.fea.path import follow
from tubefoot.fea.step import Step
from tubefoot.fea.stride import StepControl
from tubefoot.records import Run, write_table, write_whole
from tubefoot.units import KPA

MISMATCH = 0.03
"""Largest difference of the volume changes' sizes, over the larger one."""
RATIO = 1.05
"""From one left pressure of the grid to the next."""
FARTHEST = 30
"""Steps of the series either way before it is given up: left over right pressures of 0.23 to 4.3."""

Row = dict[str, Any]


@dataclass(frozen=True)
class GridState:
    """One converged state of the grid.

    ratio : left over right pressure; step : the state
    changes : volume changes of the right and left chamber [mm^3]
    """

    ratio: float
    step: Step
    changes: tuple[float, float]

    @property
    def mismatch(self) -> float:
        """Sum of the volume changes over the larger one's size: 0 for a pump, signed."""
        return sum(self.changes) / max(abs(change) for change in self.changes)

    @property
    def accepted(self) -> bool:
        """Whether a pump could bring the finger there."""
        return self.changes[0] * self.changes[1] < 0 and abs(self.mismatch) < MISMATCH


class PressureGrid:
    """Pressure-driven states of a model with two chambers, kept on disk branch by branch."""

    def __init__(self, model: Model, goal: Limit, run: Run, states: int):
        """Prepare the grid.

        model : of a finger; goal : the right pressure that the grid goes to
        run : where branches and grid.csv go; states : right pressures of the grid
        """
        self.model, self.goal, self.run, self.states = model, goal, run, states
        self.found: list[GridState] = []
        self.failures: list[str] = []

    def solve(self, note: Callable[[int, int], None] | None = None) -> list[GridState]:
        """The accepted states, by rising right pressure; grid.csv has all of them.

        note : called after each branch with the states solved and those accepted

        Raises ConvergenceError when no state is accepted.
        """
        for direction in (1, -1):
            for number in range(0 if direction > 0 else 1, FARTHEST + 1):
                branch = list(self._branch(-(RATIO ** (direction * number))))
                self.found += branch
                self._write()
                if note is not None:
                    note(len(self.found), sum(state.accepted for state in self.found))
                # Suction beyond what the pump would give empties the left chamber by too much.
                if not any(direction * state.mismatch > -MISMATCH for state in branch):
                    break
        accepted = [state for state in self.found if state.accepted]
        if not accepted:
            raise ConvergenceError(
                f"of {len(self.found)} pressure states none has opposite volumes within {MISMATCH:.0%}",
                self.failures,
                None,
            )
        return sorted(accepted, key=lambda state: (state.step.state.pressures[0], -abs(state.mismatch)))

    def _branch(self, ratio: float) -> Iterator[GridState]:
        """States of one ratio of the pressures, from disk where they are there."""
        kept = self.run.path(f"states/branch_{-ratio:.4f}.npz")
        steps = _load(kept) if kept.exists() else self._follow(ratio)
        if not kept.exists():
            _save(kept, steps)
        for step in steps:
            right, left = (float(v) for v in step.volumes - self.model.rest_volumes)
            yield GridState(ratio, step, (right, left))

    def _follow(self, ratio: float) -> list[Step]:
        self.model.drive = Drive(("pressure", "pressure"), (1.0, ratio))
        stepping = StepControl(states=self.states, growth=1.0)
        goal = replace(self.goal, control=replace(self.goal.control, quantity="parameter"))
        try:
            steps = follow(self.model, goal, (), stepping).steps
        except ConvergenceError as error:
            self.failures.append(f"left over right {ratio:.3f}: {error}")
            steps = error.last_state.steps if error.last_state is not None else []
        # States between those of the grid come from halved steps.
        stride = self.goal.control.target / self.states
        whole = [step.state.parameter / stride for step in steps]
        return [
            step for step, k in zip(steps, whole, strict=True) if round(k) > 0 and abs(k - round(k)) < 1e-6
        ]

    def _write(self) -> None:
        rows: list[Row] = [
            {
                "pressure_right_kpa": state.step.state.pressures[0] / KPA,
                "pressure_left_kpa": state.step.state.pressures[1] / KPA,
                "left_over_right": state.ratio,
                "mismatch_percent": 100.0 * state.mismatch,
                "accepted": int(state.accepted),
                "newton_iterations": state.step.iterations,
            }
            for state in sorted(self.found, key=lambda state: (state.ratio, state.step.state.pressures[0]))
        ]
        write_table(self.run.path("grid.csv"), rows)


def _save(path: Any, steps: list[Step]) -> None:
    buffer = io.BytesIO()
    np.savez(
        buffer,
        unknowns=np.array([step.state.unknowns for step in steps]),
        pressures=np.array([step.state.pressures for step in steps]),
        volumes=np.array([step.volumes for step in steps]),
        numbers=np.array(
            [(step.state.parameter, step.energy, step.min_jacobian, step.iterations) for step in steps]
        ).reshape(-1, 4),
    )
    write_whole(path, buffer.getvalue())


def _load(path: Any) -> list[Step]:
    data = np.load(path)
    return [
        Step(State(unknowns, pressures, float(at)), int(iterations), float(energy), float(jacobian), volumes)
        for unknowns, pressures, volumes, (at, energy, jacobian, iterations) in zip(
            data["unknowns"], data["pressures"], data["volumes"], data["numbers"], strict=True
        )
    ]
