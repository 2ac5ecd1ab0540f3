"""The links of a finger as MJCF, and a scene with one finger.

SI units (m, kg, s), as MuJoCo's contact defaults expect. Frame: x to the right, y into the picture, z up
along the straight finger from the middle of the base's outer face. A hinge about -y bends towards -x.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, radians, sin

from tubefoot.reduced.finger import ReducedFinger
from tubefoot.units import STANDARD_GRAVITY

METRE = 1e3
"""[mm]"""
NEWTON_METRE = 1e3
"""[N mm]"""
KILOGRAM = 1e-3
"""[t]"""


@dataclass(frozen=True)
class Mounting:
    """How the finger is held.

    tilt_deg : angle of the straight finger against the vertical, towards -x; 0 stands upright, 180 hangs
    gravity : whether weight acts; no, where the bending plane lies level
    """

    tilt_deg: float = 0.0
    gravity: bool = True


def finger_bodies(
    finger: ReducedFinger, name: str = "finger", inside: Callable[[int], str] = lambda link: ""
) -> str:
    """The links of a finger as MJCF, to be put into a body at its base.

    finger : gives lengths and masses; name : prefix of its bodies, joints and sites
    inside : MJCF to be put into each link, by its number

    Joints are NAME_0 to NAME_(n-1) from the base, links NAME_link_0 ... above them; the site NAME_tip lies in
    the middle of the tip face.
    """
    pitch, cap = finger.pitch / METRE, finger.cap / METRE
    unit, end = finger.unit_mass / KILOGRAM, finger.cap_mass / KILOGRAM
    lines = []
    for k in range(finger.n_units):
        rise = cap + pitch / 2 if k == 0 else pitch
        lines.append(f'<body name="{name}_link_{k}" pos="0 0 {rise:.9g}">')
        lines.append(f'<joint name="{name}_{k}" type="hinge" axis="0 -1 0"/>{inside(k)}')
        if k < finger.n_units - 1:
            lines.append(_inertial(finger, unit, pitch, pitch / 2))
    above = (unit / 2 * pitch / 4 + end * (pitch + cap) / 2) / (unit / 2 + end)
    lines.append(_inertial(finger, unit / 2 + end, pitch / 2 + cap, above))
    lines.append(f'<site name="{name}_tip" pos="0 0 {pitch / 2 + cap:.9g}" size="0.0005"/>')
    return "\n".join(lines) + "</body>" * finger.n_units


def _inertial(finger: ReducedFinger, mass: float, length: float, above: float) -> str:
    """Inertia of a link as that of a block of the finger's outline, its middle so far above the hinge."""
    x, y = 2 * finger.half_width / METRE, finger.height / METRE
    about = [mass / 12 * (a**2 + b**2) for a, b in ((y, length), (x, length), (x, y))]
    numbers = " ".join(f"{value:.9g}" for value in about)
    return f'<inertial pos="0 0 {above:.9g}" mass="{mass:.9g}" diaginertia="{numbers}"/>'


def finger_scene(finger: ReducedFinger, mounting: Mounting, time_step: float) -> str:
    """A scene with one finger at the origin, as MJCF.

    finger : gives lengths and masses; mounting : its direction against gravity; time_step : [s]
    """
    weight = STANDARD_GRAVITY / METRE if mounting.gravity else 0.0
    tilt = radians(mounting.tilt_deg)
    gravity = f"{-weight * sin(tilt):.9g} 0 {-weight * cos(tilt):.9g}"
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{time_step:.9g}" integrator="implicitfast" '
        f'jacobian="dense" gravity="{gravity}"/><worldbody><body name="base">{finger_bodies(finger)}</body>'
        "</worldbody></mujoco>"
    )
