"""The finger that a bench's settings describe."""

from __future__ import annotations

from tubefoot.reduced.files import read_reduced, reference_file
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import NO_RELAXATION, ROOM_C, Prony
from tubefoot.twin.bench_settings import FingerMake
from tubefoot.twin.finger_response import FingerResponse, LinearFinger
from tubefoot.twin.still_finger import StillFinger
from tubefoot.units import DEG, KPA, ML

LINEAR_MEMORY = ((0.5, 0.1), (0.3, 1.0), (0.2, 10.0))
"""Relaxation of the linear stand-in: share of its bending stiffness, time [s]; milder than Agilus30."""

LONGEST_STEP_S = 2.5e-3
"""Of the chain while the fluid takes longer steps [s]; the plant's own millisecond otherwise."""


def finger_length(make: FingerMake) -> float:
    """Length of the finger at rest, caps included [mm].

    make : of the finger; the linear stand-in is as long as the reference finger
    """
    return law_of(make)[0].length


def finger_of(make: FingerMake, kelvin: float = 0.0) -> FingerResponse:
    """The finger that the settings describe.

    make : of the finger; raises ConfigError when its model cannot be read
    kelvin : by which the room is warmer than 23 degC; its wall then relaxes faster
    """
    if make.law == "linear":
        factor, seam = make.stiffness, 1.0 + make.seam_stiffening
        return LinearFinger(
            compliance=2.0 * ML / (100 * KPA) / factor,
            partition=1.5 * ML / (100 * KPA) / factor / seam,
            gain=0.85 * DEG / KPA / factor / seam,
            memory=LINEAR_MEMORY if make.creep else (),
        )
    law, memory = law_of(make, kelvin)
    if make.law == "chain":
        from tubefoot.twin.finger import Mounting, SimulatedFinger

        print_of_it = law.with_scale(make.stiffness)
        mounting = Mounting(make.tilt_deg)
        return SimulatedFinger(print_of_it, memory, mounting, LONGEST_STEP_S, make.seam_stiffening)
    return StillFinger(law, memory, make.stiffness, make.seam_stiffening)


def law_of(make: FingerMake, kelvin: float = 0.0) -> tuple[ReducedFinger, Prony]:
    """The reduced finger that the settings name, of the stiffness in its file, and the memory of its wall.

    make : of the finger; raises ConfigError when its model cannot be read
    kelvin : by which the room is warmer than 23 degC
    """
    content = read_reduced(make.model) if make.model else reference_file()
    law = content.to_finger()
    memory = content.to_prony(ROOM_C + kelvin) if make.creep else NO_RELAXATION
    return law if make.units is None else law.with_units(make.units), memory
