"""The bending plane: where it lies before the camera, and which point of it each pixel shows.

A finger that bends in a plane needs no pose in space: a pixel's ray meets the plane in one point. Taking
the angle there, and not from a perspective pose of a small marker, avoids the ambiguity of a marker that
faces the camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from tubefoot.errors import ConfigError
from tubefoot.vision.lens import FloatArray, Lens

MAP_NODES = 24
"""Chebyshev nodes a side of the map from pixels to the plane."""


@dataclass(frozen=True)
class PlanarPose:
    """A place and a direction in a plane: x to the right, z up [mm], angle counter-clockwise [rad]."""

    x: float = 0.0
    z: float = 0.0
    angle: float = 0.0

    def to_outer(self, points: ArrayLike) -> FloatArray:
        """Points (n, 2) [mm] of this pose's own frame, in the frame that the pose is given in.

        points : (n, 2) own coordinates (x, z) [mm]
        """
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        return np.asarray(points, dtype=float) @ np.array([[cos, sin], [-sin, cos]]) + (self.x, self.z)

    def to_inner(self, points: ArrayLike) -> FloatArray:
        """Points (n, 2) [mm] of the outer frame, in this pose's own frame.

        points : (n, 2) outer coordinates (x, z) [mm]
        """
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        return (np.asarray(points, dtype=float) - (self.x, self.z)) @ np.array([[cos, -sin], [sin, cos]])

    def then(self, inner: PlanarPose) -> PlanarPose:
        """The pose, in this pose's outer frame, of something given in its own frame.

        inner : a pose in this pose's own frame
        """
        x, z = self.to_outer([[inner.x, inner.z]])[0]
        return PlanarPose(float(x), float(z), self.angle + inner.angle)

    def seen_from(self, origin: PlanarPose) -> PlanarPose:
        """This pose in the frame of another one.

        origin : the pose whose own frame is asked for
        """
        x, z = origin.to_inner([[self.x, self.z]])[0]
        return PlanarPose(float(x), float(z), wrap_angle(self.angle - origin.angle))


def wrap_angle(angle: float) -> float:
    """The same angle between -pi and pi [rad].

    angle : any angle [rad]
    """
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


@dataclass(frozen=True)
class PlanePose:
    """A plane in the camera frame.

    rotation : (3, 3), columns: the plane's x axis, its normal pointing away from the camera, its z axis
    origin : (3,) the plane's origin [mm]
    """

    rotation: FloatArray
    origin: FloatArray

    @classmethod
    def facing(
        cls, distance: float, tilt: float = 0.0, turn: float = 0.0, offset: tuple[float, float] = (0, 0)
    ) -> PlanePose:
        """A plane before the camera, its z axis up in the picture.

        distance : depth of the plane's origin [mm]
        tilt : turn about the plane's x axis [rad]
        turn : turn about the plane's z axis [rad]
        offset : place of the origin, right and up from the optical axis [mm]
        """
        upright = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
        about_x, _ = cv2.Rodrigues(np.array([tilt, 0, 0], dtype=float))
        about_z, _ = cv2.Rodrigues(np.array([0, 0, turn], dtype=float))
        origin = np.array([offset[0], -offset[1], distance], dtype=float)
        return cls(upright @ about_x @ about_z, origin)

    @property
    def normal(self) -> FloatArray:
        """Unit normal (3,), away from the camera."""
        return self.rotation[:, 1]

    def in_space(self, points: ArrayLike) -> FloatArray:
        """Points (n, 3) [mm] in the camera frame.

        points : (n, 2) plane coordinates (x, z) [mm]
        """
        flat = np.asarray(points, dtype=float).reshape(-1, 2)
        return flat @ self.rotation[:, [0, 2]].T + self.origin

    def to_pixels(self, points: ArrayLike, lens: Lens) -> FloatArray:
        """Pixels (n, 2) at which points of the plane appear.

        points : (n, 2) plane coordinates (x, z) [mm]
        lens : the camera's lens
        """
        return lens.project(self.in_space(points))

    def from_pixels(self, pixels: ArrayLike, lens: Lens) -> FloatArray:
        """Points (n, 2) of the plane (x, z) [mm] that pixels show.

        pixels : (n, 2) [px]
        lens : the camera's lens
        """
        rays = lens.rays(pixels)
        depth = (self.normal @ self.origin) / (rays @ self.normal)
        return (rays * depth[:, None] - self.origin) @ self.rotation[:, [0, 2]]

    def moved(self, pose: PlanarPose) -> PlanePose:
        """The same plane with its origin and x axis moved within it.

        pose : the new frame, in this plane's coordinates
        """
        cos, sin = np.cos(pose.angle), np.sin(pose.angle)
        axis_x, normal, axis_z = self.rotation.T
        turned = np.column_stack([cos * axis_x + sin * axis_z, normal, cos * axis_z - sin * axis_x])
        return PlanePose(turned, self.in_space([[pose.x, pose.z]])[0])


class PlaneMap:
    """Plane coordinates of all pixels of a picture, ready for look-up.

    The map is smooth, so it is interpolated through Chebyshev nodes; the constructor measures the error
    and raises ConfigError if the plane is so tilted that part of the picture misses it.
    """

    def __init__(self, lens: Lens, plane: PlanePose):
        """Compute the map.

        lens : the camera's lens
        plane : the bending plane
        """
        self.lens = lens
        self.plane = plane
        corners = [[0, 0], [lens.width - 1, 0], [0, lens.height - 1], [lens.width - 1, lens.height - 1]]
        slant = lens.rays(corners) @ plane.normal
        if np.min(slant) <= 0.05 or plane.origin @ plane.normal <= 0:
            raise ConfigError(
                "the bending plane is seen edge-on: part of the picture lies beyond its horizon; "
                "turn the camera to face the finger (at most 60 deg off) and calibrate again"
            )
        columns = sampled_plane(lens, plane, np.arange(float(lens.width)), np.arange(float(lens.height)))
        self.points = np.ascontiguousarray(columns, dtype=np.float32)
        """(height, width, 2) plane coordinates (x, z) of each pixel's centre [mm]"""

    def to_pixels(self, points: ArrayLike) -> FloatArray:
        """Pixels (n, 2) at which points of the plane appear.

        points : (n, 2) plane coordinates (x, z) [mm]
        """
        return self.plane.to_pixels(points, self.lens)

    def pixels_per_mm(self, point: tuple[float, float]) -> float:
        """Local scale of the picture [px/mm], the root of the area scale.

        point : plane coordinates (x, z) [mm]
        """
        around = np.array([[-0.5, 0], [0.5, 0], [0, -0.5], [0, 0.5]]) + point
        left, right, down, up = self.to_pixels(around)
        (ax, ay), (bx, by) = right - left, up - down
        return float(np.sqrt(abs(ax * by - ay * bx)))


def sampled_plane(lens: Lens, plane: PlanePose, columns: FloatArray, rows: FloatArray) -> FloatArray:
    """Plane coordinates (rows, columns, 2) [mm] on a rectangular grid of picture positions.

    Interpolated by Chebyshev polynomials through exact values, which for a lens is exact to far below
    a thousandth of a pixel and costs two matrix products.

    lens : the camera's lens
    plane : the plane that the pixels show
    columns : (n,) picture x of the grid [px], at least two, ascending
    rows : (m,) picture y of the grid [px], at least two, ascending
    """
    spread = max(columns[-1] - columns[0], rows[-1] - rows[0])
    nodes = int(min(MAP_NODES, 6 + spread // 20))
    at = chebyshev.chebpts1(nodes)

    def scaled(values: FloatArray) -> FloatArray:
        return 2.0 * (values - values[0]) / (values[-1] - values[0]) - 1.0

    def unscaled(values: FloatArray) -> FloatArray:
        return values[0] + (at + 1) / 2 * (values[-1] - values[0])

    grid_x, grid_y = np.meshgrid(unscaled(columns), unscaled(rows))
    exact = plane.from_pixels(np.column_stack([grid_x.ravel(), grid_y.ravel()]), lens)
    to_coefficients = np.linalg.inv(chebyshev.chebvander(at, nodes - 1))
    across = chebyshev.chebvander(scaled(columns), nodes - 1) @ to_coefficients
    down = chebyshev.chebvander(scaled(rows), nodes - 1) @ to_coefficients
    return np.stack([down @ part.reshape(nodes, nodes) @ across.T for part in exact.T], axis=-1)
