"""The bench on a serial port, without a camera: the simulated board behind a pseudo-terminal."""

import pytest
from tests.dashboard_bench import until

from tubefoot.control.creep import creep_law
from tubefoot.control.settings import BendSettings
from tubefoot.dashboard.benches import real_bench
from tubefoot.dashboard.desk import Desk
from tubefoot.dashboard.feed import Feed
from tubefoot.dashboard.helm import Helm
from tubefoot.dashboard.logbook import Logbook
from tubefoot.dashboard.motions import FingerPlans
from tubefoot.dashboard.session import Session
from tubefoot.lab.messages import Fault
from tubefoot.lab.settings import RigSettings
from tubefoot.reduced.files import reference_file
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import SimulatedBoard
from tubefoot.twin.processor import NativeCore
from tubefoot.twin.pty_board import PtyBoard


@pytest.fixture
def bench(tmp_path):
    content = reference_file()
    plans = FingerPlans(creep_law(content.to_finger(), content.to_prony()), BendSettings(), 1.0)
    with PtyBoard(SimulatedBoard(BenchPlant(), NativeCore())) as port:
        rig = RigSettings().on_port(port.name)

        def opening(show):
            return real_bench(rig, show, "0", None, None)

        session = Session(opening, Feed(), Helm(1e9), Logbook(tmp_path), plans)
        desk = Desk(session)
        desk.start()
        desk.beat("me")
        desk.do("me", {"do": "take"})
        yield port, session, desk
        desk.close()


def ended(session):
    until(lambda: not session.busy)
    return session.feed.status["result"]["text"]


def test_pump_stop_and_emergency_stop_over_the_port(bench):
    port, session, desk = bench
    desk.do("me", {"do": "pulse", "direction": 1, "duty": 0.5, "duration_s": 10})
    until(lambda: port.board.pump_on)
    desk.do("me", {"do": "stop"})
    until(lambda: not port.board.pump_on)
    assert "stopped from the page" in ended(session)
    desk.do("me", {"do": "pulse", "direction": -1, "duty": 0.5, "duration_s": 10})
    until(lambda: port.board.pump_on)
    desk.trip("a test")
    until(lambda: not port.board.pump_on)
    assert "emergency stop" in ended(session)
    assert not session.bench.rig.faults & Fault.SILENCE
    desk.do("me", {"do": "release"})


def test_closed_loop_asks_for_a_camera(bench):
    _, session, desk = bench
    assert not session.feed.status["bench"]["camera"]
    desk.do("me", {"do": "bend", "target_deg": 5})
    assert "needs the camera" in ended(session)


def test_a_restarted_board_is_told_and_comes_back(bench):
    port, session, desk = bench
    port.reset()  # the board restarts: its session is gone, its samples stop
    trouble = until(lambda: session.feed.status["trouble"])
    assert trouble[0]["what"] == "no answer from the board"
    until(lambda: not session.feed.status["trouble"])
    desk.do("me", {"do": "pulse", "direction": 1, "duty": 0.5, "duration_s": 0.1})
    assert "completed" in ended(session)
