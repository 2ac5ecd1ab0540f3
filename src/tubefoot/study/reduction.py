"""The reduce stage: a design in, the reduced finger with its errors out, resumable after a kill.

Two short fingers of the design are solved by finite elements: one under fillings and tip loads, a longer one
under fillings only. What they differ in belongs to units, what they share to the ends. States held out of the
fit judge it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tubefoot.design.finger import FingerDesign
from tubefoot.records import Run, write_json, write_table
from tubefoot.reduced.files import (
    ReducedFile,
    write_reduced,
)
from tubefoot.study.reduction_content import ReduceSettings, stable_content, unit_hash
from tubefoot.study.reduction_fit import (
    StateError,
    state_error,
    summarise,
)
from tubefoot.study.reduction_plan import FILLING_PLAN, PLAN, Branch
from tubefoot.study.reduction_states import Sampler, Sampling, SolvedState, StateStore
from tubefoot.units import DEG, KPA, ML

Progress = Callable[[int, SolvedState], None]


@dataclass
class ReduceResult:
    """What was identified: the file, its content, the error at each state, branches that ended early."""

    path: Path
    content: ReducedFile
    errors: list[StateError]
    ended: dict[str, str]


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
    content, softest_of = stable_content(design, settings, used)
    finger = content.to_finger()
    errors = [state_error(finger.with_units(len(state.found.angles)), state) for state in states]
    ended = {
        f"{units} units, {name}": reason
        for units, sampling in zip((settings.units, settings.long_units), samplings, strict=True)
        for name, reason in sampling.ended.items()
    }
    return _written(run, content, errors, ended, softest_of)


def _written(
    run: Run,
    content: ReducedFile,
    errors: list[StateError],
    ended: dict[str, str],
    softest_of: tuple[float, float],
) -> ReduceResult:
    """The result, after writing the file, the table of states and the summary."""
    held_out = [error for error in errors if error.state.check]
    judged = summarise(held_out) if held_out else {}
    content = content.model_copy(update={"errors": judged})
    path = write_reduced(run.path("reduced.toml"), content)
    write_table(run.path("states.csv"), [_row(error) for error in errors])
    summary = {
        "states": len(errors),
        "held_out": judged,
        "fitted": summarise([error for error in errors if not error.state.check]),
        "smallest_stiffness_over_rest": softest_of[0],
        "smallest_compliance_over_rest": softest_of[1],
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
