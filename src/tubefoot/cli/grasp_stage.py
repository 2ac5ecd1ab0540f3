"""The bench that `tubefoot grasp` works on: rigs, angles, hands, pictures; real or virtual."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tubefoot.control.grasp_loop import Hands
    from tubefoot.control.grasp_settings import GraspSettings
    from tubefoot.lab.grasp_object import GraspObject, Pose
    from tubefoot.lab.rig import Rig
    from tubefoot.lab.settings import RigSettings
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.twin.gripper_scene import GripperMake
    from tubefoot.vision.angles import AngleSource


@dataclass
class GraspStage:
    """Connected rigs whose neutral was measured, open angles of both fingers, the hands.

    further : columns beside the measured ones, recorded and never steered by
    picture : what a bystander sees, with words on it; None where nothing can be shown
    verdict : what is known in the end beside the trace: whether it was held, slip, largest forces
    """

    rigs: Sequence[Rig]
    angles: Sequence[AngleSource]
    hands: Hands
    further: Callable[[], Mapping[str, float]] = dict
    picture: Callable[[str], NDArray[np.uint8]] | None = None
    verdict: Callable[[], dict[str, Any]] = dict


@dataclass(frozen=True)
class VirtualGrasp:
    """What is special to a grasp on the virtual bench.

    benches : of the right and the left finger; make : of the gripper
    friction : that the object really has; error : of its placement [mm]
    seed : of what is random; quick : angles without pixels and the firmware's native core
    empty : the hands hold nothing, for closings without an object
    """

    benches: tuple[BenchSettings, BenchSettings]
    make: GripperMake
    friction: float
    error: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0
    quick: bool = False
    empty: bool = False


@contextmanager
def virtual_grasp(
    what: GraspObject,
    pose: Pose,
    settings: GraspSettings,
    rig: RigSettings,
    virtual: VirtualGrasp,
    recordings: Sequence[Path] = (),
) -> Iterator[GraspStage]:
    """The virtual gripper; true forces and the object's place go into the trace, never to the protocol.

    what : the object; pose : front or side; settings : of the grasp; rig : of both rigs
    virtual : what is simulated; recordings : files to record into, one a rig, none if empty
    """
    from tubefoot.control.placing import placing_height
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.twin.gripper_bench import GripperBench
    from tubefoot.twin.gripper_hands import SimulatedHands
    from tubefoot.twin.gripper_view import GripperView
    from tubefoot.twin.held_object import HeldObject
    from tubefoot.vision.angles import TrackedAngles
    from tubefoot.vision.finger import FingerTracker

    held = HeldObject(what, pose, virtual.friction)
    with ExitStack() as stack:
        bench = stack.enter_context(
            GripperBench(
                held,
                virtual.benches,
                virtual.make,
                virtual.seed,
                "native" if virtual.quick else "simavr",
                rig,
            )
        )
        for one, path in zip(bench.rigs, recordings, strict=False):
            recorder = Recorder(path, rig, bench.clock.now())
            stack.callback(recorder.close)
            one.record_into(recorder)
        for one in bench.rigs:
            stack.callback(one.close)
            one.connect()
        for one in bench.rigs:
            measure_neutral(one)
        angles: list[AngleSource] = list(bench.angles)
        if not virtual.quick:
            angles = [
                TrackedAngles(camera, FingerTracker(bench.calibration, bench.layout))
                for camera in bench.cameras
            ]
        for source in angles:
            source.open()
            stack.callback(source.close)
        test = settings.test
        hands = SimulatedHands(
            bench,
            placing_height(what, pose, settings, bench.layout.length_mm),
            virtual.error,
            (test.lift_mm, test.lift_s),
            (test.shake_mm, test.shake_hz, test.shake_s),
            virtual.empty,
        )
        view = GripperView(bench)
        yield GraspStage(bench.rigs, angles, hands, hands.columns, view.draw, hands.verdict)


@contextmanager
def real_grasp(
    rigs: Sequence[RigSettings],
    sources: Sequence[str],
    cameras: Sequence[Path],
    layout: Path | None,
    recordings: Sequence[Path],
    height: float,
) -> Iterator[GraspStage]:
    """The gripper on one or two ports, with a camera calibration for each finger.

    rigs : one for both fingers through a splitter, or the right and the left one
    sources : webcams, one that sees both fingers or the right and the left finger's
    cameras : calibrations of the right and the left finger; layout : markers, the reference finger's if None
    recordings : files to record into, one a rig; height : at which the object's middle is to be held [mm]
    """
    from tubefoot.cli.person_hands import PersonHands
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.port import SerialPort
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.vision.angles import TrackedAngles
    from tubefoot.vision.calibration import load_calibration
    from tubefoot.vision.finger import FingerTracker
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.shared import shared_camera
    from tubefoot.vision.sources import open_source

    markers = chosen_layout(layout)
    calibrations = [load_calibration(path) for path in cameras]
    lens = calibrations[0].lens
    devices = [open_source(source, (lens.width_px, lens.height_px)) for source in sources]
    seen = devices if len(devices) == 2 else shared_camera(devices[0])
    with ExitStack() as stack:
        benches = []
        for settings, path in zip(rigs, recordings, strict=True):
            port = SerialPort(settings.board.port)
            recorder = Recorder(path, settings, port.clock.now())
            stack.callback(recorder.close)
            rig = BoardRig(port, settings, recorder)
            stack.callback(rig.close)
            rig.connect()
            benches.append(rig)
        for rig in benches:
            measure_neutral(rig)
        angles = [
            TrackedAngles(device, FingerTracker(calibration, markers))
            for device, calibration in zip(seen, calibrations, strict=True)
        ]
        for source in angles:
            source.open()
            stack.callback(source.close)
        hands = PersonHands(height)
        yield GraspStage(benches, angles, hands, verdict=hands.verdict)
