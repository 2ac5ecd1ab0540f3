"""The virtual bench of a gripper: two fingers, one or two pumps with their boards, two cameras, one clock.

With two pumps each finger has a bench of its own, and the boards step side by side; with one, a splitter
joins both fingers' chambers to it. The cameras look at one finger each. What a finger's camera sees is its
angle in the picture, positive to the left: inward for the right finger, outward for the left one. `truth` is
for tests and reports.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.clock import Clock
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench import BOARDS, KEPT_S, LENS, PLANE, SEEN_S, BoardKind, bench_layout
from tubefoot.twin.bench_camera import Deliveries, RenderedCamera, TrueAngles
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.bent_axis import BentAxis
from tubefoot.twin.board import LockstepPort, SimulatedBoard
from tubefoot.twin.finger_response import FingerResponse
from tubefoot.twin.fingers import law_of
from tubefoot.twin.frame_drawer import FrameDrawer
from tubefoot.twin.gripper import Gripper, PairedFinger
from tubefoot.twin.gripper_plant import Pace, PacedPlant
from tubefoot.twin.gripper_scene import SIDES, GripperMake, SceneParts
from tubefoot.twin.held_object import HeldObject
from tubefoot.twin.processor import NativeCore, PipedProcessor
from tubefoot.vision.calibration import CameraCalibration
from tubefoot.vision.exposure import Exposure

FloatArray = NDArray[np.float64]

SENSES = (1.0, -1.0)
"""Inward over the angle in the picture, of the right and the left finger."""


BINARY_STEP_S, NATIVE_STEP_S = 1e-3, 2e-3
"""Steps of boards with the real binary and with the native core: the latter is for many trials [s]."""


class TandemPort(LockstepPort):
    """One of several ports whose boards share a clock: waiting at any of them steps all."""

    def __init__(self, board: SimulatedBoard, name: str, tandem: list[TandemPort]):
        """Join the others.

        board : behind this port; name : for messages; tandem : all ports of the clock; this one is added
        """
        super().__init__(board, name)
        self._tandem = tandem
        tandem.append(self)

    def advance(self) -> bytes:
        """What this port's board sent in one step of all boards."""
        own = b""
        for port in self._tandem:
            come = port.advance_alone()
            if port is self:
                own = come
        return own

    def advance_alone(self) -> bytes:
        """What this port's board sent in one step of its own; for the tandem only."""
        return super().advance()


class GripperBench:
    """A gripper with its benches; use it as a context manager.

    gripper : fingers and object; plants : one or two benches
    rigs : one or two, not yet connected; the first drives the right finger, or both
    layout, calibration : of each finger's markers and camera
    """

    def __init__(
        self,
        held: HeldObject,
        settings: Sequence[BenchSettings] = (),
        make: GripperMake | None = None,
        seed: int = 0,
        board: BoardKind = "simavr",
        rig_settings: RigSettings | None = None,
    ):
        """Build it and switch its boards on.

        held : the object; settings : of the right and the left finger's bench; one for both, nominal if empty
        make : of the gripper; seed : of noise, jitter, drops, rollers
        board : `simavr`, the real firmware binary, or `native`; rig_settings : of the host's rigs
        """
        if board not in BOARDS:
            raise ConfigError(f"board {board!r}: choose one of {', '.join(BOARDS)}")
        self.make = make or GripperMake()
        both = tuple(settings) or (BenchSettings(),)
        self.settings = (both[0], both[-1])
        self.layout = bench_layout()
        self.calibration = CameraCalibration.of(LENS, PLANE).model_copy(update={"zeroed": True})
        self.gripper = _gripper(self.settings, self.make, held)
        right, left = self.gripper.fingers
        streams = np.random.default_rng([seed, 2]).spawn(4)
        pace = Pace(self.make.pumps)
        responses: tuple[FingerResponse, ...] = (right, left)
        if self.make.pumps == 1:
            responses = (PairedFinger(right, left),)
        makes = self.settings if self.make.pumps == 2 else (_joined(self.settings[0]),)
        self.plants = tuple(
            PacedPlant(made, 2 * seed + number, response, pace)
            for number, (made, response) in enumerate(zip(makes, responses, strict=True))
        )
        tandem: list[TandemPort] = []
        self._boards = [
            SimulatedBoard(plant, PipedProcessor(), BINARY_STEP_S)
            if board == "simavr"
            else SimulatedBoard(plant, NativeCore(), NATIVE_STEP_S)
            for plant in self.plants
        ]
        for side, one in zip(SIDES, self._boards, strict=False):
            TandemPort(one, f"simulated board, {side}", tandem)
        self.ports = tuple(tandem)
        self.rigs = tuple(BoardRig(port, rig_settings or RigSettings()) for port in tandem)
        self._shapes: deque[tuple[float, tuple[FloatArray, FloatArray]]] = deque(
            maxlen=round(KEPT_S / SEEN_S)
        )
        self._seen_due = 0.0
        self.on_step: Callable[[float], None] = lambda time: None
        tandem[-1].on_step = self._look
        self._cameras = tuple(self._rendered(number, streams[number]) for number in (0, 1))
        self._angles = tuple(self._true(number, streams[2 + number]) for number in (0, 1))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def clock(self) -> Clock:
        """The bench's time; sleeping on it steps everything."""
        return self.ports[0].clock

    @property
    def cameras(self) -> tuple[RenderedCamera, ...]:
        """Rendered frames of the right and the left finger."""
        return self._cameras

    @property
    def angles(self) -> tuple[TrueAngles, ...]:
        """Angles of the right and the left finger without pixels, as they lie in the picture."""
        return self._angles

    def close(self) -> None:
        """Switch the boards off."""
        for board in self._boards:
            board.close()

    def axes(self) -> tuple[BentAxis, BentAxis]:
        """Middle lines of both fingers now, each in its own frame of the picture, base at the origin."""
        right, left = self.gripper.fingers
        return (
            BentAxis(self.layout, SENSES[0] * right.unit_angles),
            BentAxis(self.layout, SENSES[1] * left.unit_angles),
        )

    def _look(self, time: float) -> None:
        if time >= self._seen_due:
            self._seen_due = time + SEEN_S - 1e-9
            right, left = self.gripper.fingers
            self._shapes.append((time, (SENSES[0] * right.unit_angles, SENSES[1] * left.unit_angles)))
        self.on_step(time)

    def _axis_at(self, number: int, time: float) -> BentAxis:
        """A finger's middle line at a time of the last two seconds."""
        later = self._shapes[-1]
        if time < later[0]:
            for earlier in reversed(self._shapes):
                if earlier[0] <= time:
                    share = (time - earlier[0]) / max(later[0] - earlier[0], 1e-9)
                    before, after = earlier[1][number], later[1][number]
                    return BentAxis(self.layout, before + share * (after - before))
                later = earlier
        return BentAxis(self.layout, later[1][number])

    def _rendered(self, number: int, stream: np.random.Generator) -> RenderedCamera:
        camera = self.settings[number].camera
        chance, noise = stream.spawn(2)
        drawer = FrameDrawer(self.layout, LENS, PLANE, Exposure(read_noise=camera.read_noise), noise)
        return RenderedCamera(
            Deliveries(camera, self.clock, chance, lambda time: False),
            lambda time: self._axis_at(number, time),
            lambda axes, time: drawer.draw(axes),
            (LENS.width, LENS.height),
            self.clock,
            1e-3 * camera.exposure_ms,
        )

    def _true(self, number: int, stream: np.random.Generator) -> TrueAngles:
        camera = self.settings[number].camera
        chance, noise = stream.spawn(2)
        return TrueAngles(
            Deliveries(camera, self.clock, chance, lambda time: False),
            lambda time: self._axis_at(number, time),
            camera,
            self.layout,
            noise,
            lambda time: False,
        )


def _gripper(settings: tuple[BenchSettings, BenchSettings], make: GripperMake, held: HeldObject) -> Gripper:
    laws, memories = [], []
    for bench in settings:
        finger = bench.finger
        if finger.law != "chain":
            raise ConfigError(f"a gripper's finger needs law = chain, not {finger.law}")
        if finger.units is not None:
            raise ConfigError(f"units = {finger.units}: a gripper's finger has its model's; leave it out")
        law, memory = law_of(finger, bench.climate.start_k)
        laws.append(law.with_scale(finger.stiffness))
        memories.append(memory)
    seams = (settings[0].finger.seam_stiffening, settings[1].finger.seam_stiffening)
    return Gripper(SceneParts((laws[0], laws[1]), make, held), (memories[0], memories[1]), seams)


def _joined(settings: BenchSettings) -> BenchSettings:
    """Settings of one bench that feeds two fingers: twice the chambers' bubbles, half the tube's
    resistance."""
    finger, branches = settings.finger, settings.branches
    doubled = {
        "bubble_right_ml": 2 * finger.bubble_right_ml,
        "bubble_left_ml": 2 * finger.bubble_left_ml,
    }
    halved = {"tube_kpa_s_per_ml": branches.tube_kpa_s_per_ml / 2}
    return settings.model_copy(
        update={"finger": finger.model_copy(update=doubled), "branches": branches.model_copy(update=halved)}
    )
