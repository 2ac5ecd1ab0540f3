"""The contract of a rig, over every kind of rig there is."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from rig_contract import run_contract

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.port import SerialPort
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.recording import Recording
from tubefoot.lab.replay import ReplayRig
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, SimulatedBoard
from tubefoot.twin.processor import NativeCore
from tubefoot.twin.pty_board import PtyBoard


@contextmanager
def by_pipe(tmp_path):
    with SimulatedBoard(BenchPlant()) as board:
        yield BoardRig(LockstepPort(board), RigSettings())


@contextmanager
def natively(tmp_path):
    with SimulatedBoard(BenchPlant(), NativeCore()) as board:
        yield BoardRig(LockstepPort(board), RigSettings())


@contextmanager
def by_pty(tmp_path):
    with SimulatedBoard(BenchPlant()) as board, PtyBoard(board) as pty:
        rig = BoardRig(SerialPort(pty.name), RigSettings())
        try:
            yield rig
        finally:
            rig.close()


@contextmanager
def by_replay(tmp_path):
    path = tmp_path / "bench.mcap"
    with SimulatedBoard(BenchPlant()) as board:
        port = LockstepPort(board)
        recorder = Recorder(path, RigSettings(), port.clock.now())
        run_contract(BoardRig(port, RigSettings(), recorder))
        recorder.close()
    yield ReplayRig(path)


@pytest.mark.parametrize("kind", [by_pipe, natively, by_pty, by_replay])
def test_the_contract_holds(kind, tmp_path):
    with kind(tmp_path) as rig:
        run_contract(rig)


def test_a_run_is_repeatable_to_the_bit(tmp_path):
    """Two recordings of the same run hold the same samples."""
    tables = []
    for name in ("a", "b"):
        path = tmp_path / f"{name}.mcap"
        with SimulatedBoard(BenchPlant(seed=3)) as board:
            port = LockstepPort(board)
            recorder = Recorder(path, RigSettings(), port.clock.now())
            rig = BoardRig(port, RigSettings(), recorder)
            rig.connect()
            rig.pulse(1, 0.7, 0.2)
            rig.wait(0.5)
            rig.close()
            recorder.close()
        tables.append(Recording(path).rows("samples"))
    assert len(tables[0]) > 90
    assert tables[0] == tables[1]
