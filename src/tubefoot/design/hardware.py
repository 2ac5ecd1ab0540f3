"""What a finger is printed and mounted with: tubes, base, registration, marker seats, printing process.

Every section has defaults, so that a design file needs none of them.
"""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from tubefoot.config import Settings


class Ports(Settings):
    """Rigid tubes at both ends of each chamber and what is slid over them [mm]; the bore leads along z."""

    bore_mm: Annotated[float, Field(ge=0.4, le=20.0)] = 2.0
    """Bore of the tubes, open into the chamber."""
    outer_diameter_mm: Annotated[float, Field(ge=1.0, le=30.0)] = 3.4
    """Outside of the tubes; 3.4 fits a hose of 3 mm bore with 0.4 mm interference."""
    length_mm: Annotated[float, Field(ge=1.0, le=60.0)] = 8.0
    """How far a tube stands out of its cap."""
    axis_mm: Annotated[float, Field(ge=0.5, le=60.0)] | None = None
    """Centre line of the finger to a tube's axis; left out: the bore is flush with the inside of the valley,
    which keeps the two hoses as far apart as the chamber allows."""
    lead_in_mm: Annotated[float, Field(ge=0.0, le=3.0)] = 0.3
    """Chamfer at a tube's free end."""
    hose_bore_mm: Annotated[float, Field(ge=0.4, le=20.0)] = 3.0
    """Bore of the hose of the hydraulic loop and of the short connectors."""
    hose_outer_mm: Annotated[float, Field(ge=1.0, le=40.0)] = 5.0
    """Outside of hose and connectors, before they are stretched over the tube."""
    connector_length_mm: Annotated[float, Field(ge=2.0, le=60.0)] = 12.0
    """Short connector that joins a top tube and its plug after filling."""
    plug_length_mm: Annotated[float, Field(ge=1.0, le=40.0)] = 5.0
    """Shank of a plug; its diameter is that of the tubes."""
    plug_head_mm: Annotated[float, Field(ge=0.5, le=20.0)] = 2.0
    """Height of a plug's head."""

    @model_validator(mode="after")
    def _hose_has_a_wall(self) -> Self:
        if self.hose_outer_mm <= self.hose_bore_mm:
            raise ValueError(
                f"hose_outer_mm = {self.hose_outer_mm:g} leaves no wall around hose_bore_mm = "
                f"{self.hose_bore_mm:g}; raise hose_outer_mm"
            )
        return self


class Base(Settings):
    """Rigid base: a socket for the bottom cap on a plate with two screw holes [mm]."""

    plate_mm: Annotated[float, Field(ge=1.0, le=30.0)] = 3.0
    """Thickness of the plate; the bottom tubes pass through it."""
    socket_depth_mm: Annotated[float, Field(ge=0.5, le=30.0)] = 3.0
    """How deep the bottom cap sits in the socket."""
    socket_wall_mm: Annotated[float, Field(ge=0.5, le=20.0)] = 2.0
    """Wall around the cap."""
    clearance_mm: Annotated[float, Field(ge=0.0, le=2.0)] = 0.1
    """Between cap and socket on each side, filled with resin."""
    tube_clearance_mm: Annotated[float, Field(ge=0.0, le=2.0)] = 0.2
    """Between a tube and its hole in the plate, on the radius."""
    screw_hole_mm: Annotated[float, Field(ge=1.0, le=12.0)] = 3.4
    """Screw holes; 3.4 passes an M3 screw."""
    screw_head_mm: Annotated[float, Field(ge=1.5, le=25.0)] = 6.0
    """Diameter that a screw head and its driver need."""


class Gripper(Settings):
    """Base for two identical fingers that face each other along x [mm]; sockets and screws as in `base`."""

    finger_gap_mm: Annotated[float, Field(ge=0.0, le=200.0)] = 8.0
    """Between the facing crests of the two fingers at rest."""


class Registration(Settings):
    """Pins and a lip that align the two modules on the bonding face [mm]."""

    pin_diameter_mm: Annotated[float, Field(ge=0.0, le=10.0)] = 1.2
    """Rigid pins in both caps, half in either module; 0 leaves them out."""
    pin_height_mm: Annotated[float, Field(ge=0.2, le=10.0)] = 1.5
    """How far a pin stands out of the back module, and how deep it is rooted in it."""
    lip_width_mm: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    """Lip along the partition of the back module, with a groove in the front module; left out: 0.4 times the
    partition where that is 0.6 mm or more, else none; 0 leaves it out."""
    lip_height_mm: Annotated[float, Field(ge=0.1, le=5.0)] = 0.5
    """How far the lip stands out of the bonding face."""
    clearance_mm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1
    """Between pin and hole, lip and groove, on each side."""


class MarkerSeats(Settings):
    """Pads on the front side wall and the plates on them that carry ArUco tags [mm]."""

    units: tuple[Annotated[int, Field(ge=1, le=48)], ...] | None = None
    """Units that carry a tag, counted from the base; left out: spread evenly, bent plates clear of each
    other and of the base (2, 5, 8, 11 of 12); an empty list leaves the seats out."""
    marker_mm: Annotated[float, Field(ge=2.0, le=60.0)] = 10.0
    """Side of the tag's black square."""
    quiet_zone_mm: Annotated[float, Field(ge=0.2, le=20.0)] = 1.67
    """White border around it: the rim of the plate."""
    plate_mm: Annotated[float, Field(ge=0.8, le=10.0)] = 1.5
    """Thickness of the plate."""
    tag_recess_mm: Annotated[float, Field(ge=0.0, le=2.0)] = 0.2
    """Recess in the plate's front for the tag, as large as its black square."""
    pad_width_mm: Annotated[float, Field(ge=0.5, le=40.0)] = 4.0
    """Pad's size along x, on the partition, where bending strains the wall least."""
    pad_length_mm: Annotated[float, Field(ge=0.5, le=40.0)] = 2.5
    """Pad's size along z."""
    pad_height_mm: Annotated[float, Field(ge=0.3, le=10.0)] = 1.2
    """How far the pad stands out of the side wall."""
    pocket_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.5
    """Depth of the pocket in the plate's back that sits on the pad."""
    clearance_mm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1
    """Between pad and pocket on each side."""


class Printing(Settings):
    """What the printer can do and what the bonded finger needs: limits that `tubefoot check` applies [mm]."""

    growth_mm: Annotated[float, Field(ge=0.0, le=0.5)] = 0.15
    """How far a printed face grows outwards: 0.15 to 0.2 on an Objet260 (MacCurdy et al. 2016);
    `tubefoot export --compensate-growth` moves every free face back by as much."""
    min_feature_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.325
    """Smallest feature in plane that is printed at all (MacCurdy et al. 2016)."""
    min_gap_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.4
    """Smallest gap in plane that stays open (MacCurdy et al. 2016)."""
    min_detail_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.42
    """Holes and details below this are distorted (MacCurdy et al. 2016)."""
    min_wall_mm: Annotated[float, Field(ge=0.0, le=10.0)] = 0.6
    """Thinnest wall that survives support removal; our choice, about twice the smallest feature."""
    min_seal_mm: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    """Narrowest bonding face that is to hold pressure; our choice, to be checked by a burst test."""
    tool_mm: Annotated[float, Field(ge=0.0, le=10.0)] = 0.8
    """Narrowest opening that a jet or pick for support removal enters; our choice."""
    tray_mm: tuple[float, float, float] = (255.0, 252.0, 200.0)
    """Largest part, in x, y, z; an Objet260's tray by the maker's sheet, from memory."""
