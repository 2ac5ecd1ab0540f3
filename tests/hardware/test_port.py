"""The contract on a real bench: `pytest -m hardware tests/hardware --port /dev/ttyACM0`.

The pump runs for about 0.6 s; the branches must be filled and closed as docs/rig.md says.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "contracts"))
from rig_contract import run_contract

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.port import SerialPort
from tubefoot.lab.settings import RigSettings


@pytest.mark.hardware
def test_the_contract_holds_on_a_real_board(request):
    port = request.config.getoption("--port", default=None)
    if port is None:
        pytest.skip("name the board with --port /dev/ttyACM0")
    run_contract(BoardRig(SerialPort(port), RigSettings()))
