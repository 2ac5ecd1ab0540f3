"""The finger as a record: every dimension of the dual-chamber bellows finger, read from a design file.

Axes: x bending direction (right chamber at x > 0), z along the finger with z = 0 at the start of the first
unit, y across; the mid-plane y = 0 is the split and bond plane.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from tubefoot.config import Settings, parse_settings, read_toml
from tubefoot.design.hardware import Base, Gripper, MarkerSeats, Ports, Printing, Registration
from tubefoot.design.material import ElasticMaterial, OgdenMaterial, Seam
from tubefoot.design.profile import Profile
from tubefoot.design.rules import broken, geometry_rules
from tubefoot.errors import ConfigError, GeometryError


class Bellows(Settings):
    """Dimensions of the bellows body [mm]."""

    units: Annotated[int, Field(ge=1, le=48)] = 6
    """Number of convolutions."""
    fold_run_mm: Annotated[float, Field(ge=1.0, le=40.0)] = 5.0
    """Radial depth of a fold, valley to crest."""
    fold_rise_mm: Annotated[float, Field(ge=0.0, le=20.0)] = 1.0
    """Axial offset of a flank over the run; tan(alpha) = rise / run."""
    crest_flat_mm: Annotated[float, Field(ge=0.5, le=40.0)] = 4.0
    """Axial length of a crest, outside."""
    valley_flat_mm: Annotated[float, Field(ge=0.4, le=40.0)] = 1.0
    """Axial length of a valley, outside."""
    fold_wall_mm: Annotated[float, Field(ge=0.4, le=10.0)] = 1.5
    """T1: flanks and crest, measured normal to the wall."""
    valley_wall_mm: Annotated[float, Field(ge=0.4, le=10.0)] = 2.0
    """T2: wall at the valley, measured along x."""
    partition_mm: Annotated[float, Field(ge=0.4, le=10.0)] = 2.0
    """T3: central partition between the chambers."""
    chamber_gap_mm: Annotated[float, Field(ge=0.3, le=30.0)] | None = None
    """Partition face to inner face of the valley; give this or `valley_outside_mm`."""
    valley_outside_mm: Annotated[float, Field(ge=1.0, le=60.0)] | None = None
    """Centre line to the outside of the valley: held fixed, the chamber gap gives way."""
    height_mm: Annotated[float, Field(ge=2.0, le=60.0)] = 9.0
    """Finger height along y."""
    side_wall_mm: Annotated[float, Field(ge=0.4, le=10.0)] = 1.5
    """Walls that close the chambers at both ends of y."""
    cap_mm: Annotated[float, Field(ge=1.0, le=30.0)] = 4.0
    """End caps at base and tip."""
    fillet_outside_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
    """Radius of the profile's edges on the outside (crests and valleys)."""
    fillet_chamber_mm: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
    """Radius of the profile's edges on the chamber side."""

    @model_validator(mode="after")
    def _one_width(self) -> Self:
        if self.chamber_gap_mm is None and self.valley_outside_mm is None:
            object.__setattr__(self, "chamber_gap_mm", 3.0)
        elif self.chamber_gap_mm is not None and self.valley_outside_mm is not None:
            raise ValueError(
                f"chamber_gap_mm = {self.chamber_gap_mm:g} and valley_outside_mm = "
                f"{self.valley_outside_mm:g} both set the chamber's width; give one of them"
            )
        return self


class FingerDesign(Settings):
    """A dual-chamber bellows finger: dimensions, what it is printed and mounted with, materials, seam."""

    name: Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]*$")] = (
        "finger"
    )
    """What files, parts and pictures are called."""
    bellows: Bellows = Bellows()
    ports: Ports = Ports()
    base: Base = Base()
    gripper: Gripper = Gripper()
    registration: Registration = Registration()
    marker_seats: MarkerSeats = MarkerSeats()
    printing: Printing = Printing()
    body: OgdenMaterial = OgdenMaterial()
    rigid: ElasticMaterial = ElasticMaterial()
    seam: Seam = Seam()

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if faults := broken(geometry_rules(self.profile, self.ports)):
            raise GeometryError(f"design `{self.name}`: " + "\n".join(rule.sentence for rule in faults))
        return self

    @cached_property
    def profile(self) -> Profile:
        """The derived lengths of the x-z profile [mm]."""
        return Profile.of(self.bellows)

    def with_bellows(self, **dimensions: float | None) -> FingerDesign:
        """A copy with other dimensions, checked like any design.

        dimensions : keys of `Bellows` and their values [mm]; setting `chamber_gap_mm` or
            `valley_outside_mm` unsets the other
        """
        table = self.bellows.model_dump()
        if dimensions.get("valley_outside_mm") is not None:
            table["chamber_gap_mm"] = None
        elif dimensions.get("chamber_gap_mm") is not None:
            table["valley_outside_mm"] = None
        bellows = Bellows.model_validate({**table, **dimensions})
        return FingerDesign.model_validate({**_tables(self), "bellows": bellows})


def load_design(path: Path | str) -> FingerDesign:
    """The design in a TOML file.

    path : design file, as written by `tubefoot new`; `material_file` in its `[body]` names a file written by
        `tubefoot fit material`, beside the design, whose keys it takes where it has none of its own

    Raises ConfigError for a file or key that cannot be used, GeometryError for impossible dimensions.
    """
    path = Path(path)
    try:
        return parse_settings(_with_material(read_toml(path), path), FingerDesign, source=str(path))
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None


def _with_material(table: dict[str, Any], path: Path) -> dict[str, Any]:
    """The tables of a design, those of its material's file filled in."""
    body = table.get("body")
    if not isinstance(body, dict) or "material_file" not in body:
        return table
    source = path.parent / str(body["material_file"])
    fitted = read_toml(source).get("body")
    if not isinstance(fitted, dict):
        raise ConfigError(f"{source}: no table `[body]`; `tubefoot fit material` writes such a file")
    own = {key: value for key, value in body.items() if key != "material_file"}
    return {**table, "body": {**fitted, **own}}


def _tables(design: FingerDesign) -> dict[str, object]:
    return {key: getattr(design, key) for key in type(design).model_fields}
