"""What the file of a reduced finger is filled with: laws fitted to states, masses and sizes of the design."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from tubefoot import __version__
from tubefoot.config import Settings
from tubefoot.design.finger import FingerDesign
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.errors import ConvergenceError
from tubefoot.fea.finger_mesh import DEFAULT_ELEMENT_SIZE
from tubefoot.reduced.files import (
    FORMAT_VERSION,
    GRAM,
    LawTable,
    RangeTable,
    ReducedFile,
    RelaxationTable,
)
from tubefoot.study.reduction_fit import (
    INNER_CHOICES,
    Terms,
    fit_laws,
    fit_shear,
    identified_range,
    softest,
)
from tubefoot.study.reduction_states import SolvedState
from tubefoot.units import DEG, GRAM_PER_CM3, KPA

LEAST_SOFTNESS = 0.05
"""Stiffness and compliance that a law must keep anywhere in its range, over those at rest."""
WATER = 1.0 * GRAM_PER_CM3
"""Density of the fluid [t/mm^3]."""


class ReduceSettings(Settings):
    """How a finger is reduced."""

    pressure_kpa: Annotated[float, Field(ge=1.0, le=300.0)] = 45.0
    """Right pressure up to which the pump's path is identified, where the finger gets that far."""
    element_size_mm: Annotated[float, Field(ge=0.2, le=10.0)] = DEFAULT_ELEMENT_SIZE
    units: Annotated[int, Field(ge=3, le=24)] = 4
    """Units of the finger that is filled and loaded."""
    long_units: Annotated[int, Field(ge=4, le=48)] = 6
    """Units of the longer finger that is filled only."""

    @model_validator(mode="after")
    def _longer(self) -> Self:
        if self.long_units <= self.units:
            raise ValueError(
                f"long_units = {self.long_units} must be more than units = {self.units}: the difference "
                "of the two fingers tells units from ends"
            )
        return self


def unit_hash(design: FingerDesign) -> str:
    """Hash of what a reduced finger depends on: bellows but for the number of units, wall, seam.

    design : the finger
    """
    body = (
        "mu_mpa",
        "alpha",
        "bulk_modulus_mpa",
        "scale",
        "density_g_per_cm3",
        "relaxation_time_s",
        "relaxation_share",
    )
    seam = ("thickness_mm", "modulus_mpa", "poisson_ratio")
    record = {
        "bellows": design.bellows.model_dump(mode="json", exclude={"units"}),
        "body": design.body.model_dump(mode="json", include=set(body)),
        "seam": design.seam.model_dump(mode="json", include=set(seam)),
    }
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def stable_content(
    design: FingerDesign, settings: ReduceSettings, used: Sequence[SolvedState]
) -> tuple[ReducedFile, tuple[float, float]]:
    """The content with the richest law that is stable over its range, and what `softest` says of it.

    design : the finger; settings : how it was sampled; used : states of the fit

    Raises ConvergenceError when no law is stable.
    """
    for terms in INNER_CHOICES:
        content = _content(design, settings, used, terms)
        found = softest(content.to_finger())
        if min(found) > LEAST_SOFTNESS:
            return content, found
    raise ConvergenceError(
        f"no law is stable over the range of the states (smallest stiffness {found[0]:.2f}, compliance "
        f"{found[1]:.2f} of rest); lower --pressure-kpa"
    )


def _content(
    design: FingerDesign, settings: ReduceSettings, used: Sequence[SolvedState], terms: Terms
) -> ReducedFile:
    """The file's content, its errors still to be judged."""
    inner, base, tip = (LawTable.of(law) for law in fit_laws(used, terms))
    valid = identified_range(used)
    profile = design.profile
    wall = (
        profile.height * profile.pitch * _mean_width(design)
        - 2 * chamber_rest_volume(profile) / profile.units
    )
    water = 2 * chamber_rest_volume(profile) / profile.units
    density = design.body.density_g_per_cm3 * GRAM_PER_CM3
    cap = 2 * profile.valley_outside * profile.height * profile.cap * density
    return ReducedFile(
        version=FORMAT_VERSION,
        name=design.name,
        units=profile.units,
        pitch_mm=profile.pitch,
        cap_mm=profile.cap,
        half_width_mm=profile.crest_outside,
        height_mm=profile.height,
        unit_mass_g=(wall * density + water * WATER) / GRAM,
        cap_mass_g=cap / GRAM,
        shear_compliance_mm_per_n=fit_shear(used),
        range=RangeTable(
            unit_angle_deg=valid.angle / DEG,
            pressure_low_kpa=valid.pressure_low / KPA,
            pressure_high_kpa=valid.pressure_high / KPA,
        ),
        inner=inner,
        base=base,
        tip=tip,
        relaxation=RelaxationTable(time_s=design.body.relaxation_time_s, share=design.body.relaxation_share),
        provenance={
            "design_sha256": unit_hash(design),
            "tubefoot": __version__,
            "command": "tubefoot reduce",
            "states": len(used),
            **settings.model_dump(mode="json"),
        },
        errors={},
    )


def _mean_width(design: FingerDesign) -> float:
    """Mean outside width of a unit along x [mm]: the area of its outline over its pitch."""
    corners = design.profile.outer_corners()
    x, z = (
        np.r_[corners[:1, 0], corners[:, 0], corners[-1:, 0]],
        np.r_[0.0, corners[:, 1], design.profile.pitch],
    )
    return float(2 * np.trapezoid(x, z) / design.profile.pitch)
