"""Lens: where a point in front of the camera falls in the picture, and back.

Pinhole with Brown-Conrady distortion (k1, k2, p1, p2, k3) as in OpenCV; the centre of the top left pixel is
(0, 0), so that a centred principal point is ((width - 1) / 2, (height - 1) / 2). Camera frame: x right, y
down, z forward [mm].
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

INVERSION_STEPS = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 60, 1e-13)
"""When to stop inverting the distortion; OpenCV's default leaves up to 0.01 px."""


@dataclass(frozen=True)
class Lens:
    """Intrinsics of one camera at one resolution.

    width, height : picture size [px]
    focal_x, focal_y : focal lengths [px]
    centre_x, centre_y : principal point [px]
    distortion : k1, k2, p1, p2, k3
    """

    width: int
    height: int
    focal_x: float
    focal_y: float
    centre_x: float
    centre_y: float
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    matrix: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows = [[self.focal_x, 0, self.centre_x], [0, self.focal_y, self.centre_y], [0, 0, 1]]
        object.__setattr__(self, "matrix", np.array(rows, dtype=float))

    @classmethod
    def centred(
        cls, width: int, height: int, focal: float, distortion: tuple[float, ...] = (0.0,) * 5
    ) -> Lens:
        """A lens with square pixels and its axis through the middle of the picture.

        width, height : picture size [px]
        focal : focal length [px]
        distortion : k1, k2, p1, p2, k3
        """
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, distortion)

    def project(self, points: ArrayLike) -> FloatArray:
        """Pixels (n, 2) at which points in the camera frame appear.

        points : (n, 3) [mm], in front of the camera
        """
        flat = np.ascontiguousarray(points, dtype=float).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(flat, np.zeros(3), np.zeros(3), self.matrix, np.array(self.distortion))
        return np.asarray(pixels, dtype=float).reshape(-1, 2)

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """Rays (n, 3) through pixels, scaled to unit depth.

        pixels : (n, 2) [px]
        """
        flat = np.ascontiguousarray(pixels, dtype=float).reshape(-1, 1, 2)
        normal = cv2.undistortPoints(
            flat, self.matrix, np.array(self.distortion), None, None, None, INVERSION_STEPS
        )
        return np.column_stack([normal.reshape(-1, 2), np.ones(len(flat))])
