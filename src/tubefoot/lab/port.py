"""Where bytes go in and out: the contract, and a serial port that fulfils it."""

from __future__ import annotations

import queue
import threading
from dataclasses import dataclass
from typing import Protocol

from tubefoot.errors import LinkError
from tubefoot.lab.clock import Clock, SystemClock
from tubefoot.lab.messages import BAUD


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes and the time [s] at which they came; no bytes when the wait was in vain."""

    time: float
    data: bytes


class Port(Protocol):
    """A byte stream to a board. Every method raises LinkError when the line is gone."""

    name: str

    @property
    def clock(self) -> Clock:
        """The clock that stamps what comes."""

    def open(self) -> None:
        """Open the line, again if it was open."""

    def close(self) -> None:
        """Close the line; closing twice is no error."""

    def write(self, data: bytes) -> None:
        """Send.

        data : bytes
        """

    def read(self, timeout: float) -> Received:
        """What has come, waiting for it no longer than needed.

        timeout : longest wait [s], 0 for none
        """


class SerialPort:
    """A serial port (`/dev/ttyACM0`, `COM3`, a pty) with a thread that notes when bytes came."""

    def __init__(self, name: str, clock: Clock | None = None):
        """Name the port; nothing is opened yet.

        name : the operating system's name of the port
        clock : clock to stamp bytes with
        """
        self.name = name
        self._clock = clock or SystemClock()
        self._serial: object | None = None
        self._thread: threading.Thread | None = None
        self._inbox: queue.SimpleQueue[Received | Exception] = queue.SimpleQueue()

    @property
    def clock(self) -> Clock:
        """The clock that stamps what comes."""
        return self._clock

    def open(self) -> None:
        """Open the port at the board's speed; on an Uno this restarts the board."""
        import serial

        self.close()
        self._inbox = queue.SimpleQueue()
        try:
            opened = serial.Serial(self.name, BAUD, timeout=0.05, write_timeout=0.5)
        except (serial.SerialException, OSError, ValueError) as error:
            raise LinkError(
                f"{self.name}: cannot be opened: {error}; check the cable, the name "
                "(`ls /dev/ttyACM* /dev/ttyUSB*`) and that your user may use it (group `dialout`)"
            ) from error
        self._serial = opened
        self._thread = threading.Thread(
            target=self._listen, args=(opened, self._inbox), name=f"listen {self.name}", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Close the port."""
        opened, self._serial = self._serial, None
        if opened is None:
            return
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join(timeout=1.0)
        opened.close()  # type: ignore[attr-defined]

    def write(self, data: bytes) -> None:
        """Send.

        data : bytes
        """
        if self._serial is None:
            raise LinkError(f"{self.name}: the port is closed")
        try:
            self._serial.write(data)  # type: ignore[attr-defined]
        except OSError as error:  # SerialException is one
            raise LinkError(f"{self.name}: lost while sending: {error}") from error

    def read(self, timeout: float) -> Received:
        """What has come since the last call.

        timeout : longest wait for a first byte [s]
        """
        if self._serial is None:
            raise LinkError(f"{self.name}: the port is closed")
        try:
            first = self._inbox.get(timeout=timeout) if timeout > 0 else self._inbox.get_nowait()
        except queue.Empty:
            return Received(self.clock.now(), b"")
        if isinstance(first, Exception):
            self.close()
            raise LinkError(f"{self.name}: lost while receiving: {first}") from first
        return first

    def _listen(self, opened: object, inbox: queue.SimpleQueue[Received | Exception]) -> None:
        while self._serial is opened:
            try:
                data = opened.read(1)  # type: ignore[attr-defined]
                if data:
                    data += opened.read(opened.in_waiting)  # type: ignore[attr-defined]
                    inbox.put(Received(self.clock.now(), data))
            except (OSError, TypeError) as error:  # TypeError: closed under pyserial's read
                if self._serial is opened:
                    inbox.put(error)
                return
