"""The finger's state from its markers: bending angle at the tip marker, centreline, theta1 and theta2."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.units import DEG
from tubefoot.vision.calibration import CameraCalibration
from tubefoot.vision.centreline import Centreline, MarkedPoint, chord_angles, fit_centreline
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.plane import PlaneMap, wrap_angle
from tubefoot.vision.tracker import MarkerReading, MarkerTracker
from tubefoot.vision.verdict import Acceptance

NAN = float("nan")


@dataclass(frozen=True)
class FingerReading:
    """One frame's measurement; angles are NaN where this frame does not determine them.

    time_s : capture time [s]
    bend : angle of the tip marker against the straight finger [rad], positive towards -x
    sigma : its standard uncertainty [rad]
    theta1, theta2 : turn of the centreline over the lower and the upper half, tangent form [rad]
    theta_sigma : standard uncertainties of theta1 and theta2 [rad]
    theta1_chord, theta2_chord : the same from midpoints of the markers' lower edges [rad]
    quality : of the tip marker, 0 to 1
    fault : why the tip is lost, empty when it is not
    markers : reading of each marker by id
    centreline : the curve, None when there are too few markers
    """

    time_s: float
    bend: float
    sigma: float
    theta1: float
    theta2: float
    theta_sigma: tuple[float, float]
    theta1_chord: float
    theta2_chord: float
    quality: float
    fault: str
    markers: Mapping[int, MarkerReading]
    centreline: Centreline | None

    @property
    def lost(self) -> bool:
        """Whether the bending angle is unknown in this frame."""
        return bool(self.fault)

    @property
    def visible_markers(self) -> int:
        """How many markers were measured."""
        return sum(not reading.lost for reading in self.markers.values())

    def columns(self) -> dict[str, float]:
        """What of it is recorded, by column: angles with their uncertainty [deg], quality."""
        angles = {"bend_deg": self.bend, "sigma_deg": self.sigma}
        angles |= {"theta1_deg": self.theta1, "theta2_deg": self.theta2}
        return {key: angle / DEG for key, angle in angles.items()} | {"quality": self.quality}


@dataclass
class FingerTracker:
    """Turns frames into finger readings.

    calibration : camera, plane and zero
    layout : markers on the finger
    limits : what a marker must meet to count
    """

    calibration: CameraCalibration
    layout: MarkerLayout
    limits: Acceptance = field(default_factory=lambda: Acceptance())

    def __post_init__(self) -> None:
        self.plane_map = PlaneMap(self.calibration.to_lens(), self.calibration.to_plane())
        self._tracker = MarkerTracker(
            self.plane_map,
            self.layout,
            self.limits,
            self.calibration.line_time_us * 1e-6,
            self.calibration.plane.tilt_sigma_deg * DEG,
        )
        self._zero = {
            place.id: place.angle_deg * DEG + self.calibration.zero_angle_deg.get(str(place.id), 0.0) * DEG
            for place in self.layout.markers
        }

    def measure(self, frame: NDArray[np.uint8], time_s: float) -> FingerReading:
        """The finger's state in one frame.

        frame : (height, width) or (height, width, 3), of the calibrated size; another raises ConfigError
        time_s : capture time [s]
        """
        lens = self.plane_map.lens
        if frame.shape[:2] != (lens.height, lens.width):
            raise ConfigError(
                f"the frame is {frame.shape[1]} x {frame.shape[0]} px but the calibration holds for "
                f"{lens.width} x {lens.height} px; set the camera to that size or calibrate at this one"
            )
        readings = self._tracker.measure(frame, time_s)
        tip = readings[self.layout.markers[-1].id]
        points = [self._marked(place.id, place.z_mm, readings[place.id]) for place in self.layout.markers]
        seen = [point for point in points if point is not None]
        line = fit_centreline(
            seen, self.layout.length_mm, self.layout.rigid_base_mm, self.layout.rigid_tip_mm
        )
        theta1, theta2 = line.thetas if line else (NAN, NAN)
        chords = chord_angles(seen, self.layout.length_mm, self.layout.marker_side_mm)
        tip_angle = tip.pose.angle - self._zero[tip.marker_id] if tip.pose else NAN
        return FingerReading(
            time_s=time_s,
            bend=wrap_angle(tip_angle),
            sigma=float(np.sqrt(tip.covariance[2, 2])) if tip.covariance is not None else NAN,
            theta1=theta1,
            theta2=theta2,
            theta_sigma=line.theta_sigma if line else (NAN, NAN),
            theta1_chord=chords[0],
            theta2_chord=chords[1],
            quality=tip.quality,
            fault=tip.fault,
            markers=readings,
            centreline=line,
        )

    def _marked(self, marker_id: int, height: float, reading: MarkerReading) -> MarkedPoint | None:
        """A marker as a point of the centreline: where the finger's middle line is, and its direction."""
        if reading.pose is None or reading.covariance is None:
            return None
        place = next(place for place in self.layout.markers if place.id == marker_id)
        angle = wrap_angle(reading.pose.angle - self._zero[marker_id])
        x = reading.pose.x - place.x_mm * np.cos(angle)
        z = reading.pose.z - place.x_mm * np.sin(angle)
        sigma_place = float(np.sqrt(np.trace(reading.covariance[:2, :2]) / 2))
        return MarkedPoint(
            height, float(x), float(z), angle, sigma_place, float(np.sqrt(reading.covariance[2, 2]))
        )
