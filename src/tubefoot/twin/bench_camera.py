"""Cameras of the virtual bench: when frames come, and what is in them, with pixels or without.

Frames are taken at an even rate and arrive one latency later, jittering; some never do. Waiting for a frame
steps the one clock of the bench. What came while the reader did something else is kept like in a driver with
a buffer of one: only the newest. When nothing comes for too long, the camera counts as lost (LinkError).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import LinkError
from tubefoot.lab.clock import Clock
from tubefoot.twin.bench_settings import CameraMake
from tubefoot.twin.bent_axis import BentAxis
from tubefoot.units import DEG
from tubefoot.vision.camera import CameraBase, Frame, fresh
from tubefoot.vision.finger import FingerReading
from tubefoot.vision.layout import MarkerLayout

OLDEST_S = 0.25
LEAST_LATENCY_S = 1e-3
BLUR_DEG = 0.02
"""Turn of the tip during the exposure from which on the frame is blurred by the motion [deg]."""
INSTANTS = 3

AxisAt = Callable[[float], BentAxis]
"""The finger's middle line at a time of the near past [s]."""


@dataclass(frozen=True, slots=True)
class Exposed:
    """One frame on its way: number, middle of its exposure and arrival [s], whether it arrives."""

    index: int
    taken: float
    arrival: float
    arrives: bool


class Deliveries:
    """The frames of a run in order; the same generator gives the same frames, however they are read."""

    def __init__(
        self, make: CameraMake, clock: Clock, chance: np.random.Generator, blind: Callable[[float], bool]
    ):
        """Start the camera.

        make : rate, latency, jitter, drops
        clock : of the bench; sleeping on it steps the bench
        chance : of jitter and drops
        blind : whether the camera is lost at a time [s]
        """
        self._make = make
        self._clock = clock
        self._chance = chance
        self._blind = blind
        self._start = float(chance.uniform(0.0, 1.0 / make.frames_per_s))
        self._next = self._expose(0, 0.0)
        self._held: Exposed | None = None

    def wait(self) -> Exposed:
        """The newest frame not yet taken, after waiting for it if need be; LinkError when none comes."""
        self._collect()
        deadline = self._clock.now() + self._make.timeout_s
        while self._held is None:
            if self._next.arrival > deadline:
                self._clock.sleep(deadline - self._clock.now())
                raise LinkError(
                    f"the camera delivered no frame for {self._make.timeout_s:g} s; check its cable and power"
                )
            self._clock.sleep(self._next.arrival - self._clock.now())
            self._collect()
        taken, self._held = self._held, None
        return taken

    def _collect(self) -> None:
        """Keep the newest of the frames that have arrived."""
        now = self._clock.now() + 1e-9
        while self._next.arrival <= now:
            if self._next.arrives:
                self._held = self._next
            self._next = self._expose(self._next.index + 1, self._next.arrival)

    def _expose(self, index: int, after: float) -> Exposed:
        make = self._make
        taken = self._start + index / make.frames_per_s
        jitter, luck = float(self._chance.standard_normal()), float(self._chance.random())
        latency = max(1e-3 * (make.latency_ms + jitter * make.jitter_ms), LEAST_LATENCY_S)
        arrival = max(taken + latency, taken + 0.5e-3 * make.exposure_ms, after + 1e-4)
        return Exposed(index, taken, arrival, luck >= make.drop_share and not self._blind(taken))


class RenderedCamera(CameraBase):
    """Frames of the finger, drawn when they are taken from the camera."""

    paced = True

    def __init__(
        self,
        deliveries: Deliveries,
        axis_at: AxisAt,
        draw: Callable[[list[BentAxis], float], NDArray[np.uint8]],
        resolution: tuple[int, int],
        clock: Clock,
        exposure_s: float,
    ):
        """Point it at the finger.

        deliveries : when frames come
        axis_at : where the finger was
        draw : a picture of middle lines at instants of the exposure about a time [s]
        resolution : width and height [px]
        clock : of the bench
        exposure_s : [s]
        """
        self.resolution = resolution
        self._deliveries = deliveries
        self._axis_at = axis_at
        self._draw = draw
        self._clock = clock
        self._exposure = exposure_s
        self._is_open = False

    def open(self) -> None:
        """Start delivering."""
        self._is_open = True

    def read(self) -> Frame:
        """The next frame; LinkError when the camera is closed or lost, StaleFrameError for an old frame."""
        _demand_open(self._is_open)
        exposed = self._deliveries.wait()
        frame = Frame(self._draw(self._axes(exposed.taken), exposed.taken), exposed.index, exposed.taken)
        return fresh(frame, self._clock.now, OLDEST_S)

    def close(self) -> None:
        """Stop delivering."""
        self._is_open = False

    def _axes(self, taken: float) -> list[BentAxis]:
        """The finger during the exposure: once where it stands, at several instants where it moves."""
        first, last = (self._axis_at(taken + share * self._exposure) for share in (-0.5, 0.5))
        if abs(first.tip_direction - last.tip_direction) < BLUR_DEG * DEG:
            return [self._axis_at(taken)]
        offsets = (np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5
        return [self._axis_at(taken + float(offset) * self._exposure) for offset in offsets]


class TrueAngles:
    """Angles without pixels: the truth at the exposure with the vision's measured scatter and zero error."""

    paced = True

    def __init__(
        self,
        deliveries: Deliveries,
        axis_at: AxisAt,
        make: CameraMake,
        layout: MarkerLayout,
        noise: np.random.Generator,
        hidden: Callable[[float], bool],
    ):
        """Look at the finger.

        deliveries : when frames come
        axis_at : where the finger was
        make : scatter, zero error, scale
        layout : its last marker gives the angle
        noise : of the angles
        hidden : whether the tip marker is covered at a time [s]
        """
        self._deliveries = deliveries
        self._axis_at = axis_at
        self._make = make
        self._heights = [layout.length_mm / 2, layout.length_mm, layout.markers[-1].z_mm]
        self._noise = noise
        self._hidden = hidden
        self._is_open = False

    def open(self) -> None:
        """Start delivering."""
        self._is_open = True

    def read(self) -> FingerReading:
        """The next reading; LinkError when closed or lost."""
        _demand_open(self._is_open)
        exposed = self._deliveries.wait()
        make, taken = self._make, exposed.taken
        sigma = make.angle_sigma_deg * DEG
        errors = sigma * self._noise.standard_normal(3)
        _, (middle, tip, marked) = self._axis_at(taken).at(self._heights)
        nan = float("nan")
        lost = self._hidden(taken)
        bend = nan if lost else make.angle_gain * float(marked) + make.angle_offset_deg * DEG + errors[0]
        return FingerReading(
            time_s=taken,
            bend=bend,
            sigma=nan if lost else sigma,
            theta1=float(middle) + errors[1],
            theta2=nan if lost else float(tip - middle) + errors[2],
            theta_sigma=(sigma, nan if lost else sigma),
            theta1_chord=nan,
            theta2_chord=nan,
            quality=0.0 if lost else 1.0,
            fault="covered" if lost else "",
            markers={},
            centreline=None,
        )

    def close(self) -> None:
        """Stop delivering."""
        self._is_open = False


def _demand_open(is_open: bool) -> None:
    if not is_open:
        raise LinkError("the bench's camera is not open; open it first, or use it in a `with` block")
