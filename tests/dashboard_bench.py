"""A dashboard before a virtual bench, in this process: tests see its truth and its firmware's pins."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

from tubefoot.control.creep import creep_law
from tubefoot.control.settings import BendSettings
from tubefoot.dashboard.access import Access
from tubefoot.dashboard.benches import virtual_bench
from tubefoot.dashboard.desk import Desk
from tubefoot.dashboard.feed import Feed
from tubefoot.dashboard.finger_model import finger_model
from tubefoot.dashboard.helm import Helm
from tubefoot.dashboard.logbook import Logbook
from tubefoot.dashboard.motions import FingerPlans
from tubefoot.dashboard.serving import Dashboard
from tubefoot.dashboard.session import Session
from tubefoot.design.finger import FingerDesign
from tubefoot.lab.settings import RigSettings
from tubefoot.reduced.files import reference_file
from tubefoot.twin.bench import VirtualBench

TOKEN = "a-token-that-only-this-test-knows"
PACES = 6000
PATIENCE_S = 120.0
"""A condition that has not come true by then never will, however busy the computer is [s]."""


class OpenBench:
    """A session with everything behind it."""

    def __init__(
        self,
        out: Path,
        pixels: bool,
        live: bool,
        helm: Helm,
        patience_s: float | None = None,
    ):
        self.pins: list[tuple[float, float, bool]] = []
        """Wall time [s], bench time [s], whether the pump has current: every change"""
        self.paces: deque[tuple[float, float]] = deque(maxlen=PACES)
        """Wall time and bench time, every hundredth of a second of the last minute [s]"""
        content = reference_file()
        finger = content.to_finger()
        largest = finger.n_units * finger.valid.angle
        plans = FingerPlans(creep_law(finger, content.to_prony()), BendSettings(), largest)
        rig = RigSettings()

        def opening(show):
            self.virtual = VirtualBench(board="native", rig_settings=rig, real_time=live)
            self._watch_pins()
            return virtual_bench(self.virtual, rig, show, pixels, patience_s)

        self.feed, self.helm = Feed(), helm
        self.session = Session(opening, self.feed, helm, Logbook(out), plans)
        self.desk = Desk(self.session)

    @property
    def pumping(self) -> bool:
        """Whether the firmware's pins drive the pump."""
        return self.virtual.port.board.pump_on

    def _watch_pins(self) -> None:
        before, board = self.virtual.port.on_step, self.virtual.port.board
        state = {"on": False, "due": 0.0}

        def look(now: float) -> None:
            before(now)
            if board.pump_on != state["on"]:
                state["on"] = board.pump_on
                self.pins.append((time.time(), now, board.pump_on))
            if now >= state["due"]:
                state["due"] = now + 0.01
                self.paces.append((time.time(), now))

        self.virtual.port.on_step = look

    def bench_time_at(self, wall: float) -> float:
        """The bench's time at a wall time [s]."""
        return min(self.paces, key=lambda pace: abs(pace[0] - wall))[1]

    def ended(self) -> str:
        """What the last order came to, after waiting for its end."""
        until(lambda: not self.session.busy)
        return self.feed.status["result"]["text"]


@contextmanager
def open_bench(out: Path, pixels: bool = False, live: bool = False, **more: Any) -> Iterator[OpenBench]:
    """A session without a server; as fast as it goes, and without pixels, unless asked otherwise."""
    bench = OpenBench(out, pixels, live, more.pop("helm", None) or Helm(2.0), **more)
    bench.session.start()
    try:
        yield bench
    finally:
        bench.session.close()


@contextmanager
def served(out: Path, pixels: bool = True, live: bool = True, port: int = 0, **more: Any) -> Iterator[Any]:
    """The bench and its dashboard, serving from a thread."""
    bench = OpenBench(out, pixels, live, more.pop("helm", None) or Helm(2.0), **more)
    model = finger_model(FingerDesign().with_bellows(units=12))
    shown = Dashboard(bench.desk, Access(TOKEN), model, "live", "127.0.0.1", port)
    try:
        bench.session.start()
        with serving(shown):
            yield bench, shown
    finally:
        shown.close()


@contextmanager
def serving(shown: Dashboard) -> Iterator[None]:
    """A dashboard's server in a thread of its own."""
    thread = threading.Thread(target=shown.serve, daemon=True)
    thread.start()
    try:
        yield
    finally:
        shown.stop()
        thread.join(timeout=20)


def until(condition: Any, patience_s: float = PATIENCE_S) -> Any:
    """What a condition gives once it is true; other threads make it so."""
    end = time.monotonic() + patience_s
    while not (found := condition()):
        if time.monotonic() > end:
            raise AssertionError("what was waited for did not come")
        time.sleep(0.005)
    return found


def free_port() -> int:
    """A port of the loopback that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def post(shown: Dashboard, path: str, body: Any, port: int | None = None, **headers: str) -> tuple[int, Any]:
    """Status and answer of a POST; headers with underscores for dashes, None leaves one out."""
    own = int(shown.origin.rsplit(":", 1)[1])
    line = HTTPConnection("127.0.0.1", port or own, timeout=60)
    sent = {"Content-Type": "application/json", "X-Tubefoot-Token": TOKEN, "X-Tubefoot-Page": "test"}
    sent |= {key.replace("_", "-"): value for key, value in headers.items()}
    data = body if isinstance(body, str) else json.dumps(body)
    line.request("POST", path, data, {key: value for key, value in sent.items() if value is not None})
    answer = line.getresponse()
    text = answer.read().decode()
    line.close()
    return answer.status, json.loads(text) if text.startswith("{") else text
