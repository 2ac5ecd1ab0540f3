"""The bench's thread: it alone touches rig, camera and loop; everybody else leaves orders.

An order runs until it ends or is stopped; small errands (recording on and off) run between two frames. What
the page says is judged in `orders.py`; what is seen goes into the `Feed`. The emergency stop does not come
through here: `trip` goes straight to the line, in the caller's thread.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

from tubefoot.dashboard.benches import Bench
from tubefoot.dashboard.brake import Brake
from tubefoot.dashboard.bulletin import Log, description, sample_row, trouble, troubles
from tubefoot.dashboard.eye import Shown, angle_row
from tubefoot.dashboard.feed import Feed, Sight
from tubefoot.dashboard.helm import Helm
from tubefoot.dashboard.leash import Leash
from tubefoot.dashboard.logbook import Logbook
from tubefoot.dashboard.motions import FingerPlans
from tubefoot.dashboard.questions import Questions
from tubefoot.dashboard.watched_rig import WatchedRig
from tubefoot.errors import ConfigError, LinkError, SafetyStop, TubefootError
from tubefoot.lab.rig import Reading
from tubefoot.vision.camera import EndOfFrames
from tubefoot.vision.finger import FingerReading

FRAME_S = 1 / 30
AGAIN_S = 1.0
"""A lost line is tried again so often [s]."""
NAN = float("nan")


class Order(Protocol):
    """Something that the bench is to do."""

    @property
    def kind(self) -> str:
        """A word for the page."""

    @property
    def text(self) -> str:
        """What it does, for people."""

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it, for people; raises a TubefootError when it failed.

        session : where it runs
        rig : to work with
        """


class Session:
    """One bench, from its opening to its closing.

    feed : what is seen
    helm : who is in control
    log : recordings and traces
    plans : what the controllers know of the finger
    questions : to the person at the page
    target_at : wanted bend [rad] at a time [s], nan where there is none
    """

    def __init__(
        self,
        opening: Callable[[Shown], AbstractContextManager[Bench]],
        feed: Feed,
        helm: Helm,
        log: Logbook,
        plans: FingerPlans,
    ):
        """Prepare; nothing is opened before `start`.

        opening : opens the bench, told where its frames are shown
        feed : to show in
        helm : asked whether the page in control still lives
        log : to record in
        plans : of the finger on the bench
        """
        self.feed, self.helm, self.log, self.plans = feed, helm, log, plans
        self.questions = Questions(feed)
        self.target_at: Callable[[float], float] = lambda time: NAN
        self._opening = opening
        self._bench: Bench | None = None
        self._orders: queue.SimpleQueue[tuple[Order, bool]] = queue.SimpleQueue()
        self._errands: deque[Callable[[], None]] = deque()
        self._busy = threading.Event()
        self._ended = threading.Event()
        self._ready = threading.Event()
        self._fault: BaseException | None = None
        self._leash = Leash(helm, self._tripped, self._ended.is_set)
        self._line_fault = self._camera_fault = ""
        self._brake = Brake(lambda: self.bench.line, self._leash, feed, self.note)
        self._log = Log(feed)
        self._giving = threading.Lock()
        self._thread = threading.Thread(target=self._live, name="bench", daemon=True)

    @property
    def bench(self) -> Bench:
        """The open bench; raises LinkError when there is none."""
        if self._bench is None:
            raise LinkError("the bench is not open")
        return self._bench

    @property
    def busy(self) -> bool:
        """Whether an order runs or waits."""
        return self._busy.is_set()

    # ---- from other threads --------------------------------------------------------------------------------

    def start(self) -> None:
        """Open the bench and begin; raises what its opening raised."""
        self.feed.tell(phase="opening", order=None, notes=[], stop={"tripped": False}, question=None)
        self._thread.start()
        self._ready.wait()
        if self._fault is not None:
            raise self._fault

    def close(self) -> None:
        """Stop the pump, end the recording, close the bench."""
        self._ended.set()
        self._thread.join(timeout=10)

    def give(self, order: Order, goes_on: bool = False) -> None:
        """Begin an order; raises ConfigError while another runs, SafetyStop under the emergency stop.

        order : to be run
        goes_on : whether it goes on when the page in control is lost
        """
        with self._giving:
            if self.busy:
                raise ConfigError("the bench is busy; stop what runs, or wait for its end")
            self._leash.loosen()  # before the look at the line: a stop that comes later pulls again
            if self.bench.line.tripped:
                raise SafetyStop("the emergency stop is in force; release it first")
            self._busy.set()
            self._orders.put((order, goes_on))

    def stop(self, reason: str) -> None:
        """End what runs, at the next frame.

        reason : for the record
        """
        if self.busy:
            self._leash.pull(reason)

    def keep_going(self, goes_on: bool) -> None:
        """Change whether what runs goes on when the page in control is lost.

        goes_on : or not
        """
        self._leash.goes_on = goes_on
        self.feed.tell(goes_on=goes_on)

    def errand(self, what: Callable[[], None]) -> None:
        """Have something small done by the bench's thread between two frames.

        what : done once; what it raises is noted
        """
        self._errands.append(what)

    def trip(self, who: str) -> str:
        """Stop the pump now, past everything; what came of it.

        who : asked for it
        """
        return self._brake.pull(who)

    def release(self) -> None:
        """Let the pump run again; raises SafetyStop while Stop is still being sent."""
        self._brake.release()

    def note(self, level: str, text: str) -> None:
        """Write a line into the page's log.

        level : info, good, warning, alarm
        text : what happened
        """
        self._log.write(self._now(), level, text)

    def _now(self) -> float:
        return self._bench.rig.clock.now() if self._bench else 0.0

    # ---- the bench's thread --------------------------------------------------------------------------------

    def _live(self) -> None:
        try:
            with self._opening(self._show) as bench, contextlib.ExitStack() as stack:
                self._bench = bench
                stack.callback(self.log.close)
                bench.rig.on_reading = self._sampled
                self._describe(bench)
                self._ready.set()
                while not self._ended.is_set():
                    self._turn(bench)
        except BaseException as error:
            self._fault = error
            self.feed.tell(phase="broken", trouble=[trouble("the bench broke down", str(error))])
            if not isinstance(error, TubefootError) and self._ready.is_set():
                raise
        finally:
            self._bench = None
            self._ready.set()

    def _turn(self, bench: Bench) -> None:
        """One order, or one idle frame."""
        try:
            order, self._leash.goes_on = self._orders.get_nowait()
        except queue.Empty:
            self._idle(bench)
            return
        told = {"kind": order.kind, "text": order.text}
        self.feed.tell(phase="running", order=told, goes_on=self._leash.goes_on)
        level, said = self._run(order, bench)
        self.target_at = lambda time: NAN
        self.note(level, f"{order.text}: {said}")
        self.feed.tell(phase="idle", order=None, question=None, result={"level": level, "text": said})
        self._busy.clear()

    def _run(self, order: Order, bench: Bench) -> tuple[str, str]:
        rig = WatchedRig(bench.rig, self._check, self.look)
        self._leash.running = True
        try:
            return "good", order.run(self, rig)
        except TubefootError as error:
            return "warning", str(error)
        except Exception as error:  # the bench must outlive any order, but never silently
            return "alarm", f"unexpected {type(error).__name__}: {error}; report this with the recording"
        finally:
            self._leash.running = False
            with contextlib.suppress(LinkError):
                bench.rig.stop()

    def _idle(self, bench: Bench) -> None:
        """Show one frame; come back when the line was lost."""
        self._do_errands()
        if self.helm.lost:
            self.helm.forget_lost()
            self.tell_pages()
        try:
            self.look()
            bench.rig.wait(1e-3)
            bench.rig.read()
            self._line_fault = ""
        except LinkError as error:
            self._line_fault = str(error)
            self._tell_troubles()
            self._come_back(bench)

    def _come_back(self, bench: Bench) -> None:
        bench.rig.clock.sleep(AGAIN_S)
        with contextlib.suppress(LinkError):
            bench.rig.connect()
            self.note("warning", "connected again; let the finger come to rest, then zero")

    def _check(self) -> None:
        """Between two frames of an order."""
        self._do_errands()
        self._leash.check()

    def _do_errands(self) -> None:
        while self._errands:
            try:
                self._errands.popleft()()
            except TubefootError as error:
                self.note("warning", str(error))

    def look(self) -> FingerReading | None:
        """Take one frame of the camera, None where there is none; without a camera a frame's time passes."""
        angles, reading, fault = self.bench.angles, None, ""
        try:
            if angles is None:
                self.bench.rig.wait(FRAME_S)
            else:
                reading = angles.read()
        except EndOfFrames:
            fault = "the camera's frames have ended"
        except LinkError as error:
            if angles is None:
                raise
            fault = str(error)
        self._camera_fault = fault
        self._tell_troubles()
        return reading

    # ---- what is seen --------------------------------------------------------------------------------------

    def _show(self, reading: FingerReading, sight: Sight) -> None:
        """A frame, read by whoever steers."""
        self.feed.angle(angle_row(reading, self.target_at(reading.time_s)))
        self.feed.sight(sight)
        self.log.frame(reading, sight, self._now())
        if self._bench is not None:
            self._bench.rig.wait(0.0)  # takes in what came, and lets go of readings that nobody waits for
        self._leash.check()

    def _sampled(self, reading: Reading) -> None:
        self.feed.sample(sample_row(reading))

    def _tell_troubles(self) -> None:
        self.feed.tell(trouble=troubles(self.bench.rig.faults, self._line_fault, self._camera_fault))

    def _tripped(self) -> bool:
        return self._bench is not None and self._bench.line.tripped

    def tell_pages(self) -> None:
        """Say anew who is in control."""
        self.feed.tell(holder=self.helm.holder, pages=len(self.helm.pages()))

    def _describe(self, bench: Bench) -> None:
        self.feed.tell(
            phase="idle",
            bench=description(bench),
            heartbeat_s=self.helm.heartbeat_s,
            trouble=[],
            goes_on=False,
            result=None,
            recording=None,
        )
        self.tell_pages()
