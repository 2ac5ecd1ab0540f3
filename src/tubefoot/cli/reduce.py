"""`tubefoot reduce`: a design in, the reduced finger model that twin and controllers use out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.study.reduction_states import SolvedState


def reduce(
    design: Path,
    /,
    *,
    out: Path | None = None,
    pressure_kpa: float = 45.0,
    element_size_mm: float | None = None,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Identify the reduced finger: reduced.toml, states.csv, summary.json.

    Two short fingers of the design are solved, about 95 states; their law then holds for any number of units.
    An interrupted run goes on at its last state when the same command is given again.

    Example: tubefoot reduce examples/designs/reference-12.toml --out out/reduced-12

    Parameters
    ----------
    design
        Design file, as written by `tubefoot new`.
    out
        Directory for the results; out/NAME-reduced if not given.
    pressure_kpa
        Right pressure up to which the pump's path is identified, where the finger gets that far.
    element_size_mm
        Longest edge of a cell [mm].
    overwrite
        Replace another design's states in the directory.
    """
    from tubefoot.config import parse_settings
    from tubefoot.design.finger import load_design
    from tubefoot.study.reduction import reduce_design
    from tubefoot.study.reduction_content import ReduceSettings

    finger = load_design(design)
    table: dict[str, Any] = {"pressure_kpa": pressure_kpa}
    if element_size_mm is not None:
        table["element_size_mm"] = element_size_mm
    settings = parse_settings(table, ReduceSettings, source="reduce")
    directory = out or Path("out") / f"{finger.name}-reduced"
    print(f"{finger.name}: states of {settings.units} and {settings.long_units} units")
    result = reduce_design(finger, directory, settings, progress=_print_state, overwrite=overwrite)
    for name, reason in result.ended.items():
        print(f"ended early: {name}: {reason}")
    valid, off = result.content.range, result.content.errors
    print(
        f"valid to {valid.unit_angle_deg:.1f} deg a unit, {valid.pressure_low_kpa:.1f} to "
        f"{valid.pressure_high_kpa:.1f} kPa"
    )
    if off:
        print(
            f"off by at most {off['bend_deg_max']:.2f} deg, {off['pressure_kpa_max']:.2f} kPa, "
            f"{off['volume_ml_max']:.4f} ml at {off['states']:.0f} states held out of the fit"
        )
    print(f"results: {directory}; reduced finger: {result.path}")


def _print_state(number: int, state: SolvedState) -> None:
    from tubefoot.units import DEG, KPA

    found = state.found
    print(
        f"  {number:3d} {state.branch:16s} right {found.pressures[0] / KPA:7.2f} kPa, "
        f"left {found.pressures[1] / KPA:7.2f} kPa, bend {found.bend / DEG:6.2f} deg, gap {found.gap:.2f} mm",
        flush=True,
    )
