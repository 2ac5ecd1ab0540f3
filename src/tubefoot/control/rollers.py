"""The ripple of a peristaltic pump: the volume by which its rollers run ahead of the motor.

A roller that lifts off takes its share of the tube with it: the flow dips once between two rollers. A long
pulse does not mind; one that is short against that distance moves up to a third less or a tenth more than its
duration tells. Over the volume v that the motor has turned either way, s from roller to roller,

    ahead(v) = sum_h a_h sin(2 pi h v / s) + b_h cos(2 pi h v / s),     h = 1, 2

Higher terms move less than a microlitre. The fit of recordings (`validation/`) has the same form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ROLLER_MM3 = 300.0
"""From roller to roller: 0.9 ml a turn, three rollers."""
SPREADS_MM3 = np.array([4.0, 4.0, 1.5, 1.5])
"""Scatter of a_1, b_1, a_2, b_2: dips of 0.2 to 0.5 of the flow, the rollers standing anywhere."""


def ahead(turned: FloatArray, amplitudes: FloatArray) -> FloatArray:
    """Volume by which the rollers are ahead, (n,) [mm^3].

    turned : (n,) volume that the motor has turned, either way [mm^3]
    amplitudes : (4, n) a_1, b_1, a_2, b_2 [mm^3]
    """
    phase = 2.0 * np.pi / ROLLER_MM3 * turned
    sin, cos = np.sin(phase), np.cos(phase)
    shapes = np.stack([sin, cos, 2.0 * sin * cos, 2.0 * cos**2 - 1.0])
    return np.asarray((amplitudes * shapes).sum(axis=0))
