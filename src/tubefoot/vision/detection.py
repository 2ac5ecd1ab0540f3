"""Detection: markers found in a picture without knowing where they are, by OpenCV's detector.

It says which markers there are and roughly where; `alignment` then finds the pose. Settings follow
measurements: no corner refinement (alignment does better), no `useAruco3Detection`, and a minimum size
inside small regions.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.lens import FloatArray
from tubefoot.vision.marker import find_dictionary
from tubefoot.vision.plane import PlanarPose, PlaneMap


@dataclass(frozen=True)
class Sighting:
    """A marker that the detector read.

    marker_id : its number
    corners : (4, 2) pixels: top left, top right, bottom right, bottom left of the marker
    """

    marker_id: int
    corners: FloatArray

    def pose(self, plane_map: PlaneMap, side: float) -> tuple[PlanarPose, float]:
        """Pose in the plane by the best-fitting rotation, and the logarithm of its size over the nominal one.

        plane_map : plane point of each pixel
        side : nominal side of the marker [mm]
        """
        points = plane_map.plane.from_pixels(self.corners, plane_map.lens)
        ideal = side / 2 * np.array([[-1.0, 1], [1, 1], [1, -1], [-1, -1]])
        centre = points.mean(axis=0)
        arms = points - centre
        turn = np.sum(ideal[:, 0] * arms[:, 1] - ideal[:, 1] * arms[:, 0])
        along = np.sum(ideal * arms)
        size = np.hypot(turn, along) / np.sum(ideal**2)
        return PlanarPose(float(centre[0]), float(centre[1]), float(np.arctan2(turn, along))), float(
            np.log(size)
        )


class MarkerFinder:
    """OpenCV's detector for one dictionary, for whole frames and for small regions."""

    def __init__(self, dictionary: str, least_side_px: float = 12.0):
        """Prepare the two detectors.

        dictionary : name of the marker dictionary
        least_side_px : smallest marker worth reading [px]
        """
        self._codes = find_dictionary(dictionary)
        self._least_side = least_side_px
        self._in_region = cv2.aruco.ArucoDetector(self._codes, _parameters(0.8, (7, 15, 8)))
        self._in_frame: dict[int, cv2.aruco.ArucoDetector] = {}

    def find(self, frame: NDArray[np.uint8]) -> list[Sighting]:
        """All markers in a whole frame.

        frame : (height, width) grey picture
        """
        longest = max(frame.shape)
        if longest not in self._in_frame:
            rate = 4 * self._least_side / longest
            self._in_frame[longest] = cv2.aruco.ArucoDetector(self._codes, _parameters(rate, (5, 21, 8)))
        return _sightings(self._in_frame[longest], frame, 0, 0)

    def find_near(self, frame: NDArray[np.uint8], centre: FloatArray, reach_px: float) -> list[Sighting]:
        """Markers in a square region.

        frame : (height, width) grey picture
        centre : (2,) middle of the region [px]
        reach_px : half its side [px]
        """
        x0, y0 = (int(value) for value in np.clip(np.floor(centre - reach_px), 0, frame.shape[::-1]))
        x1, y1 = (int(value) for value in np.clip(np.ceil(centre + reach_px), 0, frame.shape[::-1]))
        if x1 - x0 < 2 * self._least_side or y1 - y0 < 2 * self._least_side:
            return []
        return _sightings(self._in_region, np.ascontiguousarray(frame[y0:y1, x0:x1]), x0, y0)


def _parameters(perimeter_rate: float, windows: tuple[int, int, int]) -> cv2.aruco.DetectorParameters:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    parameters.minMarkerDistanceRate = 0.05
    parameters.minMarkerPerimeterRate = perimeter_rate
    parameters.adaptiveThreshWinSizeMin, parameters.adaptiveThreshWinSizeMax = windows[0], windows[1]
    parameters.adaptiveThreshWinSizeStep = windows[2]
    parameters.errorCorrectionRate = 0.0
    return parameters


def _sightings(
    detector: cv2.aruco.ArucoDetector, picture: NDArray[np.uint8], x0: int, y0: int
) -> list[Sighting]:
    corners, ids, _ = detector.detectMarkers(picture)
    if ids is None:
        return []
    offset = np.array([x0, y0], dtype=float)
    return [
        Sighting(int(marker), quad.reshape(4, 2).astype(float) + offset)
        for marker, quad in zip(np.ravel(ids), corners, strict=True)
    ]
