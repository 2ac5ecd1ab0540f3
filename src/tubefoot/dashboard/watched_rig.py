"""The rig as the page's orders see it: each call first asks whether the order still stands."""

from __future__ import annotations

from collections.abc import Callable

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.clock import Clock
from tubefoot.lab.messages import Fault
from tubefoot.lab.rig import EndedPulse, Neutral, Reading, RigLimits, SentPulse

LOOK_S = 0.12
"""A wait longer than this leaves time to look at a camera frame meanwhile [s]."""


class WatchedRig:
    """A rig for whatever runs on the bench's thread; `Rig` says what its methods promise.

    Waiting goes on looking at the camera. `check` raises SafetyStop when the order is to end.
    """

    def __init__(self, rig: BoardRig, check: Callable[[], None], look: Callable[[], object]):
        """Wrap a rig.

        rig : connected
        check : raises when the order is to end
        look : takes one frame of the camera, and time with it
        """
        self._rig = rig
        self._check = check
        self._look = look

    @property
    def clock(self) -> Clock:
        """The bench's time."""
        return self._rig.clock

    @property
    def limits(self) -> RigLimits:
        """What the bench will do at most."""
        return self._rig.limits

    @property
    def faults(self) -> Fault:
        """Latched faults."""
        return self._rig.faults

    @property
    def last_pulse(self) -> EndedPulse | None:
        """How the last pulse ended."""
        return self._rig.last_pulse

    def connect(self) -> None:
        """Begin a session anew."""
        self._rig.connect()

    def close(self) -> None:
        """Stop the pump; the session belongs to the bench's thread and goes on."""
        self._rig.stop()

    def read(self) -> Reading:
        """The newest reading."""
        self._check()
        return self._rig.read()

    def wait(self, seconds: float) -> list[Reading]:
        """The readings that came while time passed and frames were looked at.

        seconds : how long [s]
        """
        deadline = self.clock.now() + seconds
        came: list[Reading] = []
        before, self._rig.on_reading = self._rig.on_reading, _both(self._rig.on_reading, came.append)
        try:
            while (left := deadline - self.clock.now()) > LOOK_S:
                self._check()
                self._look()
                self._rig.wait(min(1e-3, max(0.0, left)))
            self._check()
            self._rig.wait(left)
        finally:
            self._rig.on_reading = before
        return came

    def pulse(self, direction: int, duty: float, duration: float) -> SentPulse:
        """What was really sent.

        direction : 1 forward, -1 reverse
        duty : 0 to 1
        duration : [s]
        """
        self._check()
        return self._rig.pulse(direction, duty, duration)

    def stop(self) -> None:
        """Stop the pump now."""
        self._rig.stop()

    def clear_faults(self) -> None:
        """Clear the latched faults."""
        self._rig.clear_faults()

    def set_neutral(self, neutral: Neutral) -> None:
        """Take a reading as zero.

        neutral : the reading
        """
        self._rig.set_neutral(neutral)


def _both(first: Callable[[Reading], None], second: Callable[[Reading], None]) -> Callable[[Reading], None]:
    def call(reading: Reading) -> None:
        first(reading)
        second(reading)

    return call
