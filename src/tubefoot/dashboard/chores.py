"""What the page can order beside motions: pulses by hand, zero, clearing faults; recordings on and off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from tubefoot.config import Settings
from tubefoot.dashboard.watched_rig import WatchedRig
from tubefoot.errors import LinkError
from tubefoot.lab.sensing import measure_neutral

if TYPE_CHECKING:
    from tubefoot.dashboard.session import Session

END_S = 3.0
"""How long the board may take to tell that a pulse has ended [s]."""


class PulseOrder(Settings):
    """Run the pump once, by hand."""

    do: Literal["pulse"]
    direction: Literal[1, -1]
    """1 forward, into the right chamber; -1 reverse"""
    duty: float = Field(default=0.6, gt=0, le=1)
    """share of full speed"""
    duration_s: float = Field(default=0.2, ge=0.001, le=10)
    """how long"""

    kind: ClassVar[str] = "pulse"

    @property
    def text(self) -> str:
        """For people."""
        way = "forward" if self.direction > 0 else "reverse"
        return f"pump {way}, duty {self.duty:g}, {self.duration_s:g} s"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        sent = rig.pulse(self.direction, self.duty, self.duration_s)
        rig.wait(sent.duration)
        deadline = rig.clock.now() + END_S
        while (ended := rig.last_pulse) is None and rig.clock.now() < deadline:
            rig.wait(0.05)
        if ended is None:
            raise LinkError("the board did not tell the pulse's end")
        return f"ran {ended.duration:.3f} s, {ended.reason.name.lower().replace('_', ' ')}"


class ZeroOrder(Settings):
    """Take the present pressures as zero; the finger is straight and at rest."""

    do: Literal["zero"]

    kind: ClassVar[str] = "zero"
    text: ClassVar[str] = "take this as zero"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        neutral = measure_neutral(rig)
        return f"zero from {neutral.samples} samples"


class ClearOrder(Settings):
    """Clear the board's latched faults."""

    do: Literal["clear"]

    kind: ClassVar[str] = "clear"
    text: ClassVar[str] = "clear faults"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        rig.wait(0.1)  # a cause that has just been mended is still in the board's last samples
        rig.clear_faults()
        rig.wait(0.1)
        return "cleared"


def begin_recording(session: Session, pictures: bool, directory: Path | None = None) -> None:
    """Begin a recording; on the bench's thread.

    session : to be recorded
    pictures : whether camera frames are recorded
    directory : where it goes; that of the session if not given
    """
    path = session.log.begin(session.bench, pictures, directory)
    session.feed.tell(recording=str(path))
    session.note("info", f"recording into {path}")


def end_recording(session: Session) -> None:
    """End the recording; on the bench's thread, and not while a motion writes into it.

    session : that is recorded
    """
    path = session.log.end()
    session.feed.tell(recording=None)
    session.note("info", f"recorded: {path}")
