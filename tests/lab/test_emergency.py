"""The emergency stop reaches the firmware whatever the host's thread does, and keeps the line in order."""

import threading
from contextlib import contextmanager

import pytest

from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.emergency import EmergencyLine
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench import VirtualBench


@contextmanager
def bench():
    with VirtualBench(board="native") as virtual:
        line = EmergencyLine(virtual.port, repeats_s=(0.0, 0.0))
        rig = BoardRig(line, RigSettings())
        rig.connect()
        try:
            yield virtual, line, rig
        finally:
            rig.close()


def test_trip_stops_the_pump_at_the_pin_without_the_rigs_help():
    with bench() as (virtual, line, rig):
        rig.pulse(1, 0.8, 3.0)
        rig.wait(0.2)
        assert virtual.port.board.pump_on
        began = virtual.clock.now()
        other = threading.Thread(target=line.trip)
        other.start()
        other.join()
        while virtual.port.board.pump_on:
            virtual.port.advance()  # only time passes; nobody serves the link
        assert virtual.clock.now() - began < 0.02


def test_no_pulse_passes_until_release_and_the_link_keeps_its_count():
    with bench() as (virtual, line, rig):
        for _ in range(3):
            rig.pulse(1, 0.5, 0.01)
            rig.wait(0.1)
        line.trip()
        rig.wait(0.1)
        with pytest.raises(SafetyStop, match="emergency stop"):
            rig.pulse(-1, 0.5, 0.2)
        rig.wait(0.3)
        assert not virtual.port.board.pump_on
        line.release()
        sent = rig.pulse(-1, 0.5, 0.05)
        rig.wait(0.2)
        assert rig.last_pulse is not None
        assert rig.last_pulse.duration == pytest.approx(sent.duration, abs=2e-3)


def test_pings_do_not_mislead_the_stops_number():
    """A Stop numbered inside the board's window would make the link's next command stale."""
    with bench() as (_, line, rig):
        for _ in range(160):  # the count of the pings runs ahead of that of the commands, by 128 and more
            rig.link.ping()
            rig.wait(0.002)
            line.trip()
            line.release()
        rig.pulse(1, 0.5, 0.01)
        rig.wait(0.1)


def test_a_writer_that_hangs_is_overtaken():
    with bench() as (virtual, line, rig):
        rig.pulse(1, 0.8, 3.0)
        held = threading.Event()
        leave = threading.Event()
        real = virtual.port.write

        def hang(data):
            if threading.current_thread().name == "hung":
                held.set()
                leave.wait(10)
                return
            real(data)

        virtual.port.write = hang
        hung = threading.Thread(target=lambda: line.write(b"\0"), name="hung")
        hung.start()
        held.wait(10)
        line.trip()
        virtual.clock.sleep(0.02)
        assert not virtual.port.board.pump_on
        leave.set()
        hung.join()


def test_a_lost_line_is_told_and_stays_shut():
    with bench() as (virtual, line, rig):
        virtual.port.unplug(True)
        with pytest.raises(LinkError, match="unplugged"):
            line.trip()
        virtual.port.unplug(False)
        rig.connect()
        with pytest.raises(SafetyStop):
            rig.pulse(1, 0.5, 0.1)
