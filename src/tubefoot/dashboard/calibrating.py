"""Calibration from the page: the bench's procedure, its questions asked there, its result in force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import tomli_w

from tubefoot.config import Settings
from tubefoot.dashboard.questions import PageOperator
from tubefoot.dashboard.watched_rig import WatchedRig
from tubefoot.lab.rig_calibrations import CALIBRATIONS
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import RigSettings
from tubefoot.records import free_path, write_table, write_whole

if TYPE_CHECKING:
    from tubefoot.dashboard.session import Session


class CalibrateOrder(Settings):
    """Calibrate sensors, supply or pump, step by step."""

    do: Literal["calibrate"]
    what: Literal["pressure", "supply", "pump"]
    """which"""

    kind: ClassVar[str] = "calibrate"

    @property
    def text(self) -> str:
        """For people."""
        return f"calibrate {'the sensors' if self.what == 'pressure' else 'the ' + self.what}"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        bench = session.bench
        operator = PageOperator(session.questions, rig, bench.hands)
        said: list[str] = []

        def say(text: str) -> None:
            said.append(text)
            session.feed.tell(progress=text)

        try:
            rows, calibrated = CALIBRATIONS[self.what](rig, operator, bench.rig.settings, say)
            operator.tidy()
        finally:
            bench.tidy()
        path = _kept(session.log.directory, self.what, rows, calibrated)
        bench.rig.settings = calibrated
        rig.connect()  # its limits in counts follow from the sensors
        measure_neutral(rig)
        for line in said[-2:]:
            session.note("info", line)
        return f"in force, and kept in {path} (use it with --rig)"


def _kept(directory: Path, what: str, rows: Sequence[Any], calibrated: RigSettings) -> Path:
    """The new rig file; the readings lie beside it."""
    write_table(free_path(directory, what, ".csv"), rows)
    return write_whole(
        free_path(directory, "rig", ".toml"), tomli_w.dumps(calibrated.model_dump(mode="json"))
    )
