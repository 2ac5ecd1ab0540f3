"""avrdude, the boot loader and the firmware together, on the simulated board. Slow: boot loaders wait."""

from __future__ import annotations

from pathlib import Path

import pytest

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.flashing import flash
from tubefoot.lab.port import SerialPort
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import SimulatedBoard
from tubefoot.twin.firmware import BOOTLOADER, built
from tubefoot.twin.processor import PipedProcessor
from tubefoot.twin.pty_board import PtyBoard


@pytest.mark.slow
def test_a_blank_board_is_flashed_and_answers():
    board = SimulatedBoard(BenchPlant(), PipedProcessor(firmware=Path(), bootloader=BOOTLOADER))
    with board, PtyBoard(board, head_start=0.5) as pty:
        report = flash(pty.name, built("board.hex"))
        assert "verified" in report
        rig = BoardRig(SerialPort(pty.name), RigSettings())
        rig.link.connect(timeout=20)
        rig.connect()
        assert rig.identity.firmware == 0x0100
        rig.close()


def test_a_missing_board_or_program_is_told(tmp_path):
    with pytest.raises(ConfigError, match="make -C firmware"):
        flash("/dev/ttyNONE", tmp_path / "none.hex")
    with pytest.raises(LinkError, match="could not flash"):
        flash("/dev/ttyNONE", built("board.hex"))
