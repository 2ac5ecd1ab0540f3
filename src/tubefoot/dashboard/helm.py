"""Who holds control: one page steers, the others watch; a page that falls silent loses it.

A page beats like a heart as long as it lives (`static/heart.js`). When the heart of the page at the helm
stops for longer than `heartbeat_s`, what it had started is stopped, unless it said that the run is to go on.
A page that is heard again, after a computer that was too busy or asleep, has its control back unless another
took it meanwhile.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable


class Helm:
    """Control of one bench.

    heartbeat_s : a page is lost when it has not been heard for so long [s]
    """

    def __init__(self, heartbeat_s: float, now: Callable[[], float] = time.monotonic):
        """Begin with nobody in control.

        heartbeat_s : longest silence of a page [s]
        now : the time [s]
        """
        self.heartbeat_s = heartbeat_s
        self._now = now
        self._lock = threading.Lock()
        self._heard: dict[str, float] = {}
        self._holder = self._lost_holder = ""

    @property
    def holder(self) -> str:
        """Name of the page in control, empty when there is none; it may be lost."""
        return self._holder

    @property
    def lost(self) -> bool:
        """Whether a page is in control and has fallen silent."""
        with self._lock:
            return bool(self._holder) and not self._lives(self._holder)

    def pages(self) -> list[str]:
        """Names of the pages that are alive, in the order in which they came."""
        with self._lock:
            return [page for page in self._heard if self._lives(page)]

    def beat(self, page: str) -> None:
        """Hear a page; one that was lost at the helm is there again if nobody else is.

        page : its name
        """
        with self._lock:
            self._heard[page] = self._now()
            if not self._holder and page == self._lost_holder:
                self._holder, self._lost_holder = page, ""

    def take(self, page: str) -> bool:
        """Whether a page has control now: it is granted when no other living page has it.

        page : its name
        """
        with self._lock:
            if self._holder in ("", page) or not self._lives(self._holder):
                self._holder, self._lost_holder = page, ""
            return self._holder == page

    def give(self, page: str) -> None:
        """Give control back; nothing happens to that of another.

        page : its name
        """
        with self._lock:
            if self._holder == page:
                self._holder = ""

    def forget_lost(self) -> None:
        """Take control from a lost page, and drop pages that have long been silent."""
        with self._lock:
            if self._holder and not self._lives(self._holder):
                self._holder, self._lost_holder = "", self._holder
            patience = self._now() - 10 * self.heartbeat_s
            self._heard = {page: heard for page, heard in self._heard.items() if heard > patience}

    def _lives(self, page: str) -> bool:
        return self._now() - self._heard.get(page, float("-inf")) <= self.heartbeat_s
