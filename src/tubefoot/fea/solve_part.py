"""The solve stage for any solid: a part in, the files of a finger's solve out, resumable after a kill.

Walls of a part that meet are not held apart: self-contact is known for fingers only, whose facing walls have
names. Columns of the curve that need such names, or time, stay empty.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.ledger import Ledger, Row
from tubefoot.fea.measures import FloatArray, Stresses
from tubefoot.fea.path import follow
from tubefoot.fea.recorder import Progress, SolveResult, record, stress_shares
from tubefoot.fea.solid_part import PartModel, SolidPart, build_part
from tubefoot.fea.step import Step
from tubefoot.fea.stride import StepControl
from tubefoot.records import Run
from tubefoot.units import ML


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
    settled = {
        "part": part.model_dump(mode="json"),
        "solve": settings.model_dump(mode="json"),
        "mesh_sha256": digest,
    }
    run = Run(directory, "solve", settled)
    ledger = Ledger.open(run, settled, overwrite)
    if ledger.summary is not None:
        return SolveResult(run.directory, ledger.curve, ledger.regions, ledger.summary)
    model = build_part(part, settings)
    stepping = StepControl(states=settings.states)
    return record(
        _SolvedPart(model),
        run,
        ledger,
        progress,
        lambda observe, known: follow(model.model, model.goal, model.limits, stepping, observe, known),
    )


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


class _SolvedPart:
    """A part as the recorder reads it; one that is no finger counts as one unit."""

    def __init__(self, part: PartModel):
        self.part = part
        self.mesh, self.solid, self.model = part.mesh, part.solid, part.model
        self.settings, self.share = part.settings, part.share
        self.rupture_stretch = 1.0 + part.part.body.elongation_at_break_percent / 100.0

    def turns(self, unknowns: FloatArray) -> tuple[float, float]:
        return self.part.tip(unknowns)[0], self.part.middle(unknowns)[0]

    def gap(self, step: Step) -> tuple[float | None, str | None]:
        return None, None

    def unit_rows(self, number: int, stresses: Stresses) -> list[Row]:
        return [{"step": number, "unit": 1, **stress_shares(stresses.von_mises, stresses.weights)}]

    def further_rows(self, number: int, step: Step, stresses: Stresses) -> dict[str, list[Row]]:
        return {}

    def facts(self) -> dict[str, Any]:
        volumes = [float(volume) / self.share / ML for volume in self.model.rest_volumes]
        return {"cell_kind": self.solid.block.kind, "modelled_share": self.share, "chambers_ml": volumes}
