"""Two fingers on one base with an object between them, as MJCF and as a compiled scene.

Frame: x across the gripper, y into the picture, z up; the origin lies midway between the fingers on the outer
face of the base caps. The right finger stands at x > 0; the left one is the same finger turned by 180 deg
about z. A positive bend is inward for both.

A finger touches with the crests of its inner flank. A crest's flat is in two halves, each on the link it
belongs to, so that it turns by half of its unit's angle on average. What meets a block is the rounded end of
each half, a capsule across the finger; what meets any other shape is the half's plane, as a ball would sink
in between two capsules. Each half has half of the stiffness with which the wall of a crest gives way, in
series with the object's own (`held_object`). SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin

import mujoco
import numpy as np
from pydantic import Field

from tubefoot.config import Settings
from tubefoot.errors import ConfigError
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.twin.finger_body import METRE, finger_bodies
from tubefoot.twin.held_object import HeldObject
from tubefoot.units import DEG, STANDARD_GRAVITY

SIDES = ("right", "left")
TIME_STEP_S = 2e-3
"""Longest step of the links and the object [s]."""
EDGE_MM = 0.5
"""Radius of the rounded ends of a crest's flat [mm]."""
IMPEDANCE = 0.9
"""Of the contacts: how much of a violation the solver removes by force rather than by yielding inertia."""
CONTACT_DAMPING = 1.0
"""Of the contacts, over critical."""
SLIP_STIFFNESS, NOSLIP = 100.0, 1
"""Friction over normal stiffness of the contacts, and sweeps that take away what slip is left: with less the
object creeps."""
TORSION_MM = 1.5
"""Radius of the patch that resists twist, over friction [mm]."""


class GripperMake(Settings):
    """How two fingers make a gripper."""

    finger_gap_mm: float = Field(default=8.0, ge=0, le=200)
    """between the facing crests of the straight fingers, as in the design's `gripper` table"""
    crest_flat_mm: float = Field(default=4.0, ge=1.1, le=40)
    """length of a crest's flat along the finger"""
    wall_n_per_mm: float = Field(default=2.5, gt=0.01, le=1000)
    """force over indentation of one crest's wall by a flat, of a finger at its identified stiffness: finite
    elements of the reference finger give 2.6 to 2.9 at rest and 1.4 (0.04 N) to 2.5 (0.4 N) at +-20 kPa
    (benchmarks/wall_indentation.py)"""
    tilt_deg: float = Field(default=0.0, ge=-180, le=180)
    """of the gripper against the vertical, to the left: 0 stands upright, 180 hangs"""
    pumps: int = Field(default=2, ge=1, le=2)
    """one pump and board for each finger, or one for both through a splitter"""


@dataclass(frozen=True)
class SceneParts:
    """What makes a scene.

    fingers : right and left; make : of the gripper; held : the object, None for an empty gripper
    """

    fingers: tuple[ReducedFinger, ReducedFinger]
    make: GripperMake
    held: HeldObject | None


def compiled_scene(parts: SceneParts, gravity: bool = True) -> mujoco.MjModel:
    """The scene, ready to be stepped.

    parts : what makes it; gravity : whether weight acts
    """
    held = parts.held
    weight = STANDARD_GRAVITY / METRE if gravity else 0.0
    tilt = parts.make.tilt_deg * DEG
    pull = f"{-weight * sin(tilt):.9g} 0 {-weight * np.cos(tilt):.9g}"
    reach = (parts.fingers[0].half_width + parts.make.finger_gap_mm / 2) / METRE
    turns = ("1 0 0 0", "0 0 0 1")
    bases = "".join(
        f'<body name="base_{side}" pos="{way * reach:.9g} 0 0" quat="{turn}">'
        f"{_touching(finger, parts, side)}</body>"
        for side, way, turn, finger in zip(SIDES, (1.0, -1.0), turns, parts.fingers, strict=True)
    )
    text = (
        f'<mujoco><compiler angle="radian"/><option timestep="{TIME_STEP_S:.9g}" integrator="discrete" '
        f'jacobian="dense" cone="elliptic" impratio="{SLIP_STIFFNESS:g}" noslip_iterations="{NOSLIP}" '
        f'gravity="{pull}">'
        '<flag multiccd="disable"/></option>'
        f"<asset>{held.assets() if held else ''}</asset>"
        f"<worldbody>{bases}{held.bodies() if held else ''}</worldbody>"
        f"<equality>{held.equality() if held else ''}</equality>"
        f"<contact>{_pairs(parts) if held else ''}</contact></mujoco>"
    )
    try:
        model = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise ConfigError(f"the gripper's scene cannot be built: {error}; check the object's file") from error
    if held:
        _set_stiffness(model, parts)
    return model


def _touching(finger: ReducedFinger, parts: SceneParts, side: str) -> str:
    """The links of a finger with the crests that touch."""
    block = parts.held is None or parts.held.what.shape == "box"

    def crest(link: int) -> str:
        return _crest(finger, parts.make.crest_flat_mm, side, link, block)

    return crest(-1) + finger_bodies(finger, side, crest)


def _crest(finger: ReducedFinger, flat: float, side: str, link: int, block: bool) -> str:
    """The halves of crests that belong to a link: of its own unit above the hinge, of the next below it."""
    from_middle = flat / 2 - EDGE_MM if block else flat / 4
    heights = {}
    if link >= 0:
        heights[f"{side}_{link}_upper"] = from_middle
    if link < finger.n_units - 1:
        above = finger.pitch if link >= 0 else finger.cap + finger.pitch / 2
        heights[f"{side}_{link + 1}_lower"] = above - from_middle
    x, y = -(finger.half_width - EDGE_MM) / METRE, finger.height / 2 / METRE
    edge = EDGE_MM / METRE
    shape = f'type="box" size="{edge:.6g} {y:.6g} {flat / 4 / METRE:.6g}"'
    if block:
        shape = f'type="capsule" size="{edge:.6g} {y - edge:.6g}" quat="0.70710678 0.70710678 0 0"'
    return "".join(
        f'<geom name="{name}" {shape} pos="{x:.6g} 0 {z / METRE:.6g}" mass="0" contype="0" conaffinity="0"/>'
        for name, z in heights.items()
    )


def crest_ends(n_units: int, side: str) -> list[str]:
    """Names of the geoms with which a finger touches, halves of its crests, from the base.

    n_units : of the finger; side : `right` or `left`
    """
    return [f"{side}_{unit}_{end}" for unit in range(n_units) for end in ("lower", "upper")]


def _pairs(parts: SceneParts) -> str:
    held = parts.held
    assert held is not None
    mu = held.friction
    friction = f"{mu:.6g} {mu:.6g} {mu * TORSION_MM / METRE:.6g} 0.0001 0.0001"
    dimensions = 3 if held.what.shape == "box" else 4
    return "".join(
        f'<pair geom1="{end}" geom2="{held.geoms(side)}" condim="{dimensions}" friction="{friction}" '
        f'solimp="{IMPEDANCE} {IMPEDANCE} 0.001"/>'
        for side, finger in zip(SIDES, parts.fingers, strict=True)
        for end in crest_ends(finger.n_units, side)
    )


def _set_stiffness(model: mujoco.MjModel, parts: SceneParts) -> None:
    """Give each pair the stiffness of the walls that touch.

    At rest a contact's force is s r / ((1 - d) A), with r its depth, d its impedance, A the inverse mass that
    MuJoCo reckons with, and s the number that `solref` holds. A face of a box meets a capsule in two points.
    """
    held = parts.held
    assert held is not None
    points = 2.0 if held.what.shape == "box" else 1.0
    for number in range(model.npair):
        touching = [int(geom[number]) for geom in (model.pair_geom1, model.pair_geom2)]
        bodies = [int(model.geom_bodyid[geom]) for geom in touching]
        side = 0 if any(model.geom(geom).name.startswith("right_") for geom in touching) else 1
        wall = 0.5 * parts.make.wall_n_per_mm * parts.fingers[side].scale
        stiffness = 1.0 / (1.0 / wall + 1.0 / held.contact_stiffness()) * METRE / points
        inverse_mass = sum(float(model.body_invweight0[body, 0]) for body in bodies)
        spring = stiffness * (1.0 - IMPEDANCE) * inverse_mass
        rate = np.sqrt(spring / IMPEDANCE)
        model.pair_solref[number] = (-spring, -2.0 * CONTACT_DAMPING * rate)
