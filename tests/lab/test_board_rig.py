"""The rig over a line that fails: pulled cables, killed hosts, restarted boards, lost frames, limits."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from tubefoot.errors import ConfigError, LinkError, SafetyStop
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.messages import EndReason, Fault
from tubefoot.lab.port import SerialPort
from tubefoot.lab.settings import BoardSettings, LimitSettings, RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, Operation, SimulatedBoard
from tubefoot.twin.pty_board import PtyBoard

HOST = """
import sys
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.port import SerialPort
from tubefoot.lab.settings import RigSettings
rig = BoardRig(SerialPort(sys.argv[1]), RigSettings())
rig.connect()
rig.pulse(1, 0.5, 5.0)
print("pumping", flush=True)
rig.wait(60)
"""


@pytest.fixture
def board():
    with SimulatedBoard(BenchPlant()) as board:
        yield board


def connected(board, settings=None):
    rig = BoardRig(LockstepPort(board), settings or RigSettings())
    rig.connect()
    return rig


def run_until_off(board, longest):
    start = board.time
    while board.pump_on and board.time - start < longest:
        board.step()
    return board.time - start


def test_a_pulled_cable_stops_the_pump_and_the_rig_connects_again(board):
    rig = connected(board)
    rig.pulse(1, 0.5, 5.0)
    rig.wait(0.3)
    rig.link.port.unplugged = True
    with pytest.raises(LinkError, match="unplugged"):
        rig.wait(1.0)
    assert run_until_off(board, 2.0) < 0.5
    with pytest.raises(LinkError, match="unplugged"):
        rig.connect()
    rig.link.port.unplugged = False
    rig.connect()
    assert rig.faults == Fault.SILENCE
    with pytest.raises(SafetyStop, match="silence: check the cable") as refusal:
        rig.pulse(1, 0.5, 0.1)
    assert refusal.value.code == Fault.SILENCE
    rig.clear_faults()
    volume = rig.read().pumped_volume
    # What ran unheard counts too: 0.3 s, and 0.4 s of silence since the last ping, at most 0.1 s before.
    assert 0.59 < volume / (1.5e3 * (0.5 - 0.15) / 0.85) < 0.73
    rig.pulse(-1, 0.5, 0.1)
    rig.wait(0.2)
    assert rig.last_pulse.reason == EndReason.COMPLETED
    assert rig.read().pumped_volume < volume


def test_a_killed_host_stops_the_pump():
    with SimulatedBoard(BenchPlant()) as board, PtyBoard(board) as pty:
        host = subprocess.Popen([sys.executable, "-c", HOST, pty.name], stdout=subprocess.PIPE)
        assert host.stdout.readline() == b"pumping\n"
        host.send_signal(signal.SIGKILL)
        host.wait()
        host.stdout.close()
        for _ in range(400):
            if not board.pump_on:
                break
            time.sleep(0.02)
        assert not board.pump_on
        assert board.time - pty.last_byte_time < 5.0  # it stopped by silence, long before the pulse's end
        with_rig = BoardRig(SerialPort(pty.name), RigSettings())
        with_rig.connect()
        assert with_rig.faults == Fault.SILENCE
        with_rig.close()


def test_a_port_that_vanishes_is_an_error_and_the_pump_stops():
    with SimulatedBoard(BenchPlant()) as board, PtyBoard(board) as pty:
        rig = BoardRig(SerialPort(pty.name), RigSettings())
        rig.connect()
        rig.pulse(1, 0.5, 5.0)
        pty.unplug()
        with pytest.raises(LinkError, match="lost while"):
            rig.wait(5.0)
        rig.close()
        for _ in range(400):
            if not board.pump_on:
                break
            time.sleep(0.02)
        assert not board.pump_on


def test_a_board_that_restarts_in_mid_pulse_says_so(board):
    rig = connected(board)
    rig.pulse(1, 0.5, 5.0)
    rig.wait(0.2)
    board.step(Operation.RESET)
    rig.link.service(0.1)
    rig.wait(0.2)
    with pytest.raises(LinkError, match="connect again"):
        rig.pulse(1, 0.5, 0.1)
    rig.connect()
    assert rig.faults == Fault.RESET_WHILE_PUMPING


def test_lost_and_doubled_frames_do_not_double_a_pulse(board):
    """Every third write is lost, every third doubled; every 13th millisecond of the answers is lost."""
    rig = connected(board)
    count = {"out": 0, "in": 0}

    def spoil(data):
        count["out"] += 1
        return {0: b"", 1: data * 2, 2: data}[count["out"] % 3]

    def lose(data):
        count["in"] += bool(data)
        return b"" if count["in"] % 13 == 0 else data

    board.to_board, board.to_host = spoil, lose
    for _ in range(6):
        rig.pulse(1, 1.0, 0.02)
        for _ in range(100):
            rig.wait(0.02)
            if rig.last_pulse is not None:
                break
        assert rig.last_pulse.duration == pytest.approx(0.02)
    board.to_board = board.to_host = lambda data: data
    rig.wait(0.1)
    expected = 6 * rig.pulse(1, 1.0, 0.02).volume
    assert rig.read().pumped_volume == pytest.approx(expected, rel=0.05)
    assert 0 < board.plant.truth().chamber_volumes[0] < 7 * 1.45e3 * 0.02


def test_the_board_stops_what_the_host_does_not_watch(board):
    """A controller that hangs in a living process is silence too: only its calls are signs of life."""
    rig = connected(board)
    rig.pulse(1, 0.5, 5.0)
    rig.clock.sleep(1.0)
    assert not board.pump_on
    rig.wait(0.05)
    assert rig.faults == Fault.SILENCE
    assert rig.last_pulse.reason == EndReason.FAULT
    assert rig.last_pulse.duration == pytest.approx(0.4, abs=0.01)


def test_the_volume_limit_is_held_and_the_way_back_is_open(board):
    rig = connected(board, RigSettings(limits=LimitSettings(volume_max_ml=0.5)))
    rig.pulse(1, 1.0, 0.3)
    rig.wait(0.4)
    with pytest.raises(SafetyStop, match=r"volume 0\.9 ml exceeds the 0\.5 ml limit of this finger"):
        rig.pulse(1, 1.0, 0.3)
    rig.pulse(-1, 1.0, 0.3)


def test_over_pressure_ends_the_pulse_and_names_the_remedy(board):
    rig = connected(board, RigSettings(limits=LimitSettings(pressure_high_kpa=5.0)))
    rig.pulse(1, 1.0, 3.0)
    rig.wait(1.0)
    assert rig.last_pulse.reason == EndReason.FAULT
    assert rig.faults == Fault.OVER_PRESSURE
    assert rig.read().gauge_pressures[0] < 12e-3  # the motor coasts for 50 ms
    with pytest.raises(SafetyStop, match="pump the other way"):
        rig.pulse(1, 1.0, 0.1)
    rig.pulse(-1, 1.0, 0.05)
    rig.wait(0.6)
    rig.clear_faults()


def test_limits_that_the_sensor_cannot_show_are_refused():
    with pytest.raises(ValueError, match=r"would give 4\.9"):
        RigSettings(limits=LimitSettings(pressure_high_kpa=97.0), sensors={"right": {"zero_fraction": 0.6}})


def test_silence_from_the_port_is_told_with_what_to_do():
    class Nobody(LockstepPort):
        def write(self, data):
            pass

    with SimulatedBoard(BenchPlant()) as board, pytest.raises(LinkError, match="tubefoot rig flash"):
        BoardRig(Nobody(board), RigSettings()).connect()


def test_a_port_that_is_not_there_is_told():
    with pytest.raises(LinkError, match="cannot be opened"):
        BoardRig(SerialPort("/dev/ttyNONE"), RigSettings()).connect()


def test_four_channels_are_streamed(board):
    board.plant.overrides = {2: 2.6, 3: 2.4}
    rig = connected(board, RigSettings(board=BoardSettings(channels=4)))
    rig.wait(0.1)
    gauge = [pressure * 1e3 for pressure in rig.read().gauge_pressures]
    assert gauge[2:] == pytest.approx([5.0, -5.0], abs=0.6)


def test_a_pulse_that_is_none_is_refused(board):
    with pytest.raises(ConfigError, match="direction is 1 or -1"):
        connected(board).pulse(0, 0.5, 0.1)
