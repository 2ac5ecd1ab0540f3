"""Reduced fingers for tests: one drawn at random, one with closed forms."""

import numpy as np

from tubefoot.reduced.chain import FingerRange
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import UnitLaw, admissible_terms

VALID = FingerRange(angle=0.2, pressure_low=-0.06, pressure_high=0.05)


def random_finger(n_units=5, seed=3):
    rng = np.random.default_rng(seed)
    laws = []
    for degree, size in ((6, 1.0), (4, 0.3), (4, 0.2)):
        terms = admissible_terms(degree, 4)
        laws.append(UnitLaw(terms, tuple(size * rng.standard_normal(len(terms)))))
    return ReducedFinger(
        name="random",
        n_units=n_units,
        pitch=7.0,
        cap=4.0,
        inner=laws[0],
        base=laws[1],
        tip=laws[2],
        valid=VALID,
        half_width=11.0,
        height=9.0,
        unit_mass=1.3e-6,
        cap_mass=0.5e-6,
    )


def linear_finger(bending=70.0, arm=90.0, own=2400.0, n_units=4, valid=VALID):
    """Psi = K phi^2 / 2 - a phi (p_R - p_L) - c (p_R^2 + p_L^2) / 2, ends like units."""
    angle, pressure = 0.1, 0.035
    law = UnitLaw(
        ((2, 0, 0), (1, 1, 0), (0, 2, 0), (0, 0, 2)),
        (
            bending * angle**2 / 2,
            -arm * angle * pressure,
            -own * pressure**2 / 4,
            -own * pressure**2 / 4,
        ),
    )
    none = UnitLaw(((2, 0, 0),), (0.0,))
    size = {"half_width": 11.0, "height": 9.0, "unit_mass": 1.3e-6, "cap_mass": 0.5e-6}
    return ReducedFinger("linear", n_units, 7.0, 4.0, law, none, none, valid, **size)
