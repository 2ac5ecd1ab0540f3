"""The solve stage for any solid: a part in, the files of a finger's solve out, resumable after a kill.

Walls of a part that meet are not held apart: self-contact is known for fingers only, whose facing walls have
names. Columns of the curve that need such names, or time, stay empty.
"""

from __future__ import annotations

import hashlib
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.fea.equilibrium import Step
from tubefoot.fea.fields import write_fields, write_index
from tubefoot.fea.finger_model import HALF, SolveSettings, largest_stretch
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.measures import Stresses, percentile
from tubefoot.fea.mesh import scaled_jacobian
from tubefoot.fea.path import Path as SolvedPath
from tubefoot.fea.path import StepControl, follow
from tubefoot.fea.solid_part import PartModel, SolidPart, build_part
from tubefoot.fea.solve import CURVE_COLUMNS, Progress, SolveResult, region_rows
from tubefoot.records import Run, write_json
from tubefoot.units import DEG, KPA, ML


def solve_part(
    part: SolidPart,
    directory: Path | str,
    settings: SolveSettings | None = None,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> SolveResult:
    """The result of solving a part, written to a directory; an interrupted run goes on where it was.

    part : mesh or STEP file, sets, materials; directory : where the results go
    settings : drive, goal; progress : called with each new row of the curve
    overwrite : replace the results of another run that lie in the directory

    Raises ConfigError when the directory holds another run or a set is missing, GeometryError for a mesh that
    cannot be solved, ConvergenceError when the path breaks off (the converged states are kept).
    """
    settings = settings or SolveSettings()
    _require_options_of_parts(settings)
    path = Path(part.mesh)
    if not path.is_file():
        raise ConfigError(f"{path}: no such file")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    record = {
        "part": part.model_dump(mode="json"),
        "solve": settings.model_dump(mode="json"),
        "mesh_sha256": digest,
    }
    run = Run(directory, "solve", record)
    ledger = Ledger.open(run, record, overwrite)
    if ledger.summary is not None:
        return SolveResult(run.directory, ledger.curve, ledger.regions, ledger.summary)
    model = build_part(part, settings)
    recorder = _PartRecorder(model, run, ledger, progress)
    known = [ledger.load(k, model.model.n_unknowns) for k in range(len(ledger.curve))]
    failure: ConvergenceError | None = None
    try:
        found = follow(
            model.model, model.goal, model.limits, StepControl(states=settings.states), recorder, known
        )
    except ConvergenceError as error:
        failure, found = error, error.last_state or SolvedPath([])
        found.end_reason = f"no convergence: {error}"
    summary = recorder.summary(found, converged=failure is None)
    write_json(run.path("summary.json"), summary)
    run.finish(end_reason=summary["end_reason"])
    if failure is not None:
        raise failure
    return SolveResult(run.directory, ledger.curve, ledger.regions, summary)


def _require_options_of_parts(settings: SolveSettings) -> None:
    """Raise ConfigError for an option that needs the design of a finger."""
    chosen = {
        "viscoelastic": settings.viscoelastic,
        "ports": settings.ports,
        "rigid_parts = modelled": settings.rigid_parts == "modelled",
        "cavities = filtered": settings.cavities == "filtered",
    }
    for name, wanted in chosen.items():
        if wanted:
            raise ConfigError(f"{name} is an option of designs, not of a solid from a file; leave it out")


class _PartRecorder:
    """Turns converged steps into rows, tables and fields on disk; the path's observer."""

    def __init__(self, model: PartModel, run: Run, ledger: Ledger, progress: Progress | None):
        self.part, self.run, self.ledger, self.progress = model, run, ledger, progress
        self.fields = [
            (float(row["pumped_volume_ml"]), path)
            for row in ledger.curve
            if (path := self._field_path(int(row["step"]))).exists()
        ]
        self._cpu_started = time.process_time()

    def __call__(self, step: Step, wall_s: float) -> str | None:
        solid = self.part.solid
        stretch = percentile(largest_stretch(solid, step.state.unknowns), solid.weights, 0.999)
        rupture = 1.0 + self.part.part.body.elongation_at_break_percent / 100.0
        if stretch > rupture:
            return f"rupture strain: the largest stretch passes {rupture:.2f} beyond this state"
        stresses = Stresses.of(self.part.mesh, solid, step.state)
        number = len(self.ledger.curve)
        row = self._row(number, step, stresses) | {"largest_stretch_p999": stretch, "wall_s": wall_s}
        row = {name: row.get(name) for name in CURVE_COLUMNS}
        self.ledger.append(row, self._regions(number, stresses), [_whole_row(number, stresses)], step)
        self.ledger.note_spent(time.process_time() - self._cpu_started, self.run.wall_s)
        if self.part.settings.fields == "all" and number > 0:
            self._write_fields(number, row, step)
        if self.progress is not None:
            self.progress(row)
        return None

    def _row(self, number: int, step: Step, stresses: Stresses) -> Row:
        part, unknowns = self.part, step.state.unknowns
        bend, middle = part.tip(unknowns)[0], part.middle(unknowns)[0]
        tip = part.mesh.facet_set("tip").points
        position = part.mesh.points[tip] + unknowns[: part.mesh.points.size].reshape(-1, 3)[tip]
        # A part with one chamber has a left one that stays at zero.
        change, pressure = np.zeros(2), np.zeros(2)
        n = len(part.model.cavities)
        change[:n] = (step.volumes - part.model.rest_volumes) / part.share / ML
        pressure[:n] = step.state.pressures / KPA
        by_pressure = part.settings.cavities == "pressure"
        return {
            "step": number,
            "pumped_volume_ml": change[0] if by_pressure else step.state.parameter / part.share / ML,
            "pressure_right_kpa": pressure[0],
            "pressure_left_kpa": pressure[1],
            "volume_change_right_ml": change[0],
            "volume_change_left_ml": change[1],
            "bend_deg": bend / DEG,
            "theta1_deg": middle / DEG,
            "theta2_deg": (bend - middle) / DEG,
            "tip_x_mm": float(position[:, 0].mean()),
            "tip_z_mm": float(position[:, 2].mean()),
            "strain_energy_mj": step.energy / part.share,
            "von_mises_p99_kpa": percentile(stresses.von_mises, stresses.weights, 0.99) / KPA,
            "max_principal_p99_kpa": percentile(stresses.max_principal, stresses.weights, 0.99) / KPA,
            "min_jacobian": step.min_jacobian,
            "newton_iterations": step.iterations,
        }

    def _regions(self, number: int, stresses: Stresses) -> list[Row]:
        rows = region_rows(number, stresses)
        for row in rows:
            row["volume_mm3"] *= HALF / self.part.share
        return rows

    def _field_path(self, number: int) -> Path:
        return self.run.path(f"fields/state_{number:04d}.vtu")

    def _write_fields(self, number: int, row: Row, step: Step) -> None:
        path = write_fields(self._field_path(number), self.part.mesh, self.part.solid, step.state)
        self.fields.append((float(row["pumped_volume_ml"]), path))
        write_index(self.run.path("fields.pvd"), self.fields)

    def summary(self, path: SolvedPath, converged: bool) -> dict[str, Any]:
        """What summary.json holds."""
        model = self.part.model
        last, number = self.ledger.curve[-1], len(self.ledger.curve) - 1
        if self.part.settings.fields == "last" and number > 0:
            self._write_fields(number, last, path.steps[-1])
        seconds = {"cpu_s": time.process_time() - self._cpu_started, "wall_s": self.run.wall_s}
        return {
            "converged": converged,
            "end_reason": path.end_reason,
            **{key: float(last[key]) for key in ("bend_deg", "pressure_right_kpa", "pressure_left_kpa")},
            "states": len(self.ledger.curve),
            "elements": self.part.mesh.n_cells,
            "cell_kind": self.part.solid.block.kind,
            "modelled_share": self.part.share,
            "chambers_ml": [float(volume) / self.part.share / ML for volume in model.rest_volumes],
            "unknowns": model.system.size,
            "newton_iterations": int(sum(float(row["newton_iterations"]) for row in self.ledger.curve)),
            **{key: value + self.ledger.spent[key] for key, value in seconds.items()},
            "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
            "scaled_jacobian_min": float(scaled_jacobian(self.part.mesh).min()),
            "failed_steps": path.failures,
            "factoriser": model.solver.name,
        }


def _whole_row(number: int, stresses: Stresses) -> Row:
    """The row of units.csv: a part that is no finger is one unit."""
    shares = {
        f"von_mises_p{s}_kpa": percentile(stresses.von_mises, stresses.weights, s / 100) / KPA
        for s in (50, 95, 99)
    }
    return {"step": number, "unit": 1, **shares}
