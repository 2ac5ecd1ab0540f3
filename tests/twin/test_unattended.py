"""The virtual bench goes on when its host hangs: the firmware itself then stops the pump."""

import time

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.messages import Fault
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.unattended import Unattended


def until(condition):
    """Wait for another thread's doing; the test ends by the runner's timeout if it never comes."""
    while not condition():
        time.sleep(0.005)


def test_silence_of_a_hung_host_stops_the_pump():
    with VirtualBench(board="native", real_time=True) as virtual, Unattended(virtual.port, patience_s=0.05):
        rig = BoardRig(virtual.port, RigSettings())
        rig.connect()
        rig.pulse(1, 0.8, 3.0)
        began = virtual.clock.now()
        until(lambda: not virtual.port.board.pump_on)  # nobody serves the rig
        stopped = virtual.clock.now() - began
        assert 0.3 < stopped < 0.6  # the limit of silence is 0.4 s
        rig.connect()  # the host comes to itself; time is its affair again
        assert rig.read().faults & Fault.SILENCE
        rig.close()


def test_after_a_hold_up_the_bench_does_not_rush():
    with VirtualBench(board="native", real_time=True) as virtual:
        virtual.clock.sleep(0.05)
        time.sleep(0.5)  # held up
        wall, bench = time.monotonic(), virtual.clock.now()
        virtual.clock.sleep(0.3)
        assert virtual.clock.now() - bench <= time.monotonic() - wall + 0.15
