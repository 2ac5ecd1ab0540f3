"""How firm a grip must be, and how firm it may be.

Two fingers bear a weight W by friction when each presses with W / (2 mu). The object bears no more than the
least of its bounds turned into a force of one finger.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from tubefoot.control.grasp_settings import GripSettings
from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.units import KPA


@dataclass(frozen=True)
class GripGoal:
    """Forces of one finger.

    force : to be reached [N]; most : not to be exceeded, infinite where only tension is bounded [N]
    needed : that friction needs without a margin [N]
    """

    force: float
    most: float
    needed: float

    @property
    def within_bounds(self) -> bool:
        """Whether the goal keeps the object's bounds with the wanted margin."""
        return self.force <= self.most

    @classmethod
    def of(cls, what: GraspObject, pose: Pose, settings: GripSettings) -> GripGoal:
        """The goal for an object.

        what : the object; pose : front or side; settings : of the grip
        """
        needed = what.weight / (2.0 * settings.friction_min)
        bearable = [bound for bound in bearable_forces(what, pose).values() if bound is not None]
        most = settings.damage_share * min(bearable, default=inf)
        return cls(settings.safety * needed, most, needed)


def bearable_forces(what: GraspObject, pose: Pose) -> dict[str, float | None]:
    """Force of one finger at which each bound on the whole object is met [N]; None where it is not given.

    what : the object; pose : front or side
    """
    damage = what.damage
    width = what.sizes(pose)[0]
    return {
        "contact_force": damage.contact_force_n,
        "compression_share": damage.compression_share
        and damage.compression_share * width * what.firmness(pose),
        "compression": damage.compression_kpa and damage.compression_kpa * KPA * what.face_area(pose),
    }
