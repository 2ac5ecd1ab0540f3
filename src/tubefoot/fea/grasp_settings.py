"""What is grasped, where it is held, and how far the fingers are pumped: the file of `solve --grasp`."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from tubefoot.config import Settings

Length = Annotated[float, Field(gt=0.0, le=200.0)]
LEAST_SIZE_MM = 4.0
"""Smallest size of an object; a crest is as long."""


class GraspedObject(Settings):
    """The object, centred between the fingers; x lies across the gripper, z along the straight fingers."""

    name: Annotated[str, Field(min_length=1, max_length=80)] = "object"
    shape: Literal["box", "ellipsoid", "cylinder"] = "box"
    sizes_mm: tuple[Length, Length, Length] = (20.0, 15.0, 20.0)
    """Full sizes along x, y, z."""
    cylinder_axis: Literal["y", "z"] = "z"
    """Along which a cylinder extends."""
    rigid: bool = False
    """Whether it keeps its shape; boxes and spheres only."""
    rounding_mm: Annotated[float, Field(gt=0.0, le=20.0)] = 1.0
    """Radius of a box's edges along y; of all edges of a rigid one."""
    youngs_modulus_kpa: Annotated[float, Field(ge=0.5, le=1e5)] = 28.8
    poisson_ratio: Annotated[float, Field(ge=0.0, le=0.499)] = 0.49
    compression_bound_kpa: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    """Compressive stress that it is known to bear; with it a margin is reported."""
    tension_bound_kpa: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    """Tensile stress that it is known to bear."""
    pressure_bound_kpa: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    """Contact pressure that its skin is known to bear."""
    force_bound_n: Annotated[float, Field(gt=0.0, le=1e4)] | None = None
    """Force of one finger that it is known to bear."""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if min(self.sizes_mm) < LEAST_SIZE_MM:
            raise ValueError(
                f"sizes_mm = {list(self.sizes_mm)}: an object must be at least {LEAST_SIZE_MM:g} mm in size"
            )
        sphere = self.shape == "ellipsoid" and len(set(self.sizes_mm)) == 1
        if self.rigid and not sphere and self.shape != "box":
            raise ValueError(
                "a rigid object is a box or an ellipsoid of three equal sizes; "
                "for other shapes set rigid = false and a high youngs_modulus_kpa"
            )
        if self.shape == "box" and 2.5 * self.rounding_mm > min(self.sizes_mm):
            raise ValueError(
                f"rounding_mm = {self.rounding_mm:g} must be at most {min(self.sizes_mm) / 2.5:g} mm, "
                "0.4 of the shortest edge"
            )
        return self

    @property
    def round_axes(self) -> tuple[int, ...]:
        """Axes of the round section, as `object_mesh` takes them."""
        if self.shape == "box":
            return ()
        if self.shape == "ellipsoid":
            return (0, 1, 2)
        return (0, 1) if self.cylinder_axis == "z" else (0, 2)


class GraspSettings(Settings):
    """A symmetric grasp with two fingers: the object, its place, the pumped volumes."""

    object: GraspedObject = GraspedObject()
    finger_gap_mm: Annotated[float, Field(ge=0.0, le=200.0)] | None = None
    """Between the facing crests of the straight fingers; left out: the design's."""
    height_mm: Annotated[float, Field(ge=-50.0, le=500.0)] = 70.0
    """The object's centre above the outer face of the base caps."""
    open_ml: Annotated[float, Field(ge=-20.0, le=0.0)] = -0.8
    """Volume pumped per finger before the object is put in; negative opens."""
    states_ml: Annotated[tuple[float, ...], Field(min_length=1, max_length=200)] = (0.0, 0.25, 0.5)
    """Pumped volumes per finger at which the grasp is wanted, ascending; states between are reported too."""
    stride_ml: Annotated[float, Field(gt=0.0, le=2.0)] = 0.05
    """Largest step of the pumped volume."""
    object_element_mm: Annotated[float, Field(ge=0.2, le=10.0)] = 2.0
    """Longest edge of the object's cells, about."""
    reach_mm: Annotated[float, Field(ge=0.005, le=0.5)] = 0.1
    """Gap from which finger and object repel each other; the object stands back by it."""
    pressure_at_touch_kpa: Annotated[float, Field(ge=1.0, le=1e5)] | None = None
    """Pressure at which that gap has closed, well above what the contact bears; left out: twice the object's
    modulus, 1 MPa for a rigid one."""

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        wanted = (self.open_ml, *self.states_ml)
        if any(b <= a for a, b in pairwise(wanted)):
            raise ValueError(
                f"states_ml = {list(self.states_ml)} must ascend from above open_ml = {self.open_ml:g}"
            )
        return self

    @property
    def touch_pressure_kpa(self) -> float:
        """Pressure at which the gap between finger and object has closed [kPa]."""
        if self.pressure_at_touch_kpa is not None:
            return self.pressure_at_touch_kpa
        return 1000.0 if self.object.rigid else 2.0 * self.object.youngs_modulus_kpa
