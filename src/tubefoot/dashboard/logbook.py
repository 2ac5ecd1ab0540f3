"""What a session leaves behind: recordings when asked for, the trace of each motion always."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tomli_w

from tubefoot.control.trace import COLUMNS
from tubefoot.dashboard.benches import Bench
from tubefoot.dashboard.feed import Sight
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.recorder import Recorder
from tubefoot.records import free_path, write_table, write_whole
from tubefoot.vision.finger import FingerReading


class Logbook:
    """The files of one session; used by the bench's thread only.

    directory : where they go
    recorder : the running recording's, None where nothing is recorded
    angles_by_other : whether what runs records the angles itself
    """

    def __init__(self, directory: Path):
        """Name the place.

        directory : exists
        """
        self.directory = directory
        self.recorder: Recorder | None = None
        self.angles_by_other = False
        self._rig: BoardRig | None = None
        self._pictures = False

    def begin(self, bench: Bench, pictures: bool, directory: Path | None = None) -> Path:
        """The path of a new recording that has begun; camera and markers lie beside it, for its replay.

        bench : recorded
        pictures : whether frames are recorded, about 1 MB a second
        directory : where it goes; that of the session if not given
        """
        place = directory or self.directory
        if self.recorder is not None:
            raise ConfigError(f"{self.recorder.path} is being recorded; end that first")
        path = free_path(place, "bench", ".mcap")
        if bench.calibration is not None:
            bench.calibration.save(place / "camera.toml")
            layout = bench.layout.model_dump(mode="json", exclude_none=True)
            write_whole(place / "layout.toml", tomli_w.dumps(layout))
        rig = bench.rig
        self.recorder, self._rig = Recorder(path, rig.settings, rig.clock.now()), rig
        self._pictures = pictures
        rig.record_into(self.recorder)
        return path

    def frame(self, reading: FingerReading, sight: Sight, now: float) -> None:
        """Record a frame and its angles, if anything is recorded.

        reading : of the frame
        sight : its picture
        now : on the rig's clock [s]
        """
        if self.recorder is None:
            return
        try:
            if not self.angles_by_other:
                self.recorder.angle(reading.time_s, now, reading.columns(), reading.fault)
            if self._pictures and sight.jpeg:
                self.recorder.frame(reading.time_s, sight.jpeg, *sight.size)
        except LinkError:
            self.close()
            raise

    def end(self) -> Path:
        """The path of the recording that has ended."""
        if self.recorder is None:
            raise ConfigError("nothing is being recorded")
        path = self.recorder.path
        self.close()
        return path

    def close(self) -> None:
        """End the recording, if there is one."""
        if self._rig is not None:
            self._rig.record_into(None)
        if self.recorder is not None:
            recorder, self.recorder = self.recorder, None
            recorder.close()

    def trace(self, rows: Sequence[dict[str, Any]]) -> Path | None:
        """The path of a motion's table, None for a motion without a row.

        rows : of the trace, one a frame
        """
        if not rows:
            return None
        whole = [{key: _cell(value) for key, value in row.items()} for row in rows]
        return write_table(free_path(self.directory, "motion", ".csv"), whole, COLUMNS)


def kept_text(directory: Path, stem: str, suffix: str, text: str) -> Path:
    """The path of a table or file of settings that the page sent, kept as a file.

    directory : where it is kept
    stem : its name
    suffix : its ending with the dot
    text : what is in it
    """
    return write_whole(free_path(directory, stem, suffix), text)


def _cell(value: Any) -> Any:
    return "" if isinstance(value, float) and not math.isfinite(value) else value
