"""What may end an order from outside: the stop button, the emergency stop, a lost page, the program's end."""

from __future__ import annotations

from collections.abc import Callable

from tubefoot.dashboard.helm import Helm
from tubefoot.errors import SafetyStop


class Leash:
    """Holds the order that runs; pulled from any thread, felt by the bench's between two frames.

    running : whether an order runs
    goes_on : whether it goes on when the page in control is lost
    """

    def __init__(self, helm: Helm, tripped: Callable[[], bool], ended: Callable[[], bool]):
        """Take hold of the reasons.

        helm : knows whether the page in control lives
        tripped : whether the emergency stop is in force
        ended : whether the program ends
        """
        self.running = self.goes_on = False
        self._helm = helm
        self._tripped = tripped
        self._ended = ended
        self._pulled = ""

    def loosen(self) -> None:
        """Forget an earlier pull; before a new order."""
        self._pulled = ""

    def pull(self, reason: str) -> None:
        """End the order at its next frame.

        reason : for the record
        """
        self._pulled = reason

    def check(self) -> None:
        """Raise SafetyStop when the running order is to end."""
        if not self.running:
            return
        if self._tripped():
            raise SafetyStop("emergency stop")
        if self._pulled:
            raise SafetyStop(self._pulled)
        if self._ended():
            raise SafetyStop("the dashboard was ended")
        if self._helm.lost and not self.goes_on:
            raise SafetyStop(f"the page in control was not heard for {self._helm.heartbeat_s:g} s")
