"""Where the object is held for the fingers: how high, and how far apart they open for it.

A crest that is left above the upper edge of a block curls over it and hooks: with each further pulse it
presses down on the edge instead of on the face, and the block slips when the hand lets go. So what has an
edge is held with its top level with the fingertips. A round object has none; it is held where the free tip
closes behind it.
"""

from __future__ import annotations

from tubefoot.control.grasp_settings import GraspSettings
from tubefoot.lab.grasp_object import GraspObject, Pose

ROUND_BELOW_TIP_MM = 22.0
"""Middle of a round object below the fingertips [mm]: three units of the reference finger."""
FLAT_TOPPED = ("box", "cylinder", "mesh")


def placing_height(what: GraspObject, pose: Pose, settings: GraspSettings, length: float) -> float:
    """Height of the object's middle above the outer face of the base [mm].

    what : the object; pose : front or side; settings : of the grasp, whose `height_mm` counts if given
    length : of the fingers [mm]
    """
    if settings.height_mm is not None:
        return settings.height_mm
    half = 0.5 * what.sizes(pose)[2]
    below = half if what.shape in FLAT_TOPPED else max(half, ROUND_BELOW_TIP_MM)
    return max(length - below, half)


def free_width(what: GraspObject, pose: Pose, settings: GraspSettings) -> float:
    """Half the width to which the fingers open before the object is placed [mm].

    what : the object; pose : front or side; settings : of the grasp
    """
    return 0.5 * what.sizes(pose)[0] + settings.pulses.clearance_mm
