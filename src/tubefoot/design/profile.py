"""The x-z profile of the right half of a finger: derived lengths, corner points and fillets, all in mm.

One unit, from z = 0: half a valley, flank rising out, crest, flank back, half a valley. The chamber reaches
into each fold as a slot whose flanks run parallel to the outer ones and end at the inner face of the valley.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, pi, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tubefoot.design.finger import Bellows

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """Derived lengths of the profile [mm]; x is measured from the centre line, z from the first unit."""

    units: int
    pitch: float
    """Axial length of one unit."""
    slope: float
    """tan(alpha) = rise / run."""
    partition_face: float
    valley_inside: float
    valley_outside: float
    slot_end: float
    """Inner face of the crest."""
    crest_outside: float
    rise: float
    crest_flat: float
    valley_flat: float
    flank_axial: float
    """Thickness of a flank along z."""
    fold_wall: float
    valley_wall: float
    partition: float
    height: float
    side_wall: float
    cap: float
    fillet_outside: float
    fillet_chamber: float

    @classmethod
    def of(cls, bellows: Bellows) -> Profile:
        """The profile that a bellows body has.

        bellows : its dimensions
        """
        face = bellows.partition_mm / 2
        if bellows.valley_outside_mm is not None:
            outside = bellows.valley_outside_mm
        else:
            outside = face + (bellows.chamber_gap_mm or 0.0) + bellows.valley_wall_mm
        slope = bellows.fold_rise_mm / bellows.fold_run_mm
        return cls(
            units=bellows.units,
            pitch=2 * bellows.fold_rise_mm + bellows.crest_flat_mm + bellows.valley_flat_mm,
            slope=slope,
            partition_face=face,
            valley_inside=outside - bellows.valley_wall_mm,
            valley_outside=outside,
            slot_end=outside + bellows.fold_run_mm - bellows.fold_wall_mm,
            crest_outside=outside + bellows.fold_run_mm,
            rise=bellows.fold_rise_mm,
            crest_flat=bellows.crest_flat_mm,
            valley_flat=bellows.valley_flat_mm,
            flank_axial=bellows.fold_wall_mm * hypot(1.0, slope),
            fold_wall=bellows.fold_wall_mm,
            valley_wall=bellows.valley_wall_mm,
            partition=bellows.partition_mm,
            height=bellows.height_mm,
            side_wall=bellows.side_wall_mm,
            cap=bellows.cap_mm,
            fillet_outside=bellows.fillet_outside_mm,
            fillet_chamber=bellows.fillet_chamber_mm,
        )

    @property
    def chamber_gap(self) -> float:
        """Partition face to inner face of the valley."""
        return self.valley_inside - self.partition_face

    @property
    def bellows_length(self) -> float:
        """Length of all units, without the caps."""
        return self.units * self.pitch

    @property
    def envelope(self) -> tuple[float, float, float]:
        """Outer size along x, y, z."""
        return 2 * self.crest_outside, self.height, self.bellows_length + 2 * self.cap

    @property
    def corner_turn(self) -> float:
        """Angle by which the wall turns at each corner of the profile [rad]."""
        return pi / 2 - atan2(self.slope, 1.0)

    def fillet_setback(self, radius: float) -> float:
        """Distance from a corner to where its fillet begins.

        radius : fillet radius
        """
        return radius * tan(self.corner_turn / 2)

    def slot_half_width(self, x: float) -> float:
        """Half the axial width of a fold's slot.

        x : distance from the centre line, between `valley_inside` and `slot_end`
        """
        return self.crest_flat / 2 + self.rise - (x - self.valley_outside) * self.slope - self.flank_axial

    @property
    def inner_valley_flat(self) -> float:
        """Axial length of the chamber-side face of a valley, between two slots."""
        return self.pitch - 2 * self.slot_half_width(self.valley_inside)

    def outer_corners(self) -> FloatArray:
        """Corners of the outside of one unit, (4, 2) as (x, z): valley, crest, crest, valley."""
        low, rise = self.valley_flat / 2, self.rise
        z = np.array([low, low + rise, self.pitch - low - rise, self.pitch - low])
        x = np.array([self.valley_outside, self.crest_outside, self.crest_outside, self.valley_outside])
        return np.column_stack([x, z])

    def chamber_corners(self) -> FloatArray:
        """Corners of the chamber side of one unit, (4, 2) as (x, z): valley, slot end, slot end, valley."""
        middle = self.pitch / 2
        root = self.slot_half_width(self.valley_inside)
        end = self.slot_half_width(self.slot_end)
        z = np.array([middle - root, middle - end, middle + end, middle + root])
        x = np.array([self.valley_inside, self.slot_end, self.slot_end, self.valley_inside])
        return np.column_stack([x, z])


def chamber_rest_volume(profile: Profile) -> float:
    """Volume of one chamber at rest, fillets included [mm^3], in closed form.

    profile : the finger's profile
    """
    root, end = profile.slot_half_width(profile.valley_inside), profile.slot_half_width(profile.slot_end)
    slot = (root + end) * (profile.slot_end - profile.valley_inside)
    core = profile.chamber_gap * profile.bellows_length
    # A fillet changes the section by r^2 (tan(t/2) - t/2) at each corner: it takes chamber
    # away at a slot's end and gives chamber at a valley's corner, two of each a unit: no net change.
    section = core + profile.units * slot
    return section * (profile.height - 2 * profile.side_wall)
