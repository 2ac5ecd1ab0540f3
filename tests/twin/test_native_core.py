"""The firmware's core on this computer against the same firmware on the simulated chip."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.errors import LinkError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.messages import Fault
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, Operation, SimulatedBoard
from tubefoot.twin.processor import NativeCore, PipedProcessor
from tubefoot.units import KPA


def session(processor):
    """Samples of a few pulses, times from the first pulse on."""
    with SimulatedBoard(BenchPlant(seed=4), processor) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        start, rows, ended = rig.clock.now(), [], []
        for direction, duty, duration in ((1, 0.6, 0.2), (-1, 0.3, 0.35), (1, 1.0, 0.1)):
            rig.pulse(direction, duty, duration)
            readings = rig.wait(0.6)
            rows += [(r.time - start, *r.gauge_pressures, r.supply, r.direction) for r in readings]
            ended.append((rig.last_pulse.duration, rig.last_pulse.reason))
        return np.array(rows), ended


def test_native_core_and_simulated_chip_tell_the_same_story():
    native, native_ends = session(NativeCore())
    chip, chip_ends = session(PipedProcessor())
    assert native_ends == chip_ends
    assert len(native) == pytest.approx(len(chip), abs=3)
    grid = np.arange(0.05, 1.7, 0.01)
    for column in (1, 2):
        a, b = (np.interp(grid, rows[:, 0], rows[:, column]) for rows in (native, chip))
        assert np.abs(a).max() > 2 * KPA
        # Phases of sampling and of the PWM differ; a count of the converter is 0.25 kPa.
        assert np.abs(a - b).mean() < 0.25 * KPA
        assert np.abs(a - b).max() < 1.5 * KPA


@pytest.mark.parametrize("processor", [NativeCore, PipedProcessor])
def test_the_plant_gets_every_millisecond_of_a_pulse(processor):
    drives = []

    class Listening(BenchPlant):
        def step(self, duration, drive):
            drives.append(duration * drive.direction * drive.duty)
            super().step(duration, drive)

    with SimulatedBoard(Listening(), processor()) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        rig.pulse(-1, 1.0, 0.12)
        rig.wait(0.2)
    # The firmware counts ticks; the first comes up to a millisecond after the pump was switched on.
    assert -0.12 <= sum(drives) <= -0.119


def test_each_core_is_a_board_of_its_own():
    with (
        SimulatedBoard(BenchPlant(), NativeCore()) as one,
        SimulatedBoard(BenchPlant(), NativeCore()) as other,
    ):
        first, second = (BoardRig(LockstepPort(board), RigSettings()) for board in (one, other))
        first.connect()
        second.connect()
        first.pulse(1, 0.8, 0.3)
        first.wait(0.1)
        second.wait(0.1)
        assert (one.pump_on, other.pump_on) == (True, False)
        assert first.read().direction == 1
        assert second.read().direction == 0


def test_a_silent_host_stops_the_pump_and_a_reset_is_remembered():
    with SimulatedBoard(BenchPlant(), NativeCore()) as board:
        port = LockstepPort(board)
        rig = BoardRig(port, RigSettings())
        rig.connect()
        rig.pulse(1, 0.5, 3.0)
        port.clock.sleep(0.6)
        assert not board.pump_on
        rig.wait(0.1)
        assert rig.faults == Fault.SILENCE
        rig.clear_faults()
        rig.pulse(1, 0.5, 3.0)
        rig.wait(0.1)
        assert board.pump_on
        board.step(Operation.RESET)
        assert not board.pump_on
        rig.wait(0.2)
        assert rig.faults == Fault.RESET_WHILE_PUMPING


def test_a_closed_core_says_so():
    core = NativeCore()
    with SimulatedBoard(BenchPlant(), core) as board:
        board.step()
    with pytest.raises(LinkError, match="switched off"):
        board.step()
    core.close()
