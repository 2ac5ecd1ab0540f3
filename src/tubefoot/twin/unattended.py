"""Time on the virtual bench goes on although the host hangs, as it does on a real one.

The bench's time passes while the host waits for it. A host that hangs would stop that time, and the pump
would seem to stand. Here a thread of its own lets time pass, at the wall clock's pace, once the host has not
done so for a while: the firmware then notices the silence, and an emergency stop from another thread is
obeyed.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from tubefoot.errors import LinkError
from tubefoot.twin.board import LockstepPort

HURRY_S = 0.05
"""Wall time without a step when there is reason to hurry [s]."""


class Unattended:
    """Watches over a port at the wall clock's pace; use it as a context manager."""

    def __init__(
        self,
        port: LockstepPort,
        patience_s: float,
        hurry: Callable[[], bool] = lambda: False,
    ):
        """Take over a port that nobody steps yet.

        port : with `real_time`
        patience_s : wall time without a step from which on time passes by itself [s]
        hurry : whether it passes sooner, as after an emergency stop
        """
        self._port = port
        self._patience = patience_s
        self._hurry = hurry
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="bench time", daemon=True)

    def __enter__(self) -> Unattended:
        self._port.turn = threading.Lock()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(timeout=5)

    def _watch(self) -> None:
        """Notice when nobody steps."""
        seen, moved = self._port.board.time, time.monotonic()
        while not self._ended.wait(HURRY_S / 5):
            now = self._port.board.time
            patience = HURRY_S if self._hurry() else self._patience
            if now != seen:
                seen, moved = now, time.monotonic()
            elif time.monotonic() - moved > patience:
                with contextlib.suppress(LinkError):  # the bench was switched off meanwhile
                    self._pass_time()

    def _pass_time(self) -> None:
        """Step until the host does so again."""
        board = self._port.board
        alone = True
        while alone and not self._ended.is_set():
            before = board.time
            self._port.advance()
            alone = board.time - before < 1.5 * board.step_s
