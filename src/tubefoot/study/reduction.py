"""The reduce stage: a design in, the reduced finger with its errors out, resumable after a kill.

Two short fingers of the design are solved by finite elements: one under fillings and tip loads, a longer one
under fillings only. What they differ in belongs to units, what they share to the ends. States held out of the
fit judge it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from tubefoot import __version__
from tubefoot.config import Settings
from tubefoot.design.finger import FingerDesign
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.errors import ConvergenceError
from tubefoot.fea.finger_mesh import DEFAULT_ELEMENT_SIZE
from tubefoot.records import Run, write_json, write_table
from tubefoot.reduced.files import (
    FORMAT_VERSION,
    GRAM,
    LawTable,
    RangeTable,
    ReducedFile,
    RelaxationTable,
    write_reduced,
)
from tubefoot.study.reduction_fit import (
    INNER_CHOICES,
    StateError,
    Terms,
    fit_laws,
    fit_shear,
    identified_range,
    softest,
    state_error,
    summarise,
)
from tubefoot.study.reduction_states import (
    FILLING_PLAN,
    PLAN,
    Branch,
    Sampler,
    Sampling,
    SolvedState,
    StateStore,
)
from tubefoot.units import DEG, GRAM_PER_CM3, KPA, ML

LEAST_SOFTNESS = 0.05
"""Stiffness and compliance that a law must keep anywhere in its range, over those at rest."""
WATER = 1.0 * GRAM_PER_CM3
"""Density of the fluid [t/mm^3]."""

Progress = Callable[[int, SolvedState], None]


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


@dataclass
class ReduceResult:
    """What was identified: the file, its content, the error at each state, branches that ended early."""

    path: Path
    content: ReducedFile
    errors: list[StateError]
    ended: dict[str, str]


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


def reduce_design(
    design: FingerDesign,
    directory: Path | str,
    settings: ReduceSettings | None = None,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> ReduceResult:
    """The reduced finger of a design, written to a directory; an interrupted run goes on where it was.

    design : the finger; directory : where the results go; settings : pressures, mesh, fingers
    progress : called with the number of states that are known by now and each state
    overwrite : replace the states of another design in the directory

    Raises ConfigError when the directory holds another design's states, ConvergenceError when too few states
    could be solved or the law found is not stable.
    """
    settings = settings or ReduceSettings()
    record = {"design": design.model_dump(mode="json"), "reduce": settings.model_dump(mode="json")}
    run = Run(directory, "reduce", record)
    counted = _Counter(progress)
    samplings = [
        _sampled(design, units, plan, settings, run.path(f"states/{units}"), counted, overwrite)
        for units, plan in ((settings.units, PLAN), (settings.long_units, FILLING_PLAN))
    ]
    states = [state for sampling in samplings for state in sampling.states]
    used = [state for state in states if not state.check]
    content, (stiffness, compliance) = _stable_content(design, settings, used)
    finger = content.to_finger()
    errors = [state_error(finger.with_units(len(state.found.angles)), state) for state in states]
    held_out = [error for error in errors if error.state.check]
    judged = summarise(held_out) if held_out else {}
    content = content.model_copy(update={"errors": judged})
    path = write_reduced(run.path("reduced.toml"), content)
    ended = {
        f"{units} units, {name}": reason
        for units, sampling in zip((settings.units, settings.long_units), samplings, strict=True)
        for name, reason in sampling.ended.items()
    }
    write_table(run.path("states.csv"), [_row(error) for error in errors])
    summary = {
        "states": len(states),
        "held_out": judged,
        "fitted": summarise([error for error in errors if not error.state.check]),
        "smallest_stiffness_over_rest": stiffness,
        "smallest_compliance_over_rest": compliance,
        "ended_early": ended,
        "wall_s": run.wall_s,
    }
    write_json(run.path("summary.json"), summary)
    run.finish()
    return ReduceResult(path, content, errors, ended)


class _Counter:
    """Passes states on with their number."""

    def __init__(self, progress: Progress | None):
        self.progress, self.count = progress, 0

    def __call__(self, state: SolvedState) -> None:
        self.count += 1
        if self.progress is not None:
            self.progress(self.count, state)


def _sampled(
    design: FingerDesign,
    units: int,
    plan: tuple[Branch, ...],
    settings: ReduceSettings,
    directory: Path,
    progress: _Counter,
    overwrite: bool,
) -> Sampling:
    """The states of one of the two fingers."""
    if overwrite:
        StateStore.clear(directory)
    short = design.with_bellows(units=units)
    chosen = settings.model_dump(mode="json", include={"pressure_kpa", "element_size_mm"})
    store = StateStore(directory, {"design": unit_hash(design), "units": units, "plan": str(plan), **chosen})
    return Sampler(short, settings.element_size_mm, store, progress).run(plan, settings.pressure_kpa * KPA)


def _stable_content(
    design: FingerDesign, settings: ReduceSettings, used: Sequence[SolvedState]
) -> tuple[ReducedFile, tuple[float, float]]:
    """The content with the richest law that is stable over its range, and what `softest` says of it."""
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


def _row(error: StateError) -> dict[str, Any]:
    """A row of states.csv."""
    state, found = error.state, error.state.found
    return {
        "branch": state.branch,
        "step": state.step,
        "held_out": state.check,
        "units": len(found.angles),
        "couple_nmm": state.asked.couple,
        "force_n": state.asked.force,
        "volume_change_right_ml": float(found.volumes[0]) / ML,
        "volume_change_left_ml": float(found.volumes[1]) / ML,
        "pressure_right_kpa": float(found.pressures[0]) / KPA,
        "pressure_left_kpa": float(found.pressures[1]) / KPA,
        "bend_deg": found.bend / DEG,
        "tip_x_mm": found.tip[0],
        "tip_z_mm": found.tip[1],
        "strain_energy_mj": found.energy,
        "contact_gap_min_mm": found.gap,
        "bend_error_deg": error.bend_deg,
        "unit_error_deg": error.unit_deg,
        "pressure_error_kpa": error.pressure_kpa,
        "volume_error_ml": error.volume_ml,
    }
