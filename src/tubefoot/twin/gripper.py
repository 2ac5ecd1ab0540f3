"""Two fingers and an object in one scene, stepped together.

Each finger answers to its own fluid (`FingerResponse`). When both have been told their pressures for a step
the scene moves: `advance` of the second finger moves it. Lengths of steps must agree; `gripper_plant` sees to
that. MPa, mm^3, s, mm outside; the scene is in SI units.
"""

from __future__ import annotations

from math import ceil

import mujoco
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.reduced.relaxation import NO_RELAXATION, Prony
from tubefoot.twin.finger import FingerChain
from tubefoot.twin.finger_body import METRE
from tubefoot.twin.finger_response import Volumes
from tubefoot.twin.gripper_scene import SIDES, TIME_STEP_S, SceneParts, compiled_scene
from tubefoot.twin.touch import Touch, TouchReader

FloatArray = NDArray[np.float64]

TOUCH_N = 1e-3
"""Normal force from which on a finger counts as touching [N]."""
LOOK_S = 20e-3
"""How often forces are looked at for their peaks [s]."""


class GripperFinger:
    """One finger of a gripper; fulfils `FingerResponse`."""

    def __init__(self, gripper: Gripper, side: int, chain: FingerChain, own_scale: float):
        """Take a finger of a scene.

        gripper : that moves it; side : 0 right, 1 left; chain : its links and law
        own_scale : stiffness of its wall over the identified one
        """
        self.chain = chain
        self.pressures = (0.0, 0.0)
        self._gripper = gripper
        self._side = side
        self._own_scale = own_scale

    @property
    def unit_angles(self) -> FloatArray:
        """Angle of each unit, from the base, inward positive [rad]."""
        return self.chain.angles.copy()

    @property
    def bend(self) -> float:
        """Direction of the tip, inward positive [rad]."""
        return float(self.chain.angles.sum())

    def volumes(self, right: float, left: float, duration: float) -> Volumes:
        """Volume changes of the chambers at the present angles and their derivatives.

        right, left : pressures at the end of the step [MPa]; duration : of the step [s]
        """
        self._gripper.divide(duration)
        return self.chain.wall.volumes(right, left)

    def advance(self, right: float, left: float, duration: float) -> None:
        """Hand in the pressures of a step; the gripper moves when the other finger's are there too.

        right, left : chamber pressures [MPa]; duration : of the step [s]
        """
        self.pressures = (right, left)
        self._gripper.arrived(self._side, duration)

    def scale_stiffness(self, factor: float) -> None:
        """Make the wall stiffer or softer than that of the finger it was built from.

        factor : on every modulus
        """
        self.chain.wall.scale = self._own_scale * factor


class PairedFinger:
    """Both fingers on one pump: a splitter at the base joins their right and their left chambers."""

    def __init__(self, one: GripperFinger, other: GripperFinger):
        """Join them.

        one, other : fingers of one gripper
        """
        self._both = (one, other)

    @property
    def unit_angles(self) -> FloatArray:
        """Angles of the right finger's units [rad]."""
        return self._both[0].unit_angles

    @property
    def bend(self) -> float:
        """Bend of the right finger [rad]."""
        return self._both[0].bend

    def volumes(self, right: float, left: float, duration: float) -> Volumes:
        """Sum of both fingers' volumes and derivatives.

        right, left : pressures at the end of the step [MPa]; duration : of the step [s]
        """
        one, other = (finger.volumes(right, left, duration) for finger in self._both)
        total = [mine + yours for mine, yours in zip(one, other, strict=True)]
        return total[0], total[1], total[2], total[3], total[4]

    def advance(self, right: float, left: float, duration: float) -> None:
        """Both fingers get the same pressures.

        right, left : [MPa]; duration : [s]
        """
        for finger in self._both:
            finger.advance(right, left, duration)

    def scale_stiffness(self, factor: float) -> None:
        """Scale both walls.

        factor : on every modulus
        """
        for finger in self._both:
            finger.scale_stiffness(factor)


class Gripper:
    """The scene.

    fingers : right and left
    time : since the start [s]
    first_touch : when each finger first touched the object since it was placed [s]; None before
    peak_normal, peak_crest : largest normal force of a finger, and of one crest end, since it was placed [N]
    """

    def __init__(
        self,
        parts: SceneParts,
        memories: tuple[Prony, Prony] = (NO_RELAXATION, NO_RELAXATION),
        seams: tuple[float, float] = (0.0, 0.0),
        gravity: bool = True,
    ):
        """Build it, straight and at rest, the object out of reach.

        parts : fingers, gripper, object; memories : relaxation of the walls
        seams : bending stiffness added by the bond, share of a unit's own; gravity : whether weight acts
        """
        self.held = parts.held
        self.model = compiled_scene(parts, gravity)
        self.data = mujoco.MjData(self.model)
        chains = [
            FingerChain(self.model, self.data, finger, prony, seam, side)
            for finger, prony, seam, side in zip(parts.fingers, memories, seams, SIDES, strict=True)
        ]
        right, left = (
            GripperFinger(self, number, chain, finger.scale)
            for number, (chain, finger) in enumerate(zip(chains, parts.fingers, strict=True))
        )
        self.fingers = (right, left)
        self.reader = TouchReader(self.model, self.data, (parts.fingers[0].n_units, parts.fingers[1].n_units))
        self.first_touch: list[float | None] = [None, None]
        self.peak_normal, self.peak_crest = [0.0, 0.0], [0.0, 0.0]
        self._gravity = np.array(self.model.opt.gravity)
        self._handed_in: dict[int, float] = {}
        self._watching = False
        self._look_due = 0.0
        mujoco.mj_forward(self.model, self.data)
        for finger in self.fingers:
            finger.chain.prepare()

    @property
    def time(self) -> float:
        """Time of the scene [s]."""
        return float(self.data.time)

    # ---- the object ----------------------------------------------------------------------------------------

    def place(self, at: tuple[float, float, float]) -> None:
        """Put the object between the fingers and hold it there.

        at : its middle [mm]
        """
        self._demand_object()
        where = np.array(at) / METRE
        start = int(self.model.joint("object").qposadr[0])
        moving = int(self.model.joint("object").dofadr[0])
        self.data.qpos[start:] = self.model.qpos0[start:]
        self.data.qpos[start : start + 3] = where
        self.data.qvel[moving:] = 0.0
        self.data.mocap_pos[0] = where
        self.data.eq_active[0] = 1
        mujoco.mj_forward(self.model, self.data)
        self.first_touch = [None, None]
        self.peak_normal, self.peak_crest = [0.0, 0.0], [0.0, 0.0]
        self._watching = True

    def release(self) -> None:
        """Let go of the object."""
        self._demand_object()
        self.data.eq_active[0] = 0

    @property
    def object_at(self) -> FloatArray:
        """Middle of the object (3,) [mm]."""
        return np.array(self.data.body("object").xpos) * METRE

    def touches(self) -> tuple[Touch, Touch]:
        """What the right and the left finger do to the object now."""
        return self.reader.read()

    def accelerate(self, acceleration: tuple[float, float, float]) -> None:
        """Carry the base along: in its frame everything feels the opposite beside its weight.

        acceleration : of the base [mm/s^2]
        """
        self.model.opt.gravity[:] = self._gravity - np.array(acceleration) / METRE

    def _demand_object(self) -> None:
        if self.held is None:
            raise ConfigError("this gripper has no object; build it with one")

    # ---- time ----------------------------------------------------------------------------------------------

    def divide(self, duration: float) -> int:
        """Number of the scene's steps that make a step of the fluid; prepares anew where their length
        changes.

        duration : of the fluid's step [s]
        """
        count = max(1, ceil(duration / TIME_STEP_S - 1e-9))
        if self.model.opt.timestep != duration / count:
            self.model.opt.timestep = duration / count
            for finger in self.fingers:
                finger.chain.prepare()
        return count

    def arrived(self, side: int, duration: float) -> None:
        """One finger's pressures are there; with both the scene moves on.

        side : 0 right, 1 left; duration : of the step [s]
        """
        self._handed_in[side] = duration
        if len(self._handed_in) < 2:
            return
        one, other = self._handed_in.values()
        assert abs(one - other) < 1e-9, "both fingers must step together"
        self._handed_in.clear()
        self._advance(duration)

    def _advance(self, duration: float) -> None:
        for _ in range(self.divide(duration)):
            for finger in self.fingers:
                finger.chain.apply(*finger.pressures)
            mujoco.mj_step(self.model, self.data)
            for finger in self.fingers:
                finger.chain.prepare()
        if self._watching and self.data.ncon and self.data.time >= self._look_due:
            self._look_due = self.data.time + LOOK_S
            self._look()

    def _look(self) -> None:
        """Note first touches and peaks."""
        for side, touch in enumerate(self.touches()):
            self.peak_normal[side] = max(self.peak_normal[side], touch.normal)
            self.peak_crest[side] = max(self.peak_crest[side], touch.largest)
            if self.first_touch[side] is None and touch.normal > TOUCH_N:
                self.first_touch[side] = self.time
