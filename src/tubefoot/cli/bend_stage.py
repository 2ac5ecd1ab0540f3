"""The bench that `tubefoot bend` works on: a rig, a source of angles, a recorder, real or virtual."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.settings import RigSettings
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.vision.angles import AngleSource


@dataclass
class Stage:
    """A connected rig whose neutral was measured, open angles, the recorder, columns known beside them."""

    rig: BoardRig
    angles: AngleSource
    recorder: Recorder
    further: Callable[[], Mapping[str, float]]


@contextmanager
def virtual_stage(
    settings: RigSettings,
    recording: Path,
    seed: int,
    bench: BenchSettings,
    quick: bool,
    real_time: bool,
) -> Iterator[Stage]:
    """The virtual bench; the true angle and the column levels go into the trace, never to a controller.

    settings : of the rig
    recording : file to record into
    seed : of what is random
    bench : what it is made of
    quick : angles without pixels and the firmware's native core, instead of frames and the firmware's binary
    real_time : run at the pace of the wall clock
    """
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.twin.bench import VirtualBench
    from tubefoot.units import DEG
    from tubefoot.vision.angles import TrackedAngles
    from tubefoot.vision.finger import FingerTracker

    board: Literal["native", "simavr"] = "native" if quick else "simavr"
    with ExitStack() as stack:
        virtual = stack.enter_context(
            VirtualBench(bench, seed, board, rig_settings=settings, real_time=real_time)
        )
        recorder = Recorder(recording, settings, virtual.clock.now())
        stack.callback(recorder.close)
        rig = BoardRig(virtual.port, settings, recorder)
        stack.callback(rig.close)
        rig.connect()
        measure_neutral(rig)
        tracker = FingerTracker(virtual.calibration, virtual.layout)
        angles: AngleSource = virtual.angles if quick else TrackedAngles(virtual.camera, tracker)
        angles.open()
        stack.callback(angles.close)

        def further() -> Mapping[str, float]:
            truth = virtual.truth()
            right, left = truth.column_levels
            return {"true_bend_deg": truth.bend / DEG, "level_right_mm": right, "level_left_mm": left}

        yield Stage(rig, angles, recorder, further)


@contextmanager
def real_stage(
    settings: RigSettings, recording: Path, source: str, camera: Path, layout: Path | None
) -> Iterator[Stage]:
    """The bench on a port, with a webcam; the finger stands straight and at rest.

    settings : of the rig
    recording : file to record into
    source : webcam, by number or device
    camera : calibration; layout : markers, those of the reference finger if None
    """
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.port import SerialPort
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.vision.angles import TrackedAngles
    from tubefoot.vision.calibration import load_calibration
    from tubefoot.vision.finger import FingerTracker
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.sources import open_source

    calibration = load_calibration(camera)
    markers = chosen_layout(layout)
    device = open_source(source, (calibration.lens.width_px, calibration.lens.height_px))
    port = SerialPort(settings.board.port)
    with ExitStack() as stack:
        recorder = Recorder(recording, settings, port.clock.now())
        stack.callback(recorder.close)
        rig = BoardRig(port, settings, recorder)
        stack.callback(rig.close)
        rig.connect()
        measure_neutral(rig)
        angles = TrackedAngles(device, FingerTracker(calibration, markers))
        angles.open()
        stack.callback(angles.close)
        yield Stage(rig, angles, recorder, dict)
