"""Tracker: all markers of a layout from frame to frame, each one measured anew or reported lost.

A marker that was seen is expected where its motion takes it and aligned from there. If that fails the
region is searched, then the whole frame. A pose is always the outcome of this frame's pixels; nothing is
carried over.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.alignment import Fit, align_marker
from tubefoot.vision.camera import grey_picture
from tubefoot.vision.detection import MarkerFinder, Sighting
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.plane import PlanarPose, PlaneMap, wrap_angle
from tubefoot.vision.verdict import Acceptance, fault_of

LONGEST_GAP_S = 0.5
"""After this long unseen, a marker's last place says nothing any more."""


USUAL_BLUR_PX = 0.85
LARGEST_START_BLUR_PX = 1.5
"""One blurred frame must not spoil the next: a descent starts at a blur no larger than this [px]."""


@dataclass(frozen=True)
class MarkerReading:
    """What one frame says about one marker.

    marker_id : which marker
    fault : why it is lost; empty when it was measured
    pose : in the bending plane; None when lost
    covariance : (3, 3) of x, z [mm], angle [rad]; None when lost
    quality : correlation times visible share, 0 to 1; 0 when lost
    residual : misfit as a share of the contrast; NaN when lost
    visible : share of its area that was seen
    """

    marker_id: int
    fault: str
    pose: PlanarPose | None = None
    covariance: NDArray[np.float64] | None = None
    quality: float = 0.0
    residual: float = float("nan")
    visible: float = 0.0

    @property
    def lost(self) -> bool:
        """Whether this frame gives no pose."""
        return self.pose is None


@dataclass
class _Track:
    """What is remembered of a marker, for predicting only."""

    pose: PlanarPose
    time_s: float
    blur_px: float
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def predicted(self, time_s: float) -> PlanarPose:
        ahead = min(time_s - self.time_s, 0.1)
        return PlanarPose(
            self.pose.x + self.velocity[0] * ahead,
            self.pose.z + self.velocity[1] * ahead,
            self.pose.angle + self.velocity[2] * ahead,
        )


@dataclass
class MarkerTracker:
    """Measures the markers of one finger in each frame.

    plane_map : plane point of each pixel
    layout : the markers
    limits : what a measurement must meet
    line_time_s : row delay of a rolling shutter [s], 0 for a global one
    plane_sigma : standard uncertainty of the plane's tilt [rad]; enters the angle's uncertainty
    """

    plane_map: PlaneMap
    layout: MarkerLayout
    limits: Acceptance = field(default_factory=lambda: Acceptance())
    line_time_s: float = 0.0
    plane_sigma: float = 0.0

    def __post_init__(self) -> None:
        self._finder = MarkerFinder(self.layout.dictionary)
        self._tracks: dict[int, _Track] = {}

    def measure(self, frame: NDArray[np.uint8], time_s: float) -> dict[int, MarkerReading]:
        """A reading of each marker of the layout, by id.

        frame : (height, width) grey or (height, width, 3) colour picture
        time_s : its capture time [s], later than that of the frame before
        """
        grey = grey_picture(frame)
        readings = {place.id: self._follow(grey, place.id, time_s) for place in self.layout.markers}
        if any(reading.lost for reading in readings.values()):
            sightings = self._finder.find(grey)
            for marker_id, reading in readings.items():
                if reading.lost:
                    readings[marker_id] = self._search(grey, marker_id, time_s, sightings, reading.fault)
        return _without_overlaps(readings, self.layout)

    def _follow(self, grey: NDArray[np.uint8], marker_id: int, time_s: float) -> MarkerReading:
        """Align from the expected place."""
        track = self._tracks.get(marker_id)
        if track is None or not 0 <= time_s - track.time_s <= LONGEST_GAP_S:
            self._tracks.pop(marker_id, None)
            return MarkerReading(marker_id, "not found")
        start = track.predicted(time_s)
        reading = self._align(grey, marker_id, time_s, start, coarse=False)
        if not reading.lost:
            return reading
        centre = self.plane_map.to_pixels([[start.x, start.z]])[0]
        reach = 1.6 * self.layout.marker_side_mm * self.plane_map.pixels_per_mm((start.x, start.z))
        near = self._finder.find_near(grey, centre, reach)
        found = self._search(grey, marker_id, time_s, near, reading.fault)
        if not found.lost or any(sighting.marker_id != marker_id for sighting in near):
            return found
        return self._align(grey, marker_id, time_s, start, coarse=True)

    def _search(
        self, grey: NDArray[np.uint8], marker_id: int, time_s: float, sightings: list[Sighting], fault: str
    ) -> MarkerReading:
        """Align from a sighting, if there is exactly one that can be this marker."""
        side = self.layout.marker_side_mm
        starts = [
            sighting.pose(self.plane_map, side) for sighting in sightings if sighting.marker_id == marker_id
        ]
        fitting = [pose for pose, log_scale in starts if abs(log_scale) < self.limits.size + 0.15]
        if len(fitting) > 1:
            return MarkerReading(marker_id, "seen twice")
        if not fitting:
            return MarkerReading(marker_id, "wrong size" if starts else fault)
        return self._align(grey, marker_id, time_s, fitting[0], coarse=False)

    def _align(
        self, grey: NDArray[np.uint8], marker_id: int, time_s: float, start: PlanarPose, coarse: bool
    ) -> MarkerReading:
        track = self._tracks.get(marker_id)
        blur = min(track.blur_px, LARGEST_START_BLUR_PX) if track else USUAL_BLUR_PX
        drift = (0.0, 0.0)
        if track and self.line_time_s:
            drift = (track.velocity[0] * self.line_time_s, track.velocity[1] * self.line_time_s)
        target = self.layout.target(marker_id)
        fit = align_marker(grey, self.plane_map, target, start, blur, coarse, drift)
        fault = fault_of(fit, target, self.limits)
        if fault or fit is None:
            return MarkerReading(marker_id, fault)
        self._remember(marker_id, fit, time_s)
        covariance = fit.covariance.copy()
        covariance[2, 2] += self._plane_variance(fit.pose)
        quality = fit.correlation * min(fit.inliers, 1.0)
        return MarkerReading(
            marker_id, "", fit.pose, covariance, quality, fit.residual, min(fit.inliers, 1.0)
        )

    def _plane_variance(self, pose: PlanarPose) -> float:
        """Variance of the angle [rad^2] from an uncertain tilt: half the sine of the slant at most."""
        point = self.plane_map.plane.in_space([[pose.x, pose.z]])[0]
        cosine = point @ self.plane_map.plane.normal / np.linalg.norm(point)
        return float((1 - min(cosine**2, 1.0)) / 8 * self.plane_sigma**2 + (self.plane_sigma**2 / 4) ** 2)

    def _remember(self, marker_id: int, fit: Fit, time_s: float) -> None:
        track = self._tracks.get(marker_id)
        velocity = (0.0, 0.0, 0.0)
        if track is not None and 0 < time_s - track.time_s <= LONGEST_GAP_S:
            passed = time_s - track.time_s
            velocity = (
                (fit.pose.x - track.pose.x) / passed,
                (fit.pose.z - track.pose.z) / passed,
                wrap_angle(fit.pose.angle - track.pose.angle) / passed,
            )
        self._tracks[marker_id] = _Track(fit.pose, time_s, fit.blur_px, velocity)


def _without_overlaps(
    readings: Mapping[int, MarkerReading], layout: MarkerLayout
) -> dict[int, MarkerReading]:
    """The readings, those that claim the same place marked as lost: two markers cannot lie on each other."""
    kept = dict(readings)
    seen = [(marker_id, reading.pose) for marker_id, reading in readings.items() if reading.pose is not None]
    for index, (first, pose) in enumerate(seen):
        for second, other in seen[index + 1 :]:
            if np.hypot(pose.x - other.x, pose.z - other.z) < 0.7 * layout.marker_side_mm:
                for marker_id in (first, second):
                    kept[marker_id] = MarkerReading(marker_id, "overlaps another marker")
    return kept


def averaged(frames: Sequence[Mapping[int, MarkerReading]]) -> dict[int, MarkerReading]:
    """The mean reading of each marker over frames of a finger at rest; lost when most frames lost it.

    frames : readings by marker id, frame by frame, at least one
    """
    means = {}
    for marker_id, first in frames[0].items():
        seen = [frame[marker_id] for frame in frames]
        good = [
            (reading.pose, reading.covariance)
            for reading in seen
            if reading.pose is not None and reading.covariance is not None
        ]
        if 2 * len(good) <= len(frames):
            means[marker_id] = MarkerReading(marker_id, next(r.fault for r in seen if r.lost))
            continue
        origin = good[0][0]
        angles = [wrap_angle(pose.angle - origin.angle) for pose, _ in good]
        pose = PlanarPose(
            float(np.mean([pose.x for pose, _ in good])),
            float(np.mean([pose.z for pose, _ in good])),
            origin.angle + float(np.mean(angles)),
        )
        covariance = np.mean(np.stack([matrix for _, matrix in good]), axis=0) / len(good)
        means[marker_id] = MarkerReading(
            marker_id, "", pose, covariance, first.quality, first.residual, first.visible
        )
    return means
