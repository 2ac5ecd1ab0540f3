"""Whether a grip damages the object: what it does to it against what it is known to bear.

Of the whole object, with the force F of one finger: the stress across it, F over its face; its shortening, F
over its firmness; F itself. Where a crest touches, Hertz's laws with the plane moduli E / (1 - nu^2) of both
in series (K. L. Johnson, Contact Mechanics, 1985, chapter 4):

    round object   a^3 = 3 F R / (4 E*),   p = 3 F / (2 pi a^2),   tension beside it (1 - 2 nu) p / 3
    flat face      the rounded end of a crest's flat as a cylinder of radius r, load F' = F / length:
                   b^2 = 4 F' r / (pi E*),   p = 2 F' / (pi b); no tension beside it

The bounds of `GraspObject.damage` are stresses of specimens that were compressed or pulled as a whole. Under
a crest the stress of a block is higher: by finite elements the 99th percentile of its compression is
`LOCAL_KPA_PER_N` times the force of that crest. Its margin is told apart (`local_margin`): one below one does
not show damage, it leaves what the bounds are known for.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isinf, pi

from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.units import KPA

WALL_PLANE_MODULUS = 4.0 * 0.249
"""Plane modulus of the finger's wall, incompressible with the shear modulus of Agilus30 [MPa]."""
CREST_LENGTH, CREST_RADIUS = 9.0, 1.0
"""Of a crest's end, across the finger and in the bending plane [mm]; the radius is assumed."""
LOCAL_KPA_PER_N = 40.0
"""Compression in a block of tofu under one crest over the crest's force: 1.8 kPa at 0.051 N and 3.3 kPa at
0.084 N, 99th percentiles of a coarse mesh (4 mm cells, two units, `fea/grasp.py`) [kPa/N]."""


@dataclass(frozen=True)
class Damage:
    """What a grip does at most.

    pressure_kpa : peak of the contact pressure, estimated
    compression_kpa, tension_kpa : stress across the object, and beside the contact
    compression_share : shortening over width
    local_kpa : compression of a block under its most loaded crest, estimated; 0 for other shapes
    local_margin : bound on compression over that; infinite where either is missing
    margins : bound over value, by bound; infinite without load
    """

    pressure_kpa: float
    compression_kpa: float
    tension_kpa: float
    compression_share: float
    local_kpa: float
    local_margin: float
    margins: dict[str, float]

    @property
    def margin(self) -> float:
        """The least margin: below one a bound is exceeded."""
        return min(self.margins.values())

    @property
    def nearest(self) -> str:
        """The bound that is nearest."""
        return min(self.margins, key=lambda key: self.margins[key])


def damage_of(what: GraspObject, pose: Pose, force: float, crest_force: float | None = None) -> Damage:
    """What a grip does to an object.

    what : the object; pose : front or side; force : largest normal force of one finger [N]
    crest_force : of the most loaded end of a crest [N]; all of `force` if not known
    """
    at_crest = force if crest_force is None else crest_force
    pressure, tension = contact_pressure(what, pose, at_crest)
    local = LOCAL_KPA_PER_N * at_crest if what.shape == "box" else 0.0
    bound = what.damage.compression_kpa
    local_margin = bound / local if bound is not None and local > 0.0 else float("inf")
    compression = force / what.face_area(pose)
    share = force / what.firmness(pose) / what.sizes(pose)[0]
    values = {
        "contact_force_n": force,
        "compression_share": share,
        "compression_kpa": compression / KPA,
        "tension_kpa": tension / KPA,
    }
    bounds = what.damage.model_dump(include=set(values))
    margins = {
        key: bounds[key] / value if value > 0 else float("inf")
        for key, value in values.items()
        if bounds[key] is not None
    }
    return Damage(pressure / KPA, compression / KPA, tension / KPA, share, local, local_margin, margins)


def contact_pressure(what: GraspObject, pose: Pose, force: float) -> tuple[float, float]:
    """Peak pressure where a crest touches, and the largest tension beside it [MPa].

    what : the object; pose : front or side; force : of that contact [N]
    """
    if force <= 0.0:
        return 0.0, 0.0
    plane = what.modulus / (1.0 - what.poisson**2)
    both = 1.0 / (1.0 / plane + 1.0 / WALL_PLANE_MODULUS)
    radius = what.radius(pose)
    if isinf(radius):
        load = force / min(CREST_LENGTH, what.sizes(pose)[1])
        half = (4.0 * load * CREST_RADIUS / (pi * both)) ** 0.5
        return 2.0 * load / (pi * half), 0.0
    patch = (3.0 * force * radius / (4.0 * both)) ** (1.0 / 3.0)
    peak = 3.0 * force / (2.0 * pi * patch**2)
    return peak, (1.0 - 2.0 * what.poisson) / 3.0 * peak
