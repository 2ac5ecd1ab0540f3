"""The parts of a finger: solid, material, colour, how many, where they sit, and how they lie on the tray."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from tubefoot.design import cad, hardware_solids, solids
from tubefoot.design.cad import Solid
from tubefoot.design.layout import base_of, gripper_base_of, marker_plate_of, tube_axis
from tubefoot.design.surface import FloatArray, TriangleMesh
from tubefoot.units import GRAM_PER_CM3

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

Colour = tuple[float, float, float]
Kind = Literal["soft", "rigid"]
Recipe = tuple[Kind, str, float]
"""Kind, name and density [g/cm3] of a material."""
SOFT_COLOUR: Colour = (0.16, 0.17, 0.19)
RIGID_COLOUR: Colour = (0.93, 0.93, 0.90)
GRAM = 1e-6
"""In tonnes, the mass unit that goes with N, mm and s."""

BOND_FACE_UP = {
    "front": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "back": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
"""Rotations that turn a module's bonding face upwards, so that its chambers print without support inside."""
TOP_DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Part:
    """One part; parts of the same `module` are printed together, in two materials."""

    name: str
    kind: Kind
    material: str
    density_g_per_cm3: float
    solid: Solid
    purpose: str
    shifts: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """Where its copies sit in the assembled finger [mm]; none for a part of the gripper only."""
    module: str = ""
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """From assembled to lying on the tray, (3, 3)."""
    copies: int = 1

    @cached_property
    def mesh(self) -> TriangleMesh:
        """The part as assembled, as triangles."""
        return cad.triangulated(self.solid)

    @cached_property
    def volume(self) -> float:
        """Volume of one copy [mm^3]."""
        return cad.volume(self.solid)

    @property
    def mass_g(self) -> float:
        """Mass of one copy [g]."""
        return self.volume * self.density_g_per_cm3 * GRAM_PER_CM3 / GRAM

    @property
    def colour(self) -> Colour:
        """Red, green, blue from 0 to 1."""
        return SOFT_COLOUR if self.kind == "soft" else RIGID_COLOUR

    @property
    def file_stem(self) -> str:
        """What its mesh file is called: part and material."""
        return re.sub(r"[^a-z0-9]+", "-", f"{self.name} {self.material}".lower()).strip("-")


def finger_parts(
    design: FingerDesign, growth: float = 0.0, started: Callable[[str], None] = lambda name: None
) -> list[Part]:
    """All parts of one finger, and the gripper's base.

    design : the finger
    growth : how far every free face is moved inwards, to make up for the printer's growth [mm]
    started : called with a part's name before it is made
    """
    return list(_parts(design, growth, started))


def _parts(design: FingerDesign, growth: float, started: Callable[[str], None]) -> Iterator[Part]:
    soft: Recipe = ("soft", design.body.name, design.body.density_g_per_cm3)
    rigid: Recipe = ("rigid", design.rigid.name, design.rigid.density_g_per_cm3)
    sides: tuple[solids.Side, ...] = ("front", "back")
    for side in sides:
        started(f"{side} module")
        turn = BOND_FACE_UP[side]
        body, tubes = solids.module_body(design, side, growth), solids.module_rigid(design, side, growth)
        pins = " and registration pins" if side == "back" and design.registration.pin_diameter_mm else ""
        yield Part(
            f"{side} body", *soft, body, "half of the bellows body", module=f"{side} module", rotation=turn
        )
        yield Part(
            f"{side} tubes", *rigid, tubes, f"four half tubes{pins}", module=f"{side} module", rotation=turn
        )
    started("base and gripper base")
    base = hardware_solids.mount_solid(design, base_of(design), growth)
    yield Part("base", *rigid, base, "holds one finger, two screws")
    gripper = hardware_solids.mount_solid(design, gripper_base_of(design), growth)
    purpose = "holds two fingers face to face, four screws; instead of two bases"
    yield Part("gripper base", *rigid, gripper, purpose, shifts=())
    started("connectors, plugs and marker plates")
    across = (-2 * tube_axis(design.profile, design.ports), 0.0, 0.0)
    both = ((0.0, 0.0, 0.0), across)
    connector = hardware_solids.connector_solid(design, growth)
    yield Part(
        "connector",
        *soft,
        connector,
        "joins a top tube and its plug; or cut it from the hose",
        shifts=both,
        copies=2,
    )
    plug = hardware_solids.plug_solid(design, growth)
    yield Part(
        "plug", *rigid, plug, "closes a top tube after filling", shifts=both, rotation=TOP_DOWN, copies=2
    )
    heights = marker_plate_of(design).heights
    if heights:
        plate = hardware_solids.marker_plate_solid(design, growth)
        above = tuple((0.0, 0.0, z - heights[0]) for z in heights)
        turn = BOND_FACE_UP["front"]
        yield Part(
            "marker plate",
            *rigid,
            plate,
            "carries one ArUco tag on the front",
            shifts=above,
            rotation=turn,
            copies=len(heights),
        )


def laid_meshes(parts: list[Part]) -> dict[str, TriangleMesh]:
    """Each part's mesh as it lies on the tray, lowest point at z = 0, centred in x and y.

    Parts of one module share one frame, so that their files load in register.

    parts : parts of one finger
    """
    turned = {part.name: part.mesh.moved(part.rotation, np.zeros(3)) for part in parts}
    laid = {}
    for part in parts:
        together = [
            turned[other.name]
            for other in parts
            if other is part or (part.module and other.module == part.module)
        ]
        low = np.min([mesh.bounds[0] for mesh in together], axis=0)
        high = np.max([mesh.bounds[1] for mesh in together], axis=0)
        shift = -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
        laid[part.name] = turned[part.name].moved(np.eye(3), shift)
    return laid
