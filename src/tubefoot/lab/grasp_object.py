"""What is to be grasped: shape, weight, stiffness, friction, and what it bears, with the sources.

An object's file is what a person knows of it before the grasp; the bench weighs its grip by it, the virtual
bench builds it. Sizes are given as it stands in the front pose: x between the fingers, y into the picture,
z up. In the side pose it is turned by 90 deg about `side_axis`, so that another width lies between the
fingers.
"""

from __future__ import annotations

from importlib import resources
from math import inf, isinf, pi
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings, parse_settings, read_toml
from tubefoot.errors import ConfigError
from tubefoot.units import GRAM_PER_CM3, KPA, STANDARD_GRAVITY

Pose = Literal["front", "side"]
POSES: tuple[Pose, ...] = ("front", "side")
KNOWN = ("tofu", "blueberry")
"""Objects that ship with the package."""
GRAM = 1e-6
"""[t]"""
FILL_SHARES = {"box": 1.0, "cylinder": pi / 4, "sphere": pi / 6, "ellipsoid": pi / 6}
"""Volume over that of the enclosing block."""


class DamageBounds(Settings):
    """What the object bears without damage; a bound that is left out is not judged."""

    contact_force_n: float | None = Field(default=None, gt=0, le=1000)
    """normal force of one finger"""
    compression_share: float | None = Field(default=None, gt=0, le=1)
    """shortening between the fingers, share of the width"""
    compression_kpa: float | None = Field(default=None, gt=0, le=1e6)
    """compressive stress across the object, force over its face"""
    tension_kpa: float | None = Field(default=None, gt=0, le=1e6)
    """tensile stress beside the contact"""
    source: str = ""
    """where the bounds come from"""

    @model_validator(mode="after")
    def _one_at_least(self) -> DamageBounds:
        bounds = (self.contact_force_n, self.compression_share, self.compression_kpa, self.tension_kpa)
        if all(bound is None for bound in bounds):
            raise ValueError(
                "give at least one damage bound: contact_force_n, compression_share, compression_kpa, "
                "tension_kpa"
            )
        return self


class GraspObject(Settings):
    """One object."""

    name: str = Field(min_length=1, max_length=60)
    """what records call it"""
    shape: Literal["box", "cylinder", "sphere", "ellipsoid", "mesh"]
    """a cylinder stands, its axis along z; a mesh is scaled to `size_mm`"""
    size_mm: tuple[float, float, float]
    """outer sizes along x, y, z in the front pose"""
    mesh_file: str = ""
    """STL or OBJ of a mesh; its convex hull is what the fingers touch"""
    side_axis: Literal["y", "z"] = "z"
    """axis about which the side pose is turned"""
    density_g_per_cm3: float = Field(default=1.0, gt=0.01, le=25)
    """mean density"""
    mass_g: float | None = Field(default=None, gt=0, le=2000)
    """weighed mass, instead of density times volume; a mesh needs it"""
    modulus_kpa: float = Field(gt=0.5, le=1e9)
    """Young's modulus at small strain"""
    poisson: float = Field(default=0.45, ge=0, lt=0.5)
    """Poisson's ratio"""
    firmness_n_per_mm: float | None = Field(default=None, gt=0, le=1e6)
    """force over shortening between two plates; from modulus and shape if not given"""
    friction: float = Field(default=0.5, gt=0, le=3)
    """coefficient against the finger; unknown for food on elastomer, so assumed"""
    contact_radius_mm: float | None = Field(default=None, gt=0, le=1000)
    """radius of curvature where a finger touches; that of the shape if not given, flat for a box"""
    deformable: bool = True
    """whether the virtual bench lets a box deform as a body; other shapes yield where they are touched"""
    damage: DamageBounds
    source: str = ""
    """where the numbers come from"""

    @model_validator(mode="after")
    def _is_possible(self) -> GraspObject:
        for axis, size in zip("xyz", self.size_mm, strict=True):
            if not 1.0 <= size <= 200.0:
                raise ValueError(f"size_mm along {axis} is {size:g} mm; allowed are 1 to 200 mm")
        x, y, z = self.size_mm
        if self.shape == "sphere" and not x == y == z:
            raise ValueError(f"a sphere has three equal sizes, not {x:g}, {y:g}, {z:g} mm; or use ellipsoid")
        if self.shape == "cylinder" and x != y:
            raise ValueError(f"a cylinder has equal sizes along x and y, not {x:g} and {y:g} mm")
        if (self.shape == "mesh") != bool(self.mesh_file):
            raise ValueError("shape mesh needs mesh_file, and no other shape takes one")
        if self.shape == "mesh" and self.mass_g is None:
            raise ValueError("a mesh needs mass_g: weigh the object")
        return self

    @property
    def volume(self) -> float:
        """Volume [mm^3]; of a mesh, mass over density."""
        if self.shape == "mesh":
            return self.mass / (self.density_g_per_cm3 * GRAM_PER_CM3)
        x, y, z = self.size_mm
        return x * y * z * FILL_SHARES[self.shape]

    @property
    def mass(self) -> float:
        """Mass [t]."""
        if self.mass_g is not None:
            return self.mass_g * GRAM
        return self.volume * self.density_g_per_cm3 * GRAM_PER_CM3

    @property
    def weight(self) -> float:
        """Weight [N]."""
        return self.mass * STANDARD_GRAVITY

    @property
    def modulus(self) -> float:
        """Young's modulus [MPa]."""
        return self.modulus_kpa * KPA

    def sizes(self, pose: Pose) -> tuple[float, float, float]:
        """Outer sizes along x, y, z in a pose [mm].

        pose : front or side
        """
        x, y, z = self.size_mm
        if pose == "front":
            return x, y, z
        return (y, x, z) if self.side_axis == "z" else (z, y, x)

    def face_area(self, pose: Pose) -> float:
        """Area across which the fingers' force passes: a box's face, else the middle section [mm^2].

        pose : front or side
        """
        _, y, z = self.sizes(pose)
        if self.shape == "box":
            return y * z
        return y * z if self._stands(pose) else pi / 4 * y * z

    def firmness(self, pose: Pose) -> float:
        """Force over shortening between two plates [N/mm].

        pose : front or side

        Without a measured one: E A / L between flat faces; else that of Hertz's law at a shortening of a
        tenth.
        """
        if self.firmness_n_per_mm is not None:
            return self.firmness_n_per_mm
        width, radius = self.sizes(pose)[0], self.radius(pose)
        if self.shape == "box" or isinf(radius):
            return self.modulus * self.face_area(pose) / width
        plane = self.modulus / (1.0 - self.poisson**2)
        at_contact = 0.05 * width
        return 4.0 / 3.0 * plane * radius**0.5 * at_contact**1.5 / (2.0 * at_contact)

    def radius(self, pose: Pose) -> float:
        """Radius of curvature where a finger touches [mm]; infinite for a box and the ends of a cylinder.

        pose : front or side

        Of an ellipsoid the geometric mean of both; of a cylinder's side that across its axis.
        """
        if self.contact_radius_mm is not None:
            return self.contact_radius_mm
        x, y, z = self.sizes(pose)
        if self.shape == "cylinder":
            return 0.5 * y if self._stands(pose) else inf
        return inf if self.shape == "box" else (y * z) / (2.0 * x)

    def _stands(self, pose: Pose) -> bool:
        """Whether it is a cylinder whose side is touched, not its ends."""
        return self.shape == "cylinder" and (pose == "front" or self.side_axis == "z")


def known_object(name: str) -> GraspObject:
    """An object that ships with the package.

    name : `tofu` or `blueberry`
    """
    place = resources.files("tubefoot.lab") / "data" / f"{name}.toml"
    with resources.as_file(place) as path:
        return parse_settings(read_toml(path), GraspObject, source=name)


def load_object(name: str) -> GraspObject:
    """The object of a name or file.

    name : `tofu`, `blueberry`, or the path of a TOML file; a mesh file is looked for beside it

    Raises ConfigError when there is no such object.
    """
    if name in KNOWN:
        return known_object(name)
    path = Path(name)
    if path.suffix != ".toml":
        raise ConfigError(
            f"object {name!r}: give {', '.join(KNOWN)}, or the path of a .toml file that describes one"
        )
    found = load_settings(path, GraspObject)
    if found.mesh_file:
        mesh = (path.parent / found.mesh_file).resolve()
        if not mesh.is_file():
            raise ConfigError(f"{path}: mesh_file {mesh} does not exist")
        found = found.model_copy(update={"mesh_file": str(mesh)})
    return found
