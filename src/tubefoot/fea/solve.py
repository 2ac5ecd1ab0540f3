"""The solve stage: a design in, the curve of states, stress tables and fields out, resumable after a kill."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.filtered import PressureGrid
from tubefoot.fea.finger_model import HALF, FingerModel, SolveSettings, build_finger
from tubefoot.fea.hotspots import hotspot_rows
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.measures import FloatArray, Stresses
from tubefoot.fea.path import Path as SolvedPath
from tubefoot.fea.path import follow
from tubefoot.fea.recorder import Progress, Recorder, SolveResult, record, stress_shares
from tubefoot.fea.seam import Seam, seam_rows
from tubefoot.fea.step import Step
from tubefoot.fea.stride import StepControl
from tubefoot.fea.timeline import TimedStep, Timeline
from tubefoot.records import Run

GAPS_WITHIN_MM = 2.0
"""Largest gap between walls that is looked for; wider ones are reported as infinite."""


def solve_design(
    design: FingerDesign,
    directory: Path | str,
    settings: SolveSettings | None = None,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> SolveResult:
    """The result of solving a design, written to a directory; an interrupted run goes on where it was.

    design : the finger; directory : where the results go
    settings : mesh, drive, goal; progress : called with each new row of the curve
    overwrite : replace the results of another run that lie in the directory

    Raises ConfigError when the directory holds another run, ConvergenceError when the path breaks off (the
    converged states are kept and the summary says so).
    """
    settings = settings or SolveSettings()
    settled = {"design": design.model_dump(mode="json"), "solve": settings.model_dump(mode="json")}
    run = Run(directory, "solve", settled)
    ledger = Ledger.open(run, settled, overwrite)
    if ledger.summary is not None:
        return SolveResult(run.directory, ledger.curve, ledger.regions, ledger.summary)
    finger = SolvedFinger(build_finger(design, settings))
    return record(
        finger, run, ledger, progress, lambda observe, known: _walk(finger.finger, run, observe, known)
    )


def _walk(finger: FingerModel, run: Run, observe: Recorder, known: list[Step]) -> SolvedPath:
    """The path that the settings ask for: along the pump, through time, or over a grid of pressures."""
    if finger.settings.cavities == "filtered":
        return _filtered(finger, run, observe, known)
    if finger.memory is None:
        stepping = StepControl(states=finger.settings.states)
        return follow(finger.model, finger.goal, finger.limits, stepping, observe, known)
    timeline = Timeline(finger.model, finger.memory, finger.limits, observe)
    return timeline.run(finger.timeline(), _timed(known, observe.ledger.curve))


def _filtered(finger: FingerModel, run: Run, observe: Recorder, known: list[Step]) -> SolvedPath:
    """The accepted states of a pressure grid, recorded from where an interrupted run was."""
    grid = PressureGrid(finger.model, finger.goal, run, finger.settings.states)
    accepted = grid.solve(
        lambda tried, kept: print(f"  {tried} pressure states, {kept} accepted", flush=True)
    )
    path = SolvedPath([], f"{len(accepted)} of {len(grid.found)} pressure states accepted", [], grid.failures)
    rest = Step(finger.model.rest(), 0, 0.0, 1.0, finger.model.rest_volumes.copy())
    for number, step in enumerate([rest, *(state.step for state in accepted)]):
        path.steps.append(step)
        if number >= len(known):
            observe(step, 0.0)
    return path


def _timed(known: list[Step], curve: list[Row]) -> list[TimedStep]:
    """The steps of an interrupted solve in time, with their times from the curve."""
    return [
        TimedStep.at(float(row["time_s"]), step, step.energy) for step, row in zip(known, curve, strict=True)
    ]


class SolvedFinger:
    """A finger as the recorder reads it, see `Subject`."""

    share = HALF

    def __init__(self, finger: FingerModel):
        """Prepare what is read off it.

        finger : the model that is solved
        """
        self.finger = finger
        self.mesh, self.solid, self.model = finger.mesh, finger.solid, finger.model
        self.settings = finger.settings
        self.rupture_stretch = 1.0 + finger.design.body.elongation_at_break_percent / 100.0
        self._seam = Seam(finger.mesh, finger.solid)

    def turns(self, unknowns: FloatArray) -> tuple[float, float]:
        """Turn of the tip and turn half way up [rad].

        unknowns : displacements first [mm]
        """
        return self.finger.tip(unknowns)[0], self.finger.centreline.middle_turn(unknowns)

    def gap(self, step: Step) -> tuple[float | None, str | None]:
        """Smallest gap between the finger's walls [mm] and which they are.

        step : a converged step
        """
        return min(wall.smallest_gap(step.state, GAPS_WITHIN_MM) for wall in self.finger.walls)

    def unit_rows(self, number: int, stresses: Stresses) -> list[Row]:
        """Stress of each unit, caps left out.

        number : the state's step; stresses : there
        """
        profile = self.finger.design.profile
        unit = np.floor(self.solid.points[..., 2].mean(axis=1) / profile.pitch).astype(int)
        rows = []
        for k in range(profile.units):
            mine = (unit == k) & (stresses.region != "cap")
            shares = stress_shares(stresses.von_mises[mine], stresses.weights[mine])
            rows.append({"step": number, "unit": k + 1, **shares})
        return rows

    def further_rows(self, number: int, step: Step, stresses: Stresses) -> dict[str, list[Row]]:
        """Rows of seam.csv and hotspots.csv.

        number : the state's step; step : the state; stresses : there
        """
        design = self.finger.design
        found = self._seam.read(self.model, step.state)
        return {
            "seam": seam_rows(number, self._seam, found, design.seam.bond_strength_mpa),
            "hotspots": hotspot_rows(number, stresses, self.solid.points, design.profile.height / 2),
        }

    def facts(self) -> dict[str, Any]:
        """What summary.json says of a finger only: nothing."""
        return {}
