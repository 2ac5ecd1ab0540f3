"""`tubefoot solve`: a design in, pressures, volumes, bend angle and stress out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tubefoot.errors import ConfigError


def solve(
    design: Path,
    /,
    *,
    out: Path | None = None,
    until: str = "pressure_right_kpa=35",
    states: int = 8,
    element_size_mm: float | None = None,
    cavities: str = "coupled",
    left_over_right: float = 0.0,
    air_right_ml: float = 0.0,
    air_left_ml: float = 0.0,
    viscoelastic: Annotated[bool, Parameter(negative="")] = False,
    ramp_s: float = 2.0,
    hold_s: float = 0.0,
    hold: str = "pump",
    recover_s: float = 0.0,
    fields: str = "all",
    pictures: bool = True,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Solve a finger: curve.csv, regions.csv, summary.json, stress fields for ParaView, pictures.

    An interrupted run goes on at its last converged state when the same command is given again.

    Example: tubefoot solve examples/designs/reference-3.toml --until bend_deg=10 --out out/bend-10

    Parameters
    ----------
    design
        Design file, as written by `tubefoot new`.
    out
        Directory for the results; out/NAME if not given.
    until
        Where the path ends, QUANTITY=VALUE with pressure_right_kpa, pressure_left_kpa,
        volume_change_right_ml, volume_change_left_ml, pumped_volume_ml or bend_deg.
    states
        Into how many states the way is cut, about.
    element_size_mm
        Longest edge of a cell [mm].
    cavities
        coupled (one pump moves fluid from the left to the right chamber), volume or pressure
        (both chambers prescribed, the left one's by --left-over-right).
    left_over_right
        Left chamber's volume change or pressure over the right one's.
    air_right_ml
        Trapped air of the right pressure branch at zero gauge [mL].
    air_left_ml
        Trapped air of the left pressure branch at zero gauge [mL].
    viscoelastic
        Solve in time: the body relaxes with the design's Prony terms.
    ramp_s
        Time in which a viscoelastic solve goes to its end [s].
    hold_s
        How long it is held there [s].
    hold
        pump (the pump stands still, the pressures relax) or goal (the quantity of --until is kept).
    recover_s
        How long the finger rests after the drive has run back [s]; 0: it does not run back.
    fields
        Of which states stress fields are written: all, last or none.
    pictures
        Whether pictures are drawn.
    overwrite
        Replace another run's results in the directory.
    """
    from tubefoot.config import parse_settings
    from tubefoot.design.finger import load_design
    from tubefoot.fea.finger_model import SolveSettings
    from tubefoot.fea.solve import solve_design

    finger = load_design(design)
    table: dict[str, Any] = {
        **parse_until(until),
        "states": states,
        "cavities": cavities,
        "left_over_right": left_over_right,
        "air_right_ml": air_right_ml,
        "air_left_ml": air_left_ml,
        "viscoelastic": viscoelastic,
        "ramp_s": ramp_s,
        "hold_s": hold_s,
        "hold": hold,
        "recover_s": recover_s,
        "fields": fields,
    }
    if element_size_mm is not None:
        table["element_size_mm"] = element_size_mm
    settings = parse_settings(table, SolveSettings, source="solve")
    directory = out or Path("out") / finger.name
    print(f"{finger.name}: {finger.bellows.units} units, until {settings.until} = {settings.target:g}")
    result = solve_design(finger, directory, settings, progress=_print_row, overwrite=overwrite)
    summary = result.summary
    print(f"ended: {summary['end_reason']}")
    print(
        f"bend {summary['bend_deg']:.2f} deg at {summary['pressure_right_kpa']:.2f} kPa right, "
        f"{summary['pressure_left_kpa']:.2f} kPa left; {summary['elements']} cells, "
        f"{summary['unknowns']} unknowns, {summary['wall_s']:.1f} s"
    )
    if pictures:
        from tubefoot.report.pictures import draw_solve_pictures

        for path in draw_solve_pictures(directory):
            print(f"picture: {path}")
    print(f"results: {directory}")


def parse_until(text: str) -> dict[str, Any]:
    """The goal in `QUANTITY=VALUE` as settings.

    text : as given on the command line

    Raises ConfigError when it is not of that form.
    """
    match = re.fullmatch(r"\s*([a-z_]+)\s*=\s*([-+0-9.eE]+)\s*", text)
    try:
        if match is None:
            raise ValueError
        return {"until": match[1], "target": float(match[2])}
    except ValueError:
        raise ConfigError(f"--until {text!r}: write QUANTITY=VALUE, e.g. pressure_right_kpa=35") from None


def _print_row(row: dict[str, Any]) -> None:
    print(
        f"  state {row['step']:3d}: pumped {row['pumped_volume_ml']:7.4f} ml, "
        f"right {row['pressure_right_kpa']:7.2f} kPa, left {row['pressure_left_kpa']:7.2f} kPa, "
        f"bend {row['bend_deg']:6.2f} deg, {row['newton_iterations']} iterations, {row['wall_s']:.1f} s",
        flush=True,
    )
