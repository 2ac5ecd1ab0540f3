"""The same binary in avr8js: what simavr says about the firmware is not simavr's own invention. Opt-in."""

from __future__ import annotations

import shutil

import pytest

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.messages import EndReason, Fault
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, SimulatedBoard
from tubefoot.twin.firmware import FOLDER
from tubefoot.twin.processor import PipedProcessor

BRIDGE = FOLDER / "simulator" / "second" / "bridge.mjs"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("node") is None or not (BRIDGE.parent / "node_modules").exists(),
        reason="`make -C firmware second-simulator` (npm) installs it",
    ),
]


def session(simulator):
    """Pressures after a pulse, its end, and what silence does."""
    with SimulatedBoard(BenchPlant(), PipedProcessor(simulator=simulator)) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        rig.wait(0.1)
        rig.pulse(1, 0.8, 0.3)
        rig.wait(0.6)
        pressures, ended, supply = rig.read().gauge_pressures, rig.last_pulse, rig.read().supply
        rig.pulse(1, 0.5, 3.0)
        rig.clock.sleep(0.6)
        rig.wait(0.05)
        return (
            pressures,
            ended,
            supply,
            rig.faults,
            rig.last_pulse.duration,
            rig.damaged_frames,
            rig.lost_samples,
        )


def test_both_simulators_agree():
    ours, other = session(None), session(["node", str(BRIDGE)])
    assert other[0] == pytest.approx(ours[0], abs=0.4e-3)  # two counts
    assert other[1].reason == ours[1].reason == EndReason.COMPLETED
    assert other[1].duration == ours[1].duration
    assert other[2] == pytest.approx(ours[2], abs=0.03)
    assert other[3] == ours[3] == Fault.SILENCE
    assert other[4] == pytest.approx(ours[4], abs=0.01)
    assert other[5:] == ours[5:] == (0, 0)
