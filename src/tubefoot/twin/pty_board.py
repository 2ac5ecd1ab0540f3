"""The simulated board behind a pseudo-terminal, free-running at the pace of the wall clock.

To the operating system it is a serial port: the host uses it through pyserial like a real one. The board
never runs faster than real time, and after a hold-up it goes on from where it was, without catching up: a
slow computer gives a slow board, not a host that seems silent.
"""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
import tty
from types import TracebackType

from tubefoot.errors import LinkError
from tubefoot.twin.board import Operation, SimulatedBoard


class PtyBoard:
    """Runs a simulated board in a thread; `name` is the port to open. Use it as a context manager.

    board : the board; read its state, but do not step it
    name : the terminal's name
    """

    def __init__(self, board: SimulatedBoard, head_start: float = 0.0):
        """Take over a board.

        board : stepped by this object from now on
        head_start : when positive, run so far at once [s] and then stand still until the first byte comes; a
            boot loader blinks for half a second before it listens, for another half
        """
        self.board = board
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self.last_byte_time = 0.0
        self._waiting = head_start > 0
        while board.time < head_start:
            board.step()
        self._stop = threading.Event()
        self._reset = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"board {self.name}", daemon=True)
        self._thread.start()

    def __enter__(self) -> PtyBoard:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def reset(self) -> None:
        """Press the reset button."""
        self._reset.set()

    def unplug(self) -> None:
        """Pull the cable: the port vanishes under the host; the board goes on unheard."""
        master, self._master = self._master, -1
        slave, self._slave = self._slave, -1
        for end in (master, slave):
            if end >= 0:
                os.close(end)

    def close(self) -> None:
        """Stop the board's time and remove the port."""
        self._stop.set()
        self._thread.join(timeout=10)
        self.unplug()

    def _run(self) -> None:
        while not self._stop.is_set():
            began = time.monotonic()
            with contextlib.suppress(OSError):
                self._take_bytes()
            if not self._waiting:
                try:
                    out = self.board.step(Operation.RESET if self._reset.is_set() else Operation.RUN)
                except LinkError:
                    return
                self._reset.clear()
                with contextlib.suppress(OSError):
                    if out and self._master >= 0:
                        os.write(self._master, out)
            ahead = self.board.step_s - (time.monotonic() - began)
            if ahead > 0:
                self._stop.wait(ahead)

    def _take_bytes(self) -> None:
        if self._master < 0 or not select.select([self._master], [], [], 0)[0]:
            return
        data = os.read(self._master, 4096)
        if data:
            self._waiting = False
            self.last_byte_time = self.board.time
            self.board.send(data)
