"""The object between the fingers as MJCF: rigid, or a block in three parts that springs hold together.

A deformable box is a core with two plates, each free to move along x, y, z and to tilt about y. Their springs
are those of the half block beside them: E A / (L/2) along x, G A / (L/2) across, E I / (L/2) in tilt, so that
pressing both plates shortens it by F L / (E A). Other shapes yield where they are touched: half their
shortening between plates goes into the stiffness of each contact (`contact_stiffness`). SI units, as
`finger_body`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.twin.finger_body import METRE

PLATE_SHARE = 1.0 / 6.0
"""Share of the block's mass, and of its width, that each plate takes."""
CREEP_S = 0.01
"""Dashpot over spring inside the block [s]: a loss factor of 0.06 at 1 Hz (assumed)."""
SWING_S = 0.005
"""The springs of a block swing no faster than at 1 / SWING_S, 32 Hz: inertia is added to its deformation
alone, so that the contacts, which are solved before the dashpots, meet no part that weighs less than these do
in a step."""
HAND_SOLREF = "0.01 1"
"""How stiffly a hand holds the object before it lets go: time constant [s], damping ratio."""


@dataclass(frozen=True)
class HeldObject:
    """The object of one scene.

    what : its record; pose : front or side
    friction : coefficient against the fingers
    """

    what: GraspObject
    pose: Pose
    friction: float

    @property
    def in_parts(self) -> bool:
        """Whether it is a block in three parts."""
        return self.what.deformable and self.what.shape == "box"

    def contact_stiffness(self) -> float:
        """Stiffness of the object where one finger touches it [N/mm]; infinite where its parts deform."""
        return float("inf") if self.in_parts else 2.0 * self.what.firmness(self.pose)

    def geoms(self, side: str) -> str:
        """Name of the geom that a finger touches.

        side : of the finger, `right` or `left`
        """
        return f"object_{side}" if self.in_parts else "object"

    def assets(self) -> str:
        """MJCF of the mesh asset, empty for other shapes."""
        if self.what.shape != "mesh":
            return ""
        low, high = _outline(self.what.mesh_file)
        scale = np.array(self.what.size_mm) / METRE / (high - low)
        return (
            f'<mesh name="object" file="{self.what.mesh_file}" scale="{_numbers(scale)}" '
            f'refpos="{_numbers((low + high) / 2)}"/>'
        )

    def bodies(self) -> str:
        """MJCF of the object and the hand that holds it, out of reach."""
        hand = '<body name="hand" mocap="true" pos="0 0.5 0.07"/>'
        inner = self._block() if self.in_parts else self._solid()
        return f'{hand}<body name="object" pos="0 0.5 0.07"><freejoint name="object"/>{inner}</body>'

    def equality(self) -> str:
        """MJCF of the hand's hold."""
        return f'<weld name="hold" body1="hand" body2="object" solref="{HAND_SOLREF}"/>'

    def _solid(self) -> str:
        what = self.what
        halves = [size / 2 / METRE for size in what.size_mm]
        kind = {"cylinder": "cylinder", "mesh": "mesh"}.get(what.shape, what.shape)
        size = " ".join(f"{half:.6g}" for half in halves)
        if what.shape == "sphere":
            size = f"{halves[0]:.6g}"
        elif what.shape == "cylinder":
            size = f"{halves[0]:.6g} {halves[2]:.6g}"
        shape = 'mesh="object"' if what.shape == "mesh" else f'size="{size}"'
        turn = f' quat="{_turn(what, self.pose)}"'
        return (
            f'<geom name="object" type="{kind}" {shape}{turn} mass="{1e3 * what.mass:.6g}" '
            'contype="0" conaffinity="0"/>'
        )

    def _block(self) -> str:
        what = self.what
        x, y, z = (size / METRE for size in what.sizes(self.pose))
        mass = 1e3 * what.mass
        young = 1e6 * what.modulus
        shear = young / (2.0 * (1.0 + what.poisson))
        area, half = y * z, x / 2
        plate = PLATE_SHARE * x
        along, across = young * area / half, shear * area / half
        tilt = young * y * z**3 / 12.0 / half
        lines = [_box_geom("object_core", (x / 2 - plate, y / 2, z / 2), (1 - 2 * PLATE_SHARE) * mass)]
        for side, way in (("right", 1.0), ("left", -1.0)):
            lines.append(f'<body name="object_{side}" pos="{way * (x - plate) / 2:.6g} 0 0">')
            for axis, stiffness in (("1 0 0", along), ("0 1 0", across), ("0 0 1", across)):
                lines.append(
                    f'<joint type="slide" axis="{axis}" stiffness="{stiffness:.6g}" '
                    f'damping="{CREEP_S * stiffness:.6g}" armature="{SWING_S**2 * stiffness:.6g}"/>'
                )
            lines.append(
                f'<joint type="hinge" axis="0 1 0" stiffness="{tilt:.6g}" '
                f'damping="{CREEP_S * tilt:.6g}" armature="{SWING_S**2 * tilt:.6g}"/>'
            )
            lines.append(
                _box_geom(f"object_{side}", (plate / 2, y / 2, z / 2), PLATE_SHARE * mass) + "</body>"
            )
        return "".join(lines)


def _box_geom(name: str, halves: tuple[float, float, float], mass: float) -> str:
    size = " ".join(f"{half:.6g}" for half in halves)
    return f'<geom name="{name}" type="box" size="{size}" mass="{mass:.6g}" contype="0" conaffinity="0"/>'


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _outline(mesh_file: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and largest coordinates of a mesh file's points, in the file's unit.

    Raises ConfigError for a file that is no closed mesh.
    """
    scene = (
        f'<mujoco><asset><mesh name="m" file="{mesh_file}"/></asset>'
        '<worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>'
    )
    try:
        model = mujoco.MjModel.from_xml_string(scene)
    except ValueError as error:
        raise ConfigError(f"mesh_file {mesh_file}: {error}; give a closed mesh as STL or OBJ") from error
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    points = model.mesh_vert @ turn.reshape(3, 3).T + model.mesh_pos[0]
    return points.min(axis=0), points.max(axis=0)


def _turn(what: GraspObject, pose: Pose) -> str:
    """Quaternion of a pose."""
    if pose == "front":
        return "1 0 0 0"
    c = s = (0.5) ** 0.5
    return f"{c:.9g} 0 {s:.9g} 0" if what.side_axis == "y" else f"{c:.9g} 0 0 {s:.9g}"
