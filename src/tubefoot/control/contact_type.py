"""Planar or curved contact from the two angles, by the paper's rule, with a confidence.

Planar: theta1 and theta2 of one sign, or theta2 near zero, |theta1| >> |theta2|. Curved: opposite signs, an
inflexion. In between lies no gap: with the share s = theta2 / theta1, curved is s < -LEAST_SHARE, planar is
-LEAST_SHARE <= s <= MOST_SHARE, and above that the finger bends evenly, as it does without an object. The
confidence is the probability of the region under the angles' normal errors, s being near normal for |theta1|
well above its error.

The rule belongs to a gentle grip: for every shape theta2 grows inward with each pulse and changes its sign.
So the answer holds for the grip level at which it was taken; `tubefoot grasp --map` shows how far.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, hypot, sqrt
from typing import Literal

from tubefoot.units import DEG

Kind = Literal["planar", "curved", "even", "unknown"]
LEAST_SHARE, MOST_SHARE = 0.25, 0.7
"""theta2 over theta1: below minus the first the contact counts as curved, above the second as none."""
MODEL_SIGMA = 0.5 * DEG
"""Uncertainty of each angle beside its scatter: weight, unlike fingers, where markers sit [rad]."""
LEAST_THETA1 = 1.0 * DEG
"""A smaller turn of the lower half says nothing [rad]."""


@dataclass(frozen=True)
class ContactType:
    """A classified contact.

    kind : planar, curved, even (as free bending), unknown; confidence : its probability
    share : theta2 over theta1
    """

    kind: Kind
    confidence: float
    share: float


def classify_contact(theta1: float, theta2: float, sigma: float = 0.0) -> ContactType:
    """The type of a contact.

    theta1, theta2 : turn of the lower and the upper half, of one sign convention [rad]
    sigma : standard uncertainty of their scatter [rad]
    """
    if not abs(theta1) > LEAST_THETA1:
        return ContactType("unknown", 0.0, float("nan"))
    share = theta2 / theta1
    spread = hypot(sigma, MODEL_SIGMA) * sqrt(1.0 + share**2) / abs(theta1)
    below = _normal((-LEAST_SHARE - share) / spread)
    above = 1.0 - _normal((MOST_SHARE - share) / spread)
    chances: dict[Kind, float] = {"curved": below, "even": above, "planar": max(0.0, 1.0 - below - above)}
    kind = max(chances, key=lambda key: chances[key])
    return ContactType(kind, chances[kind], share)


def _normal(value: float) -> float:
    """Cumulative normal distribution."""
    return 0.5 * (1.0 + erf(value / sqrt(2.0)))
