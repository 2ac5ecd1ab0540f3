"""A grip at rest: both fingers hold an exact pumped volume, no weight, no relaxation, no friction.

What finite elements of the grasp can be compared with: fluid without air is exchanged exactly, the object is
held in its place. The scene is moved from state to state and left to come to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tubefoot.errors import ConvergenceError
from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.twin.bench import bench_layout
from tubefoot.twin.bent_axis import BentAxis
from tubefoot.twin.gripper import Gripper, GripperFinger
from tubefoot.twin.gripper_scene import TIME_STEP_S, GripperMake, SceneParts
from tubefoot.twin.held_object import HeldObject
from tubefoot.units import DEG, KPA, ML
from tubefoot.vision.centreline import MarkedPoint, chord_angles

SLIPPERY = 1e-3
"""Coefficient of friction of these states."""
MOVED_S, RESTED_S = 0.6, 1.0
"""Time to pump from one state to the next, and to come to rest [s]."""
OPENED_ML = -1.0
"""Pumped volume at which the object is put in place."""
TOLERANCE = 1e-8
"""Of the chamber pressures [MPa]."""


@dataclass(frozen=True)
class GripState:
    """A state at rest; angles inward positive, of the right finger.

    normal_force_n : of each finger, mean of both
    vertical_force_n : of the right finger on the object, upwards; the flanks are tilted
    contact_height_mm : of the resultant above the base
    theta1_deg, theta2_deg : turn of the middle line over its lower and upper half
    theta1_chord_deg, theta2_chord_deg : the same from chords between the markers' lower edges
    """

    pumped_volume_ml: float
    normal_force_n: float
    vertical_force_n: float
    contact_height_mm: float
    bend_deg: float
    theta1_deg: float
    theta2_deg: float
    theta1_chord_deg: float
    theta2_chord_deg: float
    pressure_right_kpa: float
    pressure_left_kpa: float


def grip_states(
    what: GraspObject,
    pose: Pose,
    pumped_ml: Sequence[float],
    height_mm: float = 70.0,
    make: GripperMake | None = None,
    finger: ReducedFinger | None = None,
) -> list[GripState]:
    """The states at pumped volumes, in their order.

    what : the object; pose : front or side; pumped_ml : of each finger, inward positive [ml]
    height_mm : of the object's middle; make : of the gripper; finger : both; the reference finger if not
        given

    Raises ConvergenceError when the chambers cannot hold a volume.
    """
    law = finger or reference_file().to_finger()
    held = HeldObject(what, pose, SLIPPERY)
    gripper = Gripper(SceneParts((law, law), make or GripperMake(), held), gravity=False)
    _pump(gripper, 0.0, OPENED_ML)
    gripper.place((0.0, 0.0, height_mm))
    states, last = [], OPENED_ML
    for volume in pumped_ml:
        _pump(gripper, last, volume)
        last = volume
        states.append(_state(gripper, volume))
    return states


def _pump(gripper: Gripper, before: float, after: float) -> None:
    moved, rested = round(MOVED_S / TIME_STEP_S), round(RESTED_S / TIME_STEP_S)
    course = np.concatenate([np.linspace(before, after, moved + 1)[1:], np.full(rested, after)])
    for volume in course:
        for finger in gripper.fingers:
            finger.advance(*_pressures(finger, volume * ML), TIME_STEP_S)


def _pressures(finger: GripperFinger, volume: float) -> tuple[float, float]:
    """Chamber pressures that hold a volume on the right and its opposite on the left [MPa]."""
    right, left = finger.pressures
    for _ in range(40):
        in_right, in_left, rr, rl, ll = finger.volumes(right, left, TIME_STEP_S)
        miss_right, miss_left, det = volume - in_right, -volume - in_left, rr * ll - rl * rl
        by_right, by_left = (
            (ll * miss_right - rl * miss_left) / det,
            (rr * miss_left - rl * miss_right) / det,
        )
        right, left = right + by_right, left + by_left
        if max(abs(by_right), abs(by_left)) < TOLERANCE:
            return right, left
    raise ConvergenceError(f"no pressures hold {volume / ML:.3f} ml in the finger; pump less")


def _state(gripper: Gripper, volume: float) -> GripState:
    right, left = gripper.touches()
    finger = gripper.fingers[0]
    layout = bench_layout()
    axis = BentAxis(layout, finger.unit_angles)
    _, (middle, tip) = axis.at([layout.length_mm / 2, layout.length_mm])
    heights = [place.z_mm for place in layout.markers]
    points, directions = axis.at(heights)
    marked = [
        MarkedPoint(height, float(x), float(z), float(angle))
        for height, (x, z), angle in zip(heights, points, directions, strict=True)
    ]
    chords = chord_angles(marked, layout.length_mm, layout.marker_side_mm)
    return GripState(
        volume,
        0.5 * (right.normal + left.normal),
        float(right.force[2]),
        right.height,
        finger.bend / DEG,
        float(middle) / DEG,
        float(tip - middle) / DEG,
        chords[0] / DEG,
        chords[1] / DEG,
        float(finger.pressures[0]) / KPA,
        float(finger.pressures[1]) / KPA,
    )
