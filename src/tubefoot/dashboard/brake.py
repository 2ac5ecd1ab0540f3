"""The emergency stop of a session: straight to the line in the caller's thread, and its release.

Stop goes out several times, which takes a while. A release waits until the last of them is out, so that what
the pages are told, the line and the running order are always of one mind.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from tubefoot.dashboard.feed import Feed
from tubefoot.dashboard.leash import Leash
from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab.emergency import EmergencyLine

PATIENCE_S = 5.0
"""Longest wait of a release for a stop that is still being sent [s]."""

Note = Callable[[str, str], None]


class Brake:
    """Stops the pump from any thread, past everything, and lets it run again."""

    def __init__(self, line: Callable[[], EmergencyLine], leash: Leash, feed: Feed, note: Note):
        """Begin released.

        line : the open bench's; raises LinkError when there is none
        leash : holds the order that runs
        feed : tells the pages whether the stop is in force
        note : writes a line into the log, of a level and a text
        """
        self._line, self._leash, self._feed, self._note = line, leash, feed, note
        self._sending = 0
        self._change = threading.Condition()

    def pull(self, who: str) -> str:
        """Stop the pump now; what came of it.

        who : asked for it
        """
        with self._change:  # held for moments only, never while something is sent
            self._sending += 1
        try:
            answer = self._sent()
            with self._change:
                self._leash.pull("emergency stop")  # for an order that looks only after the release
                if not (self._feed.status.get("stop") or {}).get("tripped"):  # a page asks in two ways
                    self._note("alarm", f"emergency stop ({who}): {answer}")
                self._feed.tell(stop={"tripped": True, "who": who, "answer": answer})
        finally:
            with self._change:
                self._sending -= 1
                self._change.notify_all()
        return answer

    def release(self) -> None:
        """Let the pump run again; raises SafetyStop while Stop is still being sent."""
        with self._change:
            if not self._change.wait_for(lambda: not self._sending, PATIENCE_S):
                raise SafetyStop("the emergency stop is still being sent; look at the line, then try again")
            self._line().release()
            self._feed.tell(stop={"tripped": False})
            self._note("info", "emergency stop released")

    def _sent(self) -> str:
        """What came of sending Stop; the line is closed for pulses either way."""
        try:
            return f"sent {self._line().trip()} times"
        except LinkError as error:
            return f"not sent ({error}); the board stops by itself when it hears nothing"
