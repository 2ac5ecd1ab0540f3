"""The emergency stop: from any thread straight to the line, past whatever hangs.

`EmergencyLine` is a port around the port. A link writes through it as ever; `trip` closes it for pulses first
and then sends Stop by itself. The board obeys Stop out of sequence, so it matters neither what the link was
doing nor whether its thread still lives; a half-written frame before it is dropped by the board. A host that
does not even come to that is silent, and the board stops the pump by itself (`limits.silence_ms`).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence

from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab.clock import Clock
from tubefoot.lab.codec import FrameDecoder, encode
from tubefoot.lab.messages import Ping, Pulse, Stop
from tubefoot.lab.port import Port, Received

REPEATS_S = (0.0, 0.02, 0.05)
"""Pauses before each sending of Stop [s]: a frame may be lost on the way."""
TURN_S = 0.02
"""How long to wait for a thread that is writing just now; one that hangs there is overtaken [s]."""
OUTSIDE = 128
"""From the newest sequence number: outside the board's window, so that the link's count stays valid."""


class EmergencyLine:
    """A port that can be closed for pulses, and that says Stop, from any thread.

    name : that of the port
    """

    def __init__(self, port: Port, repeats_s: Sequence[float] = REPEATS_S):
        """Wrap a port.

        port : where the board is
        repeats_s : pauses before each sending of Stop [s]
        """
        self.name = port.name
        self._port = port
        self._repeats = tuple(repeats_s)
        self._turn = threading.Lock()
        self._tripped = threading.Event()
        self._sequence = 0

    @property
    def clock(self) -> Clock:
        """The clock that stamps what comes."""
        return self._port.clock

    @property
    def tripped(self) -> bool:
        """Whether the stop is in force."""
        return self._tripped.is_set()

    def open(self) -> None:
        """Open the port."""
        self._port.open()

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def read(self, timeout: float) -> Received:
        """What has come.

        timeout : longest wait [s]
        """
        return self._port.read(timeout)

    def write(self, data: bytes) -> None:
        """Send a frame; raises SafetyStop for a pulse while the stop is in force.

        data : its bytes
        """
        with self._turn:
            for frame in FrameDecoder().feed(data):
                if not isinstance(frame.message, Ping):  # signs of life have a count of their own
                    self._sequence = frame.sequence
                if self.tripped and isinstance(frame.message, Pulse):
                    raise SafetyStop("the emergency stop is in force; release it before the pump may run")
            self._port.write(data)

    def trip(self) -> int:
        """How many Stop frames went out, after closing the line for pulses.

        Raises LinkError when the line is gone; the board then stops by silence.
        """
        self._tripped.set()
        sent, fault = 0, LinkError(f"{self.name}: nothing could be sent")
        for pause in self._repeats:
            time.sleep(pause)
            try:
                self._say_stop()
            except LinkError as error:
                fault = error
            else:
                sent += 1
        if not sent:
            raise fault
        return sent

    def release(self) -> None:
        """Let pulses pass again."""
        self._tripped.clear()

    def _say_stop(self) -> None:
        """Write one Stop frame, in turn where the other writer is quick."""
        frame = encode(Stop(), (self._sequence + OUTSIDE) % 256)
        mine = self._turn.acquire(timeout=TURN_S)
        try:
            self._port.write(frame)
        finally:
            if mine:
                self._turn.release()
