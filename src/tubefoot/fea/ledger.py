"""What of a solve is on disk: written state by state, read back when an interrupted run goes on."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot import __version__
from tubefoot.errors import ConfigError
from tubefoot.fea.items import State
from tubefoot.fea.step import Step
from tubefoot.records import Run, read_table, write_json, write_table, write_whole

Row = dict[str, Any]

FURTHER_TABLES = ("seam", "hotspots", "grasp")
"""Tables beside curve, regions and units that a run may have."""


@dataclass
class Ledger:
    """What of a run is on disk: the rows so far and the state behind each."""

    run: Run
    key: str
    curve: list[Row] = field(default_factory=list)
    regions: list[Row] = field(default_factory=list)
    units: list[Row] = field(default_factory=list)
    further: dict[str, list[Row]] = field(default_factory=lambda: {name: [] for name in FURTHER_TABLES})
    summary: dict[str, Any] | None = None
    spent: dict[str, float] = field(default_factory=lambda: {"cpu_s": 0.0, "wall_s": 0.0})

    @classmethod
    def open(cls, run: Run, record: dict[str, Any], overwrite: bool) -> Ledger:
        """The ledger of a run: empty, or with what an earlier, interrupted one left.

        run : the run directory; record : every setting that the results depend on
        overwrite : drop what another run left there

        Raises ConfigError when the directory holds a run with other settings.
        """
        key = hashlib.sha256(json.dumps([__version__, record], sort_keys=True).encode()).hexdigest()
        ledger = cls(run, key)
        marker = run.path("states/key.json")
        if marker.exists():
            found = json.loads(marker.read_text())
            if found["key"] != key and not overwrite:
                raise ConfigError(
                    f"{run.directory} holds the solve of another design or of other settings; "
                    "choose another --out, or add --overwrite"
                )
            if found["key"] == key and not overwrite:
                ledger._read(found)
                return ledger
        ledger._clear()
        write_json(marker, {"key": key, **ledger.spent})
        return ledger

    def _read(self, found: dict[str, Any]) -> None:
        self.spent = {name: float(found.get(name, 0.0)) for name in self.spent}
        if self.run.path("curve.csv").exists():
            self.curve = read_table(self.run.path("curve.csv"))
            self.curve = [row for row in self.curve if self.state_path(int(row["step"])).exists()]
            steps = {row["step"] for row in self.curve}
            for name in ("regions", "units"):
                rows = read_table(self.run.path(f"{name}.csv"))
                setattr(self, name, [row for row in rows if row["step"] in steps])
            for name in FURTHER_TABLES:
                if (table := self.run.path(f"{name}.csv")).exists():
                    self.further[name] = [row for row in read_table(table) if row["step"] in steps]
        if (summary := self.run.path("summary.json")).exists():
            found = json.loads(summary.read_text())
            self.summary = found if found["converged"] else None

    def _clear(self) -> None:
        for pattern in ("states/*", "fields/*", "*.csv", "summary.json", "fields.pvd"):
            for path in self.run.directory.glob(pattern):
                path.unlink()

    def append(
        self,
        row: Row,
        regions: list[Row],
        units: list[Row],
        step: Step,
        further: dict[str, list[Row]] | None = None,
    ) -> None:
        """Put a converged state on disk: the state first, then the tables that name it.

        row : its row of the curve; regions, units : its rows of the stress tables; step : the state
        further : its rows of some of the `FURTHER_TABLES`
        """
        buffer = io.BytesIO()
        np.savez(
            buffer,
            unknowns=step.state.unknowns,
            pressures=step.state.pressures,
            parameter=step.state.parameter,
            volumes=step.volumes,
            energy=step.energy,
            min_jacobian=step.min_jacobian,
            iterations=step.iterations,
        )
        write_whole(self.state_path(len(self.curve)), buffer.getvalue())
        self.regions += regions
        self.units += units
        self.curve.append(row)
        for name, rows in (further or {}).items():
            self.further[name] += rows
            write_table(self.run.path(f"{name}.csv"), self.further[name])
        write_table(self.run.path("units.csv"), self.units)
        write_table(self.run.path("regions.csv"), self.regions)
        write_table(self.run.path("curve.csv"), self.curve)

    def note_spent(self, cpu_s: float, wall_s: float) -> None:
        """Keep the time spent so far, for a run that goes on after a kill.

        cpu_s, wall_s : of this process [s]
        """
        spent = {"cpu_s": self.spent["cpu_s"] + cpu_s, "wall_s": self.spent["wall_s"] + wall_s}
        write_json(self.run.path("states/key.json"), {"key": self.key, **spent})

    def load(self, number: int, n_unknowns: int) -> Step:
        """A converged step of the earlier run.

        number : which; n_unknowns : of the model that it must fit

        Raises ConfigError when it does not fit.
        """
        data = np.load(self.state_path(number))
        if len(data["unknowns"]) != n_unknowns:
            raise ConfigError(f"{self.run.directory} holds states of another mesh; add --overwrite")
        state = State(data["unknowns"], data["pressures"], float(data["parameter"]))
        numbers = (int(data["iterations"]), float(data["energy"]), float(data["min_jacobian"]))
        return Step(state, *numbers, volumes=data["volumes"])

    def state_path(self, number: int) -> Path:
        """Where a state lies.

        number : its step
        """
        return self.run.path(f"states/{number:04d}.npz")
