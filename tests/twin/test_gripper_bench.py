"""The gripper's bench: one clock for two boards, one pump for both fingers, and the whole chain with the
firmware."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tubefoot.cli.grasp_stage import VirtualGrasp, virtual_grasp
from tubefoot.control.grasp_loop import GraspLoop
from tubefoot.control.grasp_protocol import GraspProtocol
from tubefoot.control.grasp_settings import GraspSettings, TrialSettings
from tubefoot.errors import ConfigError
from tubefoot.lab.grasp_object import known_object
from tubefoot.lab.settings import RigSettings
from tubefoot.records import write_table
from tubefoot.reduced.files import reference_file
from tubefoot.report.grasping import draw_grasp
from tubefoot.twin.bench_settings import BenchSettings, BranchMake, FingerMake
from tubefoot.twin.gripper_bench import GripperBench
from tubefoot.twin.gripper_hands import SimulatedHands
from tubefoot.twin.gripper_scene import GripperMake
from tubefoot.twin.held_object import HeldObject
from tubefoot.units import DEG, ML
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.finger import FingerReading

BERRY = known_object("blueberry")
FINGER, MEMORY = reference_file().to_finger(), reference_file().to_prony()
SHORT = GraspSettings(test=TrialSettings(hold_s=1.0, lift_s=1.0, lift_mm=10.0, shake_s=0.5))


def bench_of(pumps: int = 2, seed: int = 0, make: BenchSettings | None = None) -> GripperBench:
    """A gripper, nominal if not said otherwise, with the firmware's native core."""
    held = HeldObject(BERRY, "front", 0.5)
    return GripperBench(held, (make or BenchSettings(),), GripperMake(pumps=pumps), seed, board="native")


def pulsed(bench: GripperBench, which: tuple[int, ...]) -> tuple[float, float]:
    """Bends of both fingers a second after a pulse of each rig named [rad]."""
    with bench:
        for rig in bench.rigs:
            rig.connect()
        for number in which:
            bench.rigs[number].pulse(1, 0.6, 0.3)
        bench.rigs[0].wait(1.0)
        right, left = bench.gripper.fingers
        return right.bend, left.bend


def grasped(virtual: VirtualGrasp) -> tuple[GraspProtocol, GraspLoop, dict[str, object]]:
    """A short grasp of a blueberry."""
    protocol = GraspProtocol(BERRY, "front", FINGER, SHORT, virtual.make.pumps == 1, MEMORY)
    with virtual_grasp(BERRY, "front", SHORT, RigSettings(), virtual) as stage:
        loop = GraspLoop(stage.rigs, stage.angles, stage.hands, further=stage.further)
        loop.run(protocol)
        return protocol, loop, stage.verdict()


def test_each_rig_moves_its_own_finger() -> None:
    right, left = pulsed(bench_of(), (0,))
    assert right > 3 * DEG
    assert abs(left) < 0.3 * DEG


def test_a_splitter_moves_both_by_half() -> None:
    """With hardly any air, which would take less than half the share from two fingers."""
    branches = BranchMake(air_right_ml=0.02, air_left_ml=0.02)
    make = BenchSettings(
        branches=branches, finger=FingerMake(bubble_right_ml=0.0, bubble_left_ml=0.0, creep=False)
    )
    both, alone = pulsed(bench_of(1, make=make), (0,)), pulsed(bench_of(2, make=make), (0,))
    assert both[0] == pytest.approx(both[1], rel=1e-6)
    assert both[0] == pytest.approx(alone[0] / 2, rel=0.1)


def test_boards_share_the_clock_and_liquid_is_kept() -> None:
    bench = bench_of()
    pulsed(bench, (0, 1))
    times = [port.board.time for port in bench.ports]
    assert times[0] == times[1] > 1.0
    for plant in bench.plants:
        assert abs(plant.hydraulics.liquid_error) < 1e-9 * ML


def test_same_seed_same_run() -> None:
    assert pulsed(bench_of(seed=3), (0, 1)) == pulsed(bench_of(seed=3), (0, 1))
    assert pulsed(bench_of(seed=3), (0, 1)) != pulsed(bench_of(seed=4), (0, 1))


class LateAngles:
    """Angles whose markers are hidden at first; the loop's other calls go to the source."""

    def __init__(self, source: AngleSource):
        self._source, self._hidden = source, 20

    def read(self) -> FingerReading:
        """A reading, without angles in the first 20 frames."""
        reading = self._source.read()
        self._hidden -= 1
        return reading if self._hidden < 0 else replace(reading, bend=np.nan, theta1=np.nan, theta2=np.nan)


def test_markers_hidden_at_first_are_waited_for(tmp_path: Path) -> None:
    """No pulse until they are seen; and a trace without any angle can be drawn."""
    protocol = GraspProtocol(BERRY, "front", FINGER)
    with bench_of() as bench:
        for rig in bench.rigs:
            rig.connect()
        for source in bench.angles:
            source.open()

        def watch(row: dict[str, Any]) -> None:
            if protocol.phase == "done" or row["command"] == "pulse":
                raise KeyboardInterrupt

        late: list[Any] = [LateAngles(source) for source in bench.angles]
        hands = SimulatedHands(bench, 70.0)
        loop = GraspLoop(bench.rigs, late, hands, watch)
        loop.run(protocol)
    assert protocol.outcome.reason.startswith("interrupted")
    blind = [row for row in loop.rows if not np.isfinite(row["bend_right_deg"])]
    assert len(blind) >= 19
    assert {row["command"] for row in blind} == {"wait"}
    assert loop.rows[-1]["command"] == "pulse"
    write_table(tmp_path / "grasp.csv", blind)
    assert len(draw_grasp(tmp_path)) == 3


def test_number_of_units_is_refused_where_it_would_not_be_read() -> None:
    with pytest.raises(ConfigError, match="units = 6"):
        bench_of(make=BenchSettings(finger=FingerMake(units=6)))


@pytest.mark.slow
@pytest.mark.parametrize("pumps", [1, 2])
def test_a_blueberry_is_held(pumps: int) -> None:
    make = (BenchSettings(), BenchSettings())
    protocol, loop, verdict = grasped(VirtualGrasp(make, GripperMake(pumps=pumps), 0.5, quick=True))
    assert protocol.outcome.reason == "complete"
    assert verdict["held"]
    assert float(str(verdict["slip_mm"])) < 1.0
    latencies = loop.latencies(protocol, verdict["first_touch_s"])  # type: ignore[arg-type]
    assert all(latency in (0, 1) for latency in latencies)
    held = [row for row in loop.rows if row["phase"] == "hold"]
    force = np.mean([row["true_force_right_n"] for row in held])
    assert min(protocol.outcome.grip_force) == pytest.approx(force, rel=0.5)


@pytest.mark.slow
def test_the_whole_chain_with_firmware_and_frames() -> None:
    """Two simulated processors run the real binary, and both angles come out of drawn frames."""
    make = (BenchSettings(), BenchSettings())
    protocol, loop, verdict = grasped(VirtualGrasp(make, GripperMake(), 0.5))
    assert protocol.outcome.reason == "complete"
    assert verdict["held"]
    held = [row for row in loop.rows if row["phase"] == "hold"]
    assert np.isfinite([row["theta1_chord_right_deg"] for row in held]).all()
    assert held[-1]["theta1_right_deg"] < -1.0
