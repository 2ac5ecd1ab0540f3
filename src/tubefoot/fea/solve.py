"""The solve stage: a design in, the curve of states, stress tables and fields out, resumable after a kill.

Every converged state is on disk before the next one is begun; a state that did not converge is never written.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConvergenceError
from tubefoot.fea.equilibrium import Step
from tubefoot.fea.fields import write_fields, write_index
from tubefoot.fea.filtered import PressureGrid
from tubefoot.fea.finger_model import HALF, FingerModel, SolveSettings, build_finger, largest_stretch
from tubefoot.fea.hotspots import hotspot_rows
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.measures import Stresses, percentile
from tubefoot.fea.mesh import scaled_jacobian
from tubefoot.fea.path import Path as SolvedPath
from tubefoot.fea.path import StepControl, follow
from tubefoot.fea.seam import Seam, seam_rows
from tubefoot.fea.timeline import TimedStep, Timeline
from tubefoot.records import Run, write_json
from tubefoot.units import DEG, KPA, ML

Progress = Callable[[Row], None]

CURVE_COLUMNS = (
    "step",
    "pumped_volume_ml",
    "pressure_right_kpa",
    "pressure_left_kpa",
    "volume_change_right_ml",
    "volume_change_left_ml",
    "bend_deg",
    "theta1_deg",
    "theta2_deg",
    "tip_x_mm",
    "tip_z_mm",
    "strain_energy_mj",
    "von_mises_p99_kpa",
    "max_principal_p99_kpa",
    "min_jacobian",
    "contact_gap_min_mm",
    "newton_iterations",
    "wall_s",
    "largest_stretch_p999",
    "contact_gap_where",
    "time_s",
)
GAPS_WITHIN_MM = 2.0
"""Largest gap between walls that is looked for; wider ones are reported as infinite."""
STRESS_COLUMNS = ("s11", "s22", "s33", "s12", "s13", "s23")


@dataclass
class SolveResult:
    """What a solve found: one row a state, stresses by region, the summary, and where it all lies.

    curve : rows with the columns `CURVE_COLUMNS`; regions : rows of regions.csv; summary : of summary.json
    """

    directory: Path
    curve: list[Row]
    regions: list[Row]
    summary: dict[str, Any]

    @property
    def converged(self) -> bool:
        """Whether the path ended at its goal or at a physical limit."""
        return bool(self.summary["converged"])

    def column(self, name: str) -> np.ndarray:
        """One column of the curve, (n_states,).

        name : one of `CURVE_COLUMNS`
        """
        return np.array([float(row[name]) for row in self.curve])


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
    record = {"design": design.model_dump(mode="json"), "solve": settings.model_dump(mode="json")}
    run = Run(directory, "solve", record)
    ledger = Ledger.open(run, record, overwrite)
    if ledger.summary is not None:
        return SolveResult(run.directory, ledger.curve, ledger.regions, ledger.summary)
    finger = build_finger(design, settings)
    recorder = _Recorder(finger, run, ledger, progress)
    stepping = StepControl(states=settings.states)
    known = [ledger.load(k, finger.model.n_unknowns) for k in range(len(ledger.curve))]
    failure: ConvergenceError | None = None
    try:
        if settings.cavities == "filtered":
            path = _filtered(finger, run, recorder, known)
        elif finger.memory is None:
            path = follow(finger.model, finger.goal, finger.limits, stepping, recorder, known)
        else:
            timeline = Timeline(finger.model, finger.memory, finger.limits, recorder)
            path = timeline.run(finger.timeline(), _timed(known, ledger.curve))
    except ConvergenceError as error:
        failure, path = error, error.last_state or SolvedPath([])
        path.end_reason = f"no convergence: {error}"
    summary = recorder.summary(path, converged=failure is None)
    write_json(run.path("summary.json"), summary)
    run.finish(end_reason=summary["end_reason"])
    if failure is not None:
        raise failure
    return SolveResult(run.directory, ledger.curve, ledger.regions, summary)


def _filtered(finger: FingerModel, run: Run, recorder: _Recorder, known: list[Step]) -> SolvedPath:
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
            recorder(step, 0.0)
    return path


def _timed(known: list[Step], curve: list[Row]) -> list[TimedStep]:
    """The steps of an interrupted solve in time, with their times from the curve."""
    return [
        TimedStep.at(float(row["time_s"]), step, step.energy) for step, row in zip(known, curve, strict=True)
    ]


class _Recorder:
    """Turns converged steps into rows, tables and fields on disk; the path's observer."""

    def __init__(self, finger: FingerModel, run: Run, ledger: Ledger, progress: Progress | None):
        self.finger, self.run, self.ledger, self.progress = finger, run, ledger, progress
        self.seam = Seam(finger.mesh, finger.solid)
        self.fields = [
            (float(row["pumped_volume_ml"]), path)
            for row in ledger.curve
            if (path := self._field_path(int(row["step"]))).exists()
        ]
        self._cpu_started = time.process_time()

    def __call__(self, step: Step, wall_s: float) -> str | None:
        gap, where = min(wall.smallest_gap(step.state, GAPS_WITHIN_MM) for wall in self.finger.walls)
        if gap < 0.0 and not self.finger.settings.self_contact:
            return f"self-contact: {where} touch beyond this state, and self_contact is off"
        stretch = percentile(
            largest_stretch(self.finger.solid, step.state.unknowns), self.finger.solid.weights, 0.999
        )
        rupture = 1.0 + self.finger.design.body.elongation_at_break_percent / 100.0
        if stretch > rupture:
            return f"rupture strain: the largest stretch passes {rupture:.2f} beyond this state"
        stresses = Stresses.of(self.finger.mesh, self.finger.solid, step.state)
        number = len(self.ledger.curve)
        row = self._row(number, step, stresses)
        row |= {
            "contact_gap_min_mm": gap,
            "contact_gap_where": where,
            "largest_stretch_p999": stretch,
            "wall_s": wall_s,
        }
        row = {name: row[name] for name in CURVE_COLUMNS}
        self.ledger.append(
            row,
            region_rows(number, stresses),
            self._unit_rows(number, stresses),
            step,
            self._further_rows(number, step, stresses),
        )
        self.ledger.note_spent(time.process_time() - self._cpu_started, self.run.wall_s)
        if self.finger.settings.fields == "all" and number > 0:
            self._write_fields(number, row, step, stresses)
        if self.progress is not None:
            self.progress(row)
        return None

    def _row(self, number: int, step: Step, stresses: Stresses) -> Row:
        finger, unknowns = self.finger, step.state.unknowns
        bend, _ = finger.tip(unknowns)
        middle = finger.centreline.middle_turn(unknowns)
        tip = finger.mesh.facet_set("tip").points
        position = finger.mesh.points[tip] + unknowns[: finger.mesh.points.size].reshape(-1, 3)[tip]
        change = (step.volumes - finger.model.rest_volumes) / HALF / ML
        pumped = step.state.parameter / HALF / ML
        return {
            "step": number,
            "pumped_volume_ml": change[0] if finger.settings.cavities in ("pressure", "filtered") else pumped,
            "pressure_right_kpa": step.state.pressures[0] / KPA,
            "pressure_left_kpa": step.state.pressures[1] / KPA,
            "volume_change_right_ml": change[0],
            "volume_change_left_ml": change[1],
            "bend_deg": bend / DEG,
            "theta1_deg": middle / DEG,
            "theta2_deg": (bend - middle) / DEG,
            "tip_x_mm": float(position[:, 0].mean()),
            "tip_z_mm": float(position[:, 2].mean()),
            "strain_energy_mj": step.energy / HALF,
            "von_mises_p99_kpa": percentile(stresses.von_mises, stresses.weights, 0.99) / KPA,
            "max_principal_p99_kpa": percentile(stresses.max_principal, stresses.weights, 0.99) / KPA,
            "min_jacobian": step.min_jacobian,
            "newton_iterations": step.iterations,
            "time_s": step.time if isinstance(step, TimedStep) else None,
        }

    def _unit_rows(self, number: int, stresses: Stresses) -> list[Row]:
        """Rows of units.csv: stress of each unit, caps left out."""
        profile = self.finger.design.profile
        unit = np.floor(self.finger.solid.points[..., 2].mean(axis=1) / profile.pitch).astype(int)
        rows = []
        for k in range(profile.units):
            mine = (unit == k) & (stresses.region != "cap")
            values, weights = stresses.von_mises[mine], stresses.weights[mine]
            shares = {f"von_mises_p{s}_kpa": percentile(values, weights, s / 100) / KPA for s in (50, 95, 99)}
            rows.append({"step": number, "unit": k + 1, **shares})
        return rows

    def _further_rows(self, number: int, step: Step, stresses: Stresses) -> dict[str, list[Row]]:
        """Rows of seam.csv and hotspots.csv."""
        finger = self.finger
        found = self.seam.read(finger.model, step.state)
        strength = finger.design.seam.bond_strength_mpa
        half_height = finger.design.profile.height / 2
        return {
            "seam": seam_rows(number, self.seam, found, strength),
            "hotspots": hotspot_rows(number, stresses, finger.solid.points, half_height),
        }

    def _field_path(self, number: int) -> Path:
        return self.run.path(f"fields/state_{number:04d}.vtu")

    def _write_fields(self, number: int, row: Row, step: Step, stresses: Stresses | None = None) -> None:
        finger = self.finger
        path = write_fields(self._field_path(number), finger.mesh, finger.solid, step.state, stresses)
        self.fields.append((float(row["pumped_volume_ml"]), path))
        write_index(self.run.path("fields.pvd"), self.fields)

    def summary(self, path: SolvedPath, converged: bool) -> dict[str, Any]:
        """What summary.json holds."""
        model, timings = self.finger.model, self.finger.model.timings
        last = self.ledger.curve[-1]
        number = len(self.ledger.curve) - 1
        if self.finger.settings.fields == "last" and number > 0:
            self._write_fields(number, last, path.steps[-1])
        seconds = {"cpu_s": time.process_time() - self._cpu_started, "wall_s": self.run.wall_s}
        return {
            "converged": converged,
            "end_reason": path.end_reason,
            **{key: float(last[key]) for key in ("bend_deg", "pressure_right_kpa", "pressure_left_kpa")},
            "states": len(self.ledger.curve),
            "elements": self.finger.mesh.n_cells,
            "unknowns": model.system.size,
            "newton_iterations": int(sum(float(row["newton_iterations"]) for row in self.ledger.curve)),
            **{key: value + self.ledger.spent[key] for key, value in seconds.items()},
            "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
            "scaled_jacobian_min": float(scaled_jacobian(self.finger.mesh).min()),
            "turning_points_ml": [value / HALF / ML for value in path.turning_points],
            "failed_steps": path.failures,
            "factoriser": model.solver.name,
            "seconds": {
                "assembly": timings.assembly,
                "factorisation": timings.factorisation,
                "substitution": timings.substitution,
                "pattern": timings.analysis,
                "contact search": timings.pairing,
            },
        }


def region_rows(number: int, stresses: Stresses) -> list[Row]:
    """Rows of regions.csv for one state: volume and stress percentiles of each region.

    number : the state's step; stresses : of the finger
    """
    rows = []
    for name, mask in stresses.by_region():
        weights = stresses.weights[mask]
        von_mises = stresses.von_mises[mask]
        row: Row = {"step": number, "region": name, "volume_mm3": float(weights.sum()) / HALF}
        for share in (0.5, 0.95, 0.99):
            row[f"von_mises_p{round(100 * share)}_kpa"] = percentile(von_mises, weights, share) / KPA
        row["max_principal_p99_kpa"] = percentile(stresses.max_principal[mask], weights, 0.99) / KPA
        for component in STRESS_COLUMNS:
            values = stresses.component(component)[mask]
            row[f"{component}_p99_kpa"] = percentile(np.abs(values), weights, 0.99) / KPA
        row["s33_max_kpa"] = float(stresses.component("s33")[mask].max()) / KPA
        rows.append(row)
    return rows
