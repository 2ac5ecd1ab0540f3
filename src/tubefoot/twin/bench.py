"""The virtual bench: plant, board, camera on one stepped clock, behind the contracts of the real one.

Whoever waits (for samples, for a frame, on the clock) makes time pass for all of it. The same settings, seed,
faults and calls give the same run to the bit. `truth` is for tests and reports: nothing that steers may look.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import cached_property
from types import TracebackType
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.clock import Clock
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_camera import Deliveries, RenderedCamera, TrueAngles
from tubefoot.twin.bench_plant import BenchPlant, Truth
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.bent_axis import BentAxis
from tubefoot.twin.board import LockstepPort, SimulatedBoard
from tubefoot.twin.faults import BenchFault, FaultSchedule
from tubefoot.twin.fingers import finger_length
from tubefoot.twin.frame_drawer import FrameDrawer
from tubefoot.twin.processor import NativeCore, PipedProcessor
from tubefoot.units import DEG
from tubefoot.vision.calibration import CameraCalibration
from tubefoot.vision.exposure import Exposure
from tubefoot.vision.layout import MarkerLayout, MarkerPlace
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanePose

BoardKind = Literal["simavr", "native"]
BOARDS: tuple[BoardKind, ...] = ("simavr", "native")
KEPT_S = 2.0
SEEN_S = 5e-3
"""How often the finger's shape is noted for the camera [s]; between, it is interpolated."""

LENS = Lens.centred(640, 480, 800.0, (-0.12, 0.05, 0.0005, -0.0004, 0.0))
PLANE = PlanePose.facing(250.0, 4 * DEG, -6 * DEG, (2.0, -46.0))


def bench_layout(length_mm: float = 92.0) -> MarkerLayout:
    """Markers of the virtual bench: five on the 12-unit finger, fewer on shorter ones, the last on the cap.

    length_mm : of the finger, caps included
    """
    tip = length_mm - 2.0
    places = [(1, 2.0), (2, 25.0), (4, 46.0), (7, 67.0)]
    below = [place for place in places if place[1] < tip - 12.0]
    return MarkerLayout(
        length_mm=length_mm,
        markers=tuple(MarkerPlace(id=marker, z_mm=height) for marker, height in [*below, (11, tip)]),
    )


class VirtualBench:
    """One bench with one finger; use it as a context manager.

    plant : everything physical
    port : where the board's line ends, with the bench's clock
    layout, calibration : markers on the finger, and the camera's lens and plane
    """

    def __init__(
        self,
        settings: BenchSettings | None = None,
        seed: int = 0,
        board: BoardKind = "simavr",
        faults: Sequence[BenchFault] = (),
        rig_settings: RigSettings | None = None,
        real_time: bool = False,
    ):
        """Build it and switch its board on.

        settings : what it is made of; the nominal bench if not given
        seed : of noise, jitter, drops and where the rollers stand
        board : `simavr`, the real firmware binary, or `native`, the firmware's core on this computer
        faults : what goes wrong, and when
        rig_settings : of the host's rig; the defaults if not given
        real_time : never run ahead of the wall clock, for people to watch
        """
        if board not in BOARDS:
            raise ConfigError(f"board {board!r}: choose one of {', '.join(BOARDS)}")
        self.settings = settings or BenchSettings()
        self.layout = bench_layout(finger_length(self.settings.finger))
        self.calibration = CameraCalibration.of(LENS, PLANE).model_copy(update={"zeroed": True})
        self.rig_settings = rig_settings or RigSettings()
        streams = np.random.default_rng([seed, 1]).spawn(4)
        self._chances, self._noises = streams[:2], streams[2:]
        self.plant = BenchPlant(self.settings, seed)
        self._board = SimulatedBoard(self.plant, PipedProcessor() if board == "simavr" else NativeCore())
        self.port = LockstepPort(self._board, real_time=real_time)
        self._faults = FaultSchedule(faults, self.plant, self.port)
        self._shapes: deque[tuple[float, NDArray[np.float64]]] = deque(maxlen=round(KEPT_S / SEEN_S))
        self._seen_due = 0.0
        self.port.on_step = self._look

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def clock(self) -> Clock:
        """The bench's time; sleeping on it steps everything."""
        return self.port.clock

    @cached_property
    def rig(self) -> BoardRig:
        """The host's rig, not yet connected."""
        return BoardRig(self.port, self.rig_settings)

    @cached_property
    def camera(self) -> RenderedCamera:
        """Rendered frames of the finger, 640 x 480."""
        camera = self.settings.camera
        drawer = FrameDrawer(
            self.layout, LENS, PLANE, Exposure(read_noise=camera.read_noise), self._noises[0]
        )
        tip = self.layout.markers[-1].id

        def draw(axes: list[BentAxis], time: float) -> NDArray[np.uint8]:
            return drawer.draw(axes, {tip} if self._faults.hidden(time) else ())

        return RenderedCamera(
            Deliveries(camera, self.clock, self._chances[0], self._faults.blind),
            self._axis_at,
            draw,
            (LENS.width, LENS.height),
            self.clock,
            1e-3 * camera.exposure_ms,
        )

    @cached_property
    def angles(self) -> TrueAngles:
        """Angles of the finger without pixels: the vision's error, latency, jitter and drops, but fast."""
        return TrueAngles(
            Deliveries(self.settings.camera, self.clock, self._chances[1], self._faults.blind),
            self._axis_at,
            self.settings.camera,
            self.layout,
            self._noises[1],
            self._faults.hidden,
        )

    def truth(self) -> Truth:
        """The bench as it is, for tests and reports only."""
        return self.plant.truth()

    def close(self) -> None:
        """Switch the board off."""
        self._board.close()

    def _look(self, time: float) -> None:
        """After each step: note the finger's shape when due, let faults happen."""
        if time >= self._seen_due:
            self._seen_due = time + SEEN_S - 1e-9
            self._shapes.append((time, self.plant.finger.unit_angles))
        self._faults.apply(time)

    def _axis_at(self, time: float) -> BentAxis:
        """The finger's middle line at a time of the last two seconds."""
        later_time, later = self._shapes[-1]
        if time < later_time:
            for earlier_time, earlier in reversed(self._shapes):
                if earlier_time <= time:
                    share = (time - earlier_time) / (later_time - earlier_time)
                    return BentAxis(self.layout, earlier + share * (later - earlier))
                later_time, later = earlier_time, earlier
        return BentAxis(self.layout, later)
