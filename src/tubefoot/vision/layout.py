"""Marker layout: which markers sit where on a straight finger, and where the fluid columns are seen.

All places are in the finger's own frame: x to the right in the bending plane, z up along the finger, base
at z = 0.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings
from tubefoot.units import DEG
from tubefoot.vision.alignment import MarkerTarget
from tubefoot.vision.marker import find_dictionary, marker_cells, mirror_distance
from tubefoot.vision.plane import PlanarPose

LEAST_MIRROR_DISTANCE = 2


class MarkerPlace(Settings):
    """One marker on the finger."""

    id: int = Field(ge=0)
    """number in the dictionary"""
    z_mm: float = Field(ge=-50, le=1000)
    """height of its centre above the base"""
    x_mm: float = Field(default=0.0, ge=-200, le=200)
    """place across the finger"""
    angle_deg: float = Field(default=0.0, ge=-180, le=180)
    """how it is stuck on, counter-clockwise from upright"""

    @property
    def pose(self) -> PlanarPose:
        """Pose on the straight finger."""
        return PlanarPose(self.x_mm, self.z_mm, self.angle_deg * DEG)


class ColumnPlace(Settings):
    """One coloured fluid column, as a line in the bending plane."""

    name: str = Field(min_length=1, pattern=r"^[a-z][a-z0-9_]*$")
    """becomes the table column level_NAME_mm"""
    start_mm: tuple[float, float]
    """x, z of the end that is filled first"""
    end_mm: tuple[float, float]
    """x, z of the other end"""
    hue_deg: float = Field(default=0.0, ge=0, lt=360)
    """colour of the fluid: 0 red, 120 green, 240 blue"""
    width_mm: float = Field(default=2.0, gt=0, le=50)
    """width that is averaged across the line"""

    @model_validator(mode="after")
    def _has_length(self) -> ColumnPlace:
        if self.start_mm == self.end_mm:
            raise ValueError(
                f"fluid column {self.name!r}: start_mm and end_mm are the same point; give its two ends"
            )
        return self


class MarkerLayout(Settings):
    """Markers on one finger, from the base to the tip; the last one gives the bending angle."""

    length_mm: float = Field(gt=1, le=1000)
    """finger from base to tip"""
    rigid_base_mm: float = Field(default=4.0, ge=0, le=500)
    """length at the base that does not bend"""
    rigid_tip_mm: float = Field(default=4.0, ge=0, le=500)
    """length at the tip that does not bend"""
    dictionary: str = "4x4_50"
    """marker dictionary"""
    marker_side_mm: float = Field(default=10.0, ge=2, le=200)
    """side of a marker's black square"""
    quiet_zone_mm: float = Field(default=1.67, gt=0, le=50)
    """white margin around it"""
    markers: tuple[MarkerPlace, ...] = Field(min_length=1, max_length=30)
    """from the base to the tip"""
    columns: tuple[ColumnPlace, ...] = ()
    """fluid columns, if they are in the picture"""

    @model_validator(mode="after")
    def _is_readable(self) -> MarkerLayout:
        find_dictionary(self.dictionary)
        ids = tuple(marker.id for marker in self.markers)
        if len(set(ids)) < len(ids):
            raise ValueError(f"marker ids {list(ids)} repeat; each marker of a finger needs its own")
        if self.rigid_base_mm + self.rigid_tip_mm >= self.length_mm:
            raise ValueError(
                f"rigid_base_mm + rigid_tip_mm = {self.rigid_base_mm + self.rigid_tip_mm:g} mm leave "
                f"nothing of length_mm = {self.length_mm:g} mm to bend"
            )
        cells = marker_cells(self.dictionary, ids[0]).shape[0]
        if self.quiet_zone_mm < 0.7 * self.marker_side_mm / cells:
            raise ValueError(
                f"quiet_zone_mm = {self.quiet_zone_mm:g} mm is too narrow to find the marker; "
                f"give at least one cell, {self.marker_side_mm / cells:.2f} mm"
            )
        self._check_order(ids)
        self._check_mirrors(ids)
        return self

    def _check_order(self, ids: tuple[int, ...]) -> None:
        needed = self.marker_side_mm + self.quiet_zone_mm
        for lower, upper in zip(self.markers, self.markers[1:], strict=False):
            gap = upper.z_mm - lower.z_mm
            if gap < needed:
                raise ValueError(
                    f"markers {lower.id} and {upper.id} are {gap:g} mm apart along z; "
                    f"list them from the base to the tip, at least {needed:g} mm apart, "
                    "so that they do not cover each other when bent"
                )
        for marker in self.markers:
            marker_cells(self.dictionary, marker.id)
            if marker.z_mm > self.length_mm + self.marker_side_mm:
                raise ValueError(
                    f"marker {marker.id}: z_mm = {marker.z_mm:g} lies beyond the tip, "
                    f"length_mm = {self.length_mm:g}"
                )

    def _check_mirrors(self, ids: tuple[int, ...]) -> None:
        for marker_id in ids:
            distance = mirror_distance(self.dictionary, marker_id, ids)
            if distance < LEAST_MIRROR_DISTANCE:
                raise ValueError(
                    f"marker {marker_id} looks like a marker of this layout in a mirror ({distance} "
                    f"cells differ, at least {LEAST_MIRROR_DISTANCE} are needed); choose another id"
                )

    def target(self, marker_id: int) -> MarkerTarget:
        """What to look for in a picture to find one marker.

        marker_id : a marker of this layout
        """
        return MarkerTarget(self.dictionary, marker_id, self.marker_side_mm, self.quiet_zone_mm)


def reference_layout() -> MarkerLayout:
    """The layout of the 12-unit reference finger: markers on units 2, 5, 8 and 11."""
    places = tuple(
        MarkerPlace(id=marker_id, z_mm=height)
        for marker_id, height in ((1, 14.5), (2, 35.5), (4, 56.5), (7, 77.5))
    )
    return MarkerLayout(length_mm=92.0, markers=places)


def chosen_layout(path: Path | None) -> MarkerLayout:
    """The layout in a file, that of the 12-unit reference finger where none is named.

    path : TOML file or None

    Raises ConfigError for a file that cannot be used.
    """
    return reference_layout() if path is None else load_settings(path, MarkerLayout)
