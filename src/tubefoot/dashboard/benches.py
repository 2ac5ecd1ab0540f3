"""Opening the bench that is shown: the virtual one, or the one on a port, with or without a camera."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tubefoot.dashboard.eye import BlindEye, Eye, Shown
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.emergency import EmergencyLine
from tubefoot.lab.operator import Operator
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import RigSettings
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.layout import MarkerLayout

if TYPE_CHECKING:
    from tubefoot.twin.bench import VirtualBench
    from tubefoot.vision.calibration import CameraCalibration


@dataclass
class Bench:
    """A connected rig with its neutral measured, and what stands around it.

    name : for the page
    line : where the emergency stop goes
    rig : behind that line
    angles : open source of angles, None without a camera
    layout : markers on the finger
    calibration : of the camera, None without pixels
    hands : does what a calibration asks for on a virtual bench; None where a person must
    tidy : puts a virtual bench back in order after a calibration
    """

    name: str
    line: EmergencyLine
    rig: BoardRig
    angles: AngleSource | None
    layout: MarkerLayout
    calibration: CameraCalibration | None
    hands: Operator | None
    tidy: Callable[[], None]


@contextmanager
def virtual_bench(
    virtual: VirtualBench,
    settings: RigSettings,
    show: Shown,
    pixels: bool = True,
    patience_s: float | None = 1.0,
) -> Iterator[Bench]:
    """The virtual bench, set up for the dashboard.

    virtual : just built
    settings : of the rig
    show : called with each reading and its picture
    pixels : rendered frames; else angles without pixels
    patience_s : when the host has let no time pass for so long it passes by itself, as on a real bench whose
        host hangs [s]; never if None
    """
    from tubefoot.twin.simulated_operator import SimulatedOperator
    from tubefoot.twin.unattended import Unattended
    from tubefoot.vision.finger import FingerTracker

    with ExitStack() as stack:
        stack.enter_context(virtual)
        line = EmergencyLine(virtual.port)
        if patience_s is not None:
            stack.enter_context(Unattended(virtual.port, patience_s, hurry=lambda: line.tripped))
        rig = _connected(line, settings, stack)
        calibration = virtual.calibration if pixels else None
        angles: AngleSource
        if calibration is not None:
            angles = Eye(virtual.camera, FingerTracker(calibration, virtual.layout), show)
        else:
            angles = BlindEye(virtual.angles, virtual.layout, show)
        _open(angles, stack)
        hands = SimulatedOperator(virtual.plant)
        yield Bench(
            "virtual bench", line, rig, angles, virtual.layout, calibration, hands, virtual.plant.seal
        )


@contextmanager
def real_bench(
    settings: RigSettings, show: Shown, source: str, camera: Path | None, layout: Path | None
) -> Iterator[Bench]:
    """The bench on a port; the finger stands straight and at rest.

    settings : of the rig
    show : called with each reading and its picture
    source : webcam, by number or device
    camera : its calibration; without one there are no angles and no closed loop
    layout : markers, those of the reference finger if None
    """
    from tubefoot.lab.port import SerialPort
    from tubefoot.vision.calibration import load_calibration
    from tubefoot.vision.finger import FingerTracker
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.sources import open_source

    markers = chosen_layout(layout)
    calibration = load_calibration(camera) if camera else None
    with ExitStack() as stack:
        port = SerialPort(settings.board.port)
        line = EmergencyLine(port)
        rig = _connected(line, settings, stack)
        angles: AngleSource | None = None
        if calibration is not None:
            resolution = (calibration.lens.width_px, calibration.lens.height_px)
            angles = Eye(open_source(source, resolution), FingerTracker(calibration, markers), show)
            _open(angles, stack)
        yield Bench(port.name, line, rig, angles, markers, calibration, None, lambda: None)


def _connected(line: EmergencyLine, settings: RigSettings, stack: ExitStack) -> BoardRig:
    rig = BoardRig(line, settings)
    stack.callback(rig.close)
    rig.connect()
    measure_neutral(rig)
    return rig


def _open(angles: AngleSource, stack: ExitStack) -> None:
    angles.open()
    stack.callback(angles.close)
