"""What a solve leaves behind: every converged state as rows, tables and fields on disk, and the summary.

A state is on disk before the next one is begun; one that did not converge is never written. Fingers and other
parts differ in what is read off them (`Subject`), not in how it is kept.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.fields import write_fields, write_index
from tubefoot.fea.finger_model import SolveSettings, largest_stretch
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.measures import FloatArray, Stresses, percentile
from tubefoot.fea.mesh import Mesh, scaled_jacobian
from tubefoot.fea.path import Path as SolvedPath
from tubefoot.fea.solid import Solid
from tubefoot.fea.step import Step
from tubefoot.fea.timeline import TimedStep
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
    "event",
)
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


class Subject(Protocol):
    """What is solved, and what is read off it.

    share : the modelled share of the whole, 1/2 for a half; rupture_stretch : principal stretch at break
    """

    mesh: Mesh
    solid: Solid
    model: Model
    settings: SolveSettings
    share: float
    rupture_stretch: float

    def turns(self, unknowns: FloatArray) -> tuple[float, float]:
        """Turn of the tip and turn half way up [rad].

        unknowns : displacements first [mm]
        """

    def gap(self, step: Step) -> tuple[float | None, str | None]:
        """Smallest gap between walls [mm] and which they are; None where that is not known.

        step : a converged step
        """

    def unit_rows(self, number: int, stresses: Stresses) -> list[Row]:
        """Rows of units.csv for one state.

        number : the state's step; stresses : there
        """

    def further_rows(self, number: int, step: Step, stresses: Stresses) -> dict[str, list[Row]]:
        """Rows of further tables by the table's name.

        number : the state's step; step : the state; stresses : there
        """

    def facts(self) -> dict[str, Any]:
        """What summary.json says of this subject only."""


def record(
    subject: Subject,
    run: Run,
    ledger: Ledger,
    progress: Progress | None,
    walk: Callable[[Recorder, list[Step]], SolvedPath],
) -> SolveResult:
    """The result of walking a path with every state recorded; a path that breaks off keeps its states.

    subject : what is solved; run : where results go; ledger : what an interrupted run left
    progress : called with each new row of the curve
    walk : follows the path, given the observer and the states that are known

    Raises the walk's ConvergenceError, after the summary has been written.
    """
    recorder = Recorder(subject, run, ledger, progress)
    known = [ledger.load(k, subject.model.n_unknowns) for k in range(len(ledger.curve))]
    failure: ConvergenceError | None = None
    try:
        path = walk(recorder, known)
    except ConvergenceError as error:
        failure, path = error, error.last_state or SolvedPath([])
        path.end_reason = f"no convergence: {error}"
    summary = recorder.summary(path, converged=failure is None)
    write_json(run.path("summary.json"), summary)
    run.finish(end_reason=summary["end_reason"])
    if failure is not None:
        raise failure
    return SolveResult(run.directory, ledger.curve, ledger.regions, summary)


class Recorder:
    """Turns converged steps into rows, tables and fields on disk; the path's observer."""

    def __init__(self, subject: Subject, run: Run, ledger: Ledger, progress: Progress | None):
        """Find what fields an interrupted run has written.

        subject : what is solved; run : where results go; ledger : rows and states on disk
        progress : called with each new row of the curve
        """
        self.subject, self.run, self.ledger, self.progress = subject, run, ledger, progress
        self.fields = [
            (float(row["pumped_volume_ml"]), path)
            for row in ledger.curve
            if (path := self._field_path(int(row["step"]))).exists()
        ]
        self._cpu_started = time.process_time()

    def __call__(self, step: Step, wall_s: float) -> str | None:
        """Record a step; a text says why the path ends before it.

        step : a converged step; wall_s : what it took [s]
        """
        subject = self.subject
        gap, where = subject.gap(step)
        if gap is not None and gap < 0.0 and not subject.settings.self_contact:
            return f"self-contact: {where} touch beyond this state, and self_contact is off"
        stretch = percentile(
            largest_stretch(subject.solid, step.state.unknowns), subject.solid.weights, 0.999
        )
        if stretch > subject.rupture_stretch:
            return (
                f"rupture strain: the largest stretch passes {subject.rupture_stretch:.2f} beyond this state"
            )
        stresses = Stresses.of(subject.mesh, subject.solid, step.state)
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
            region_rows(number, stresses, subject.share),
            subject.unit_rows(number, stresses),
            step,
            subject.further_rows(number, step, stresses),
        )
        self.ledger.note_spent(time.process_time() - self._cpu_started, self.run.wall_s)
        if subject.settings.fields == "all" and number > 0:
            self._write_fields(number, row, step, stresses)
        if self.progress is not None:
            self.progress(row)
        return None

    def _row(self, number: int, step: Step, stresses: Stresses) -> Row:
        subject, unknowns = self.subject, step.state.unknowns
        bend, middle = subject.turns(unknowns)
        tip = subject.mesh.facet_set("tip").points
        position = subject.mesh.points[tip] + unknowns[: subject.mesh.points.size].reshape(-1, 3)[tip]
        # A part with one chamber has a left one that stays at zero.
        change, pressure = np.zeros(2), np.zeros(2)
        n = len(subject.model.cavities)
        change[:n] = (step.volumes - subject.model.rest_volumes) / subject.share / ML
        pressure[:n] = step.state.pressures / KPA
        by_pressure = subject.settings.cavities in ("pressure", "filtered")
        return {
            "step": number,
            "pumped_volume_ml": change[0] if by_pressure else step.state.parameter / subject.share / ML,
            "pressure_right_kpa": pressure[0],
            "pressure_left_kpa": pressure[1],
            "volume_change_right_ml": change[0],
            "volume_change_left_ml": change[1],
            "bend_deg": bend / DEG,
            "theta1_deg": middle / DEG,
            "theta2_deg": (bend - middle) / DEG,
            "tip_x_mm": float(position[:, 0].mean()),
            "tip_z_mm": float(position[:, 2].mean()),
            "strain_energy_mj": step.energy / subject.share,
            "von_mises_p99_kpa": percentile(stresses.von_mises, stresses.weights, 0.99) / KPA,
            "max_principal_p99_kpa": percentile(stresses.max_principal, stresses.weights, 0.99) / KPA,
            "min_jacobian": step.min_jacobian,
            "newton_iterations": step.iterations,
            "time_s": step.time if isinstance(step, TimedStep) else None,
            "event": step.event or None,
        }

    def _field_path(self, number: int) -> Path:
        return self.run.path(f"fields/state_{number:04d}.vtu")

    def _write_fields(self, number: int, row: Row, step: Step, stresses: Stresses | None = None) -> None:
        subject = self.subject
        path = write_fields(self._field_path(number), subject.mesh, subject.solid, step.state, stresses)
        self.fields.append((float(row["pumped_volume_ml"]), path))
        write_index(self.run.path("fields.pvd"), self.fields)

    def summary(self, path: SolvedPath, converged: bool) -> dict[str, Any]:
        """What summary.json holds.

        path : as far as it went; converged : whether it ended where it should or could
        """
        subject, model, timings = self.subject, self.subject.model, self.subject.model.timings
        last = self.ledger.curve[-1]
        number = len(self.ledger.curve) - 1
        if subject.settings.fields == "last" and number > 0:
            self._write_fields(number, last, path.steps[-1])
        seconds = {"cpu_s": time.process_time() - self._cpu_started, "wall_s": self.run.wall_s}
        return {
            "converged": converged,
            "end_reason": path.end_reason,
            **{key: float(last[key]) for key in ("bend_deg", "pressure_right_kpa", "pressure_left_kpa")},
            "states": len(self.ledger.curve),
            "elements": subject.mesh.n_cells,
            **subject.facts(),
            "unknowns": model.system.size,
            "newton_iterations": int(sum(float(row["newton_iterations"]) for row in self.ledger.curve)),
            **{key: value + self.ledger.spent[key] for key, value in seconds.items()},
            "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
            "scaled_jacobian_min": float(scaled_jacobian(subject.mesh).min()),
            "turning_points_ml": [value / subject.share / ML for value in path.turning_points],
            "snaps": [row["event"] for row in self.ledger.curve if row.get("event")],
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


def stress_shares(values: FloatArray, weights: FloatArray) -> Row:
    """Percentiles of the von Mises stress as units.csv has them [kPa].

    values : von Mises stress [MPa], weights : volumes, same shape
    """
    return {f"von_mises_p{s}_kpa": percentile(values, weights, s / 100) / KPA for s in (50, 95, 99)}


def region_rows(number: int, stresses: Stresses, share: float) -> list[Row]:
    """Rows of regions.csv for one state: volume and stress percentiles of each region.

    number : the state's step; stresses : there; share : the modelled share of the whole
    """
    rows = []
    for name, mask in stresses.by_region():
        weights = stresses.weights[mask]
        von_mises = stresses.von_mises[mask]
        row: Row = {"step": number, "region": name, "volume_mm3": float(weights.sum()) / share}
        row |= stress_shares(von_mises, weights)
        row["max_principal_p99_kpa"] = percentile(stresses.max_principal[mask], weights, 0.99) / KPA
        for component in STRESS_COLUMNS:
            values = stresses.component(component)[mask]
            row[f"{component}_p99_kpa"] = percentile(np.abs(values), weights, 0.99) / KPA
        row["s33_max_kpa"] = float(stresses.component("s33")[mask].max()) / KPA
        rows.append(row)
    return rows
