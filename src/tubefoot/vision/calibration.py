"""Calibration: lens, bending plane and neutral zero of a camera that looks at a finger.

The lens comes from many ChArUco views, the plane from one view of the board held against the finger's
bending plane, the zero from one view of the straight finger. What is stored is a TOML file that names every
number with its unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import tomli_w
from pydantic import Field

from tubefoot.config import Settings, load_settings
from tubefoot.errors import ConfigError
from tubefoot.records import write_whole
from tubefoot.units import DEG
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlanePose
from tubefoot.vision.tracker import MarkerReading

Row3 = tuple[float, float, float]


class LensTable(Settings):
    """Intrinsics at one resolution."""

    width_px: int = Field(ge=64, le=20000)
    """picture width"""
    height_px: int = Field(ge=64, le=20000)
    """picture height"""
    focal_x_px: float = Field(gt=0)
    """focal length along x"""
    focal_y_px: float = Field(gt=0)
    """focal length along y"""
    centre_x_px: float
    """principal point, x; the first pixel's centre is 0"""
    centre_y_px: float
    """principal point, y"""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """k1, k2, p1, p2, k3"""
    residual_px: float = Field(default=0.0, ge=0)
    """root mean square reprojection error of the views"""


class PlaneTable(Settings):
    """The bending plane in the camera frame (x right, y down, z forward)."""

    axis_x: Row3
    """unit vector to the right in the plane"""
    axis_z: Row3
    """unit vector up along the finger"""
    origin_mm: Row3
    """the board's middle, or the finger's base once the zero is set"""
    tilt_sigma_deg: float = Field(default=0.0, ge=0, le=45)
    """standard uncertainty of the plane's tilt"""


class CameraCalibration(Settings):
    """All that turns pixels into angles of one finger."""

    lens: LensTable
    """intrinsics"""
    plane: PlaneTable
    """the bending plane; its frame is the finger's once the zero is set"""
    zeroed: bool = False
    """whether the plane's frame was moved to the finger's base"""
    zero_angle_deg: dict[str, float] = Field(default_factory=dict)
    """how each marker, by id, is turned against the layout when the finger is straight"""
    line_time_us: float = Field(default=0.0, ge=0, le=1000)
    """delay from row to row of a rolling shutter; 0 is a global shutter"""

    @classmethod
    def of(
        cls, lens: Lens, plane: PlanePose, tilt_sigma: float = 0.0, residual_px: float = 0.0
    ) -> CameraCalibration:
        """The calibration of a lens and a plane, without a zero.

        lens : the lens
        plane : the bending plane
        tilt_sigma : standard uncertainty of the plane's tilt [rad]
        residual_px : reprojection error of the lens [px]
        """
        return cls(
            lens=LensTable(
                width_px=lens.width,
                height_px=lens.height,
                focal_x_px=lens.focal_x,
                focal_y_px=lens.focal_y,
                centre_x_px=lens.centre_x,
                centre_y_px=lens.centre_y,
                distortion=tuple(lens.distortion),  # type: ignore[arg-type]
                residual_px=residual_px,
            ),
            plane=_plane_table(plane, tilt_sigma),
        )

    def to_lens(self) -> Lens:
        """The lens."""
        table = self.lens
        return Lens(
            table.width_px,
            table.height_px,
            table.focal_x_px,
            table.focal_y_px,
            table.centre_x_px,
            table.centre_y_px,
            table.distortion,
        )

    def to_plane(self) -> PlanePose:
        """The bending plane; raises ConfigError when its axes are not square to each other."""
        axis_x, axis_z = np.array(self.plane.axis_x), np.array(self.plane.axis_z)
        lengths = np.linalg.norm(axis_x), np.linalg.norm(axis_z)
        if max(abs(lengths[0] - 1), abs(lengths[1] - 1), abs(axis_x @ axis_z)) > 1e-3:
            raise ConfigError(
                "plane.axis_x and plane.axis_z must be unit vectors at a right angle; "
                "write the file with `tubefoot calibrate-camera` instead of by hand"
            )
        axis_x = axis_x / lengths[0]
        axis_z = axis_z - (axis_z @ axis_x) * axis_x
        axis_z /= np.linalg.norm(axis_z)
        rotation = np.column_stack([axis_x, np.cross(axis_z, axis_x), axis_z])
        return PlanePose(rotation, np.array(self.plane.origin_mm))

    def zeroed_by(self, readings: Mapping[int, MarkerReading], layout: MarkerLayout) -> CameraCalibration:
        """This calibration with the finger's base as origin, its axis as z, and each marker's zero.

        The markers of the straight finger are laid over the layout by least squares; what angle is left for
        each of them is how it was stuck on.

        readings : of the straight finger, in this calibration's plane frame, by marker id
        layout : where the markers should be

        Raises ConfigError when a marker of the layout is lost, or lies far from where the layout has it.
        """
        lost = [str(place.id) for place in layout.markers if readings[place.id].lost]
        if lost:
            raise ConfigError(
                f"the neutral view does not show marker {', '.join(lost)}; "
                "take it again with the straight finger in full view"
            )
        measured = [readings[place.id].pose or PlanarPose() for place in layout.markers]
        base = _finger_frame([place.pose for place in layout.markers], measured)
        angles = {}
        for place, pose in zip(layout.markers, measured, strict=True):
            own = pose.seen_from(base)
            miss = np.hypot(own.x - place.x_mm, own.z - place.z_mm)
            if miss > 0.3 * layout.marker_side_mm:
                raise ConfigError(
                    f"marker {place.id} lies {miss:.1f} mm from its place in the layout "
                    f"(limit {0.3 * layout.marker_side_mm:.1f} mm); correct z_mm or x_mm in the layout, "
                    "or take the neutral view with a straight finger"
                )
            angles[str(place.id)] = own.seen_from(place.pose).angle / DEG
        plane = _plane_table(self.to_plane().moved(base), self.plane.tilt_sigma_deg * DEG)
        return self.model_copy(update={"plane": plane, "zeroed": True, "zero_angle_deg": angles})

    def save(self, path: Path) -> Path:
        """The path, after writing the calibration there as TOML.

        path : file to write
        """
        return write_whole(path, tomli_w.dumps(self.model_dump(mode="json")))


def load_calibration(path: Path | str) -> CameraCalibration:
    """The calibration in a TOML file.

    path : written by `tubefoot calibrate-camera`; a fault in it raises ConfigError
    """
    return load_settings(path, CameraCalibration)


def _plane_table(plane: PlanePose, tilt_sigma: float) -> PlaneTable:
    axis_x, _, axis_z = plane.rotation.T.tolist()
    return PlaneTable(
        axis_x=tuple(axis_x),
        axis_z=tuple(axis_z),
        origin_mm=tuple(plane.origin.tolist()),
        tilt_sigma_deg=tilt_sigma / DEG,
    )


def _finger_frame(nominal: list[PlanarPose], measured: list[PlanarPose]) -> PlanarPose:
    """Pose of the finger's frame that carries nominal places onto measured ones."""
    at = np.array([[pose.x, pose.z] for pose in nominal])
    to = np.array([[pose.x, pose.z] for pose in measured])
    arms, ends = at - at.mean(axis=0), to - to.mean(axis=0)
    if len(nominal) == 1:
        angle = measured[0].angle - nominal[0].angle
    else:
        turn = np.sum(arms[:, 0] * ends[:, 1] - arms[:, 1] * ends[:, 0])
        angle = float(np.arctan2(turn, np.sum(arms * ends)))
    middle = PlanarPose(0.0, 0.0, angle).to_outer([at.mean(axis=0)])[0]
    x, z = to.mean(axis=0) - middle
    return PlanarPose(float(x), float(z), angle)
