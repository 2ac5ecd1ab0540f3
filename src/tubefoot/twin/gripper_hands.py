"""Simulated hands of a grasp: they place and release the object, carry the gripper up, shake it, and set it
down.

The base does not move in the scene; what is carried with it feels the opposite acceleration beside its
weight. A lift follows the smoothest course (least jerk): s = h (10 r^3 - 15 r^4 + 6 r^5) with r the share of
its time.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.twin.finger_body import METRE
from tubefoot.twin.gripper import Gripper
from tubefoot.twin.gripper_bench import GripperBench

FloatArray = NDArray[np.float64]

PLACING_S, RELEASING_S = 0.5, 0.1
"""Time that hands take to place the object, and to let go [s]."""
SHAKE_START = 0.25
"""Share of a shaking's time over which it swells, and fades [-]."""
LOST_MM = 15.0
"""An object that has moved so far against a finger is not held any more [mm]."""


class SimulatedHands:
    """Hands at a virtual gripper.

    slip : of the object since the hand let go
    """

    def __init__(
        self,
        bench: GripperBench,
        height: float,
        error: tuple[float, float, float] = (0.0, 0.0, 0.0),
        lift: tuple[float, float] = (30.0, 3.0),
        shake: tuple[float, float, float] = (2.0, 2.0, 2.0),
        empty: bool = False,
    ):
        """Stand at the bench.

        bench : the gripper's; height : where the object's middle is to be [mm]
        error : of the placement [mm]; lift : height and duration [mm, s]
        shake : amplitude, frequency, duration of each way [mm, Hz, s]; empty : the hands hold nothing
        """
        self._empty = empty
        self._held, self._slipped, self._peaks = False, 0.0, (0.0, 0.0)
        self._gripper = bench.gripper
        self._bench = bench
        self._at = (error[0], error[1], height + error[2])
        self._lift, self._shake = lift, shake
        self._course: Callable[[float], tuple[float, float, float]] | None = None
        self._began = self._ends = 0.0
        self.slip = SlipGauge(self._gripper)
        bench.on_step = self._carry

    def place(self) -> float:
        """Hold the object between the fingers."""
        if not self._empty:
            self._gripper.place(self._at)
        return PLACING_S

    def release(self) -> float:
        """Let go of it."""
        self._gripper.release()
        self.slip.begin()
        return RELEASING_S

    def lift(self) -> float:
        """Lift the gripper."""
        return self._move(self._raising(1.0), self._lift[1])

    def lower(self) -> float:
        """Set it down; whether it was held until now is noted."""
        self._held = self.slip.held
        self._slipped = self.slip.most
        self._peaks = (max(self._gripper.peak_normal), max(self._gripper.peak_crest))
        return self._move(self._raising(-1.0), self._lift[1])

    def shake(self) -> float:
        """Shake it up and down, then sideways."""
        size, rate, lasting = self._shake
        peak = size * (2 * pi * rate) ** 2

        def course(time: float) -> tuple[float, float, float]:
            way, at = divmod(time, lasting)
            swell = min(1.0, at / lasting / SHAKE_START, (1.0 - at / lasting) / SHAKE_START)
            pushed = peak * swell * sin(2 * pi * rate * at)
            return (0.0, 0.0, pushed) if way < 1 else (pushed, 0.0, 0.0)

        return self._move(course, 2 * lasting)

    def columns(self) -> dict[str, float]:
        """What is true now: forces, slip, place of the object, column by column."""
        right, left = self._gripper.touches()
        x, y, z = (float(value) for value in self._gripper.object_at)
        return {
            "true_force_right_n": right.normal,
            "true_force_left_n": left.normal,
            "contact_height_right_mm": right.height,
            "contact_height_left_mm": left.height,
            "slip_mm": self.slip.now(),
            "object_x_mm": x,
            "object_y_mm": y,
            "object_z_mm": z,
        }

    def verdict(self) -> dict[str, Any]:
        """What the grasp came to: held until it was set down, slip and largest forces up to then."""
        return {
            "held": self._held,
            "slip_mm": self._slipped if self._held else self.slip.most,
            "peak_force_n": self._peaks[0] if self._held else max(self._gripper.peak_normal),
            "peak_crest_force_n": self._peaks[1] if self._held else max(self._gripper.peak_crest),
            "first_touch_s": list(self._gripper.first_touch),
        }

    def _raising(self, way: float) -> Callable[[float], tuple[float, float, float]]:
        height, lasting = self._lift

        def course(time: float) -> tuple[float, float, float]:
            r = time / lasting
            return 0.0, 0.0, way * height / lasting**2 * (60 * r - 180 * r**2 + 120 * r**3)

        return course

    def _move(self, course: Callable[[float], tuple[float, float, float]], lasting: float) -> float:
        self._course, self._began = course, self._bench.clock.now()
        self._ends = self._began + lasting
        return lasting

    def _carry(self, time: float) -> None:
        """After each step: accelerate the base as the course says."""
        if self._course is None:
            return
        if time >= self._ends:
            self._course = None
            self._gripper.accelerate((0.0, 0.0, 0.0))
        else:
            self._gripper.accelerate(self._course(time - self._began))


class SlipGauge:
    """How far the object has moved on the fingers: two points that touched, one of each body, and their
    distance.

    most : largest since the begin [mm]
    """

    def __init__(self, gripper: Gripper):
        """Watch a gripper.

        gripper : with its object
        """
        self._gripper = gripper
        self._pairs: list[tuple[int, int, FloatArray, FloatArray]] = []
        self.most = 0.0

    def begin(self) -> None:
        """Mark the points that touch now, on each finger."""
        data = self._gripper.data
        self._pairs, self.most = [], 0.0
        for side in (0, 1):
            found = self._gripper.reader.main_crest(side)
            if found is not None:
                link, body, place = found
                own = [data.xmat[b].reshape(3, 3).T @ (place - data.xpos[b]) for b in (link, body)]
                self._pairs.append((link, body, own[0], own[1]))

    def now(self) -> float:
        """Largest of both fingers' distances now [mm]; 0 before it has begun."""
        data, apart = self._gripper.data, 0.0
        for link, body, on_link, on_body in self._pairs:
            there = data.xpos[link] + data.xmat[link].reshape(3, 3) @ on_link
            here = data.xpos[body] + data.xmat[body].reshape(3, 3) @ on_body
            apart = max(apart, float(np.linalg.norm(here - there)) * METRE)
        self.most = max(self.most, apart)
        return apart

    @property
    def held(self) -> bool:
        """Whether both fingers touch the object and it is still between them."""
        right, left = self._gripper.touches()
        return right.normal > 0.0 and left.normal > 0.0 and self.now() < LOST_MM
