"""`tubefoot solve`: a design in, pressures, volumes, bend angle and stress out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tubefoot.errors import ConfigError

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign
    from tubefoot.fea.solid_part import SolidPart


UNTIL = "pressure_right_kpa=35"


def solve(
    design: Path | None = None,
    /,
    *,
    mesh: Path | None = None,
    solid: Path | None = None,
    grasp: Path | None = None,
    out: Path | None = None,
    until: str = UNTIL,
    states: int = 8,
    element_size_mm: float | None = None,
    mesh_kind: str = "hexahedra",
    ports: Annotated[bool, Parameter(negative="")] = False,
    cavities: str = "coupled",
    left_over_right: float = 0.0,
    air_right_ml: float = 0.0,
    air_left_ml: float = 0.0,
    self_contact: bool = True,
    rigid_parts: str = "clamp",
    viscoelastic: Annotated[bool, Parameter(negative="")] = False,
    ramp_s: float = 2.0,
    hold_s: float = 0.0,
    hold: str = "pump",
    recover_s: float = 0.0,
    fields: str = "all",
    pictures: bool = True,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Solve a finger, or any soft solid with chambers.

    Written are curve.csv, regions.csv, summary.json, stress fields for ParaView and pictures.

    An interrupted run goes on at its last converged state when the same command is given again.

    Example: tubefoot solve examples/designs/reference-3.toml --until bend_deg=10 --out out/bend-10

    Example: tubefoot solve --solid examples/solids/eccentric-tube.toml --out out/eccentric-tube

    Example: tubefoot solve examples/designs/reference-12.toml --grasp examples/grasps/tofu-front.toml
    --element-size-mm 3 --out out/tofu-front

    Parameters
    ----------
    design
        Design file, as written by `tubefoot new`.
    mesh
        In place of a design: mesh (.msh, .inp, .vtu) or solid (.step) with surface sets base, tip,
        cavity_right, and maybe cavity_left, mid_plane; with a design, its body material is taken.
    solid
        In place of a design: settings file with mesh or STEP file, names of its sets, materials.
    grasp
        Settings file of an object that two such fingers grasp: the finger opens, the object is put in place,
        the finger closes on it; its pumped volumes stand in for --until.
    out
        Directory for the results; out/NAME if not given.
    until
        Where the path ends, QUANTITY=VALUE with pressure_right_kpa, pressure_left_kpa,
        volume_change_right_ml, volume_change_left_ml, pumped_volume_ml or bend_deg.
    states
        Into how many states the way is cut, about.
    element_size_mm
        Longest edge of a cell [mm].
    mesh_kind
        How a design is meshed: hexahedra (swept) or tetrahedra (Netgen).
    ports
        Whether tubes and bores are part of the solid; with tetrahedra.
    cavities
        coupled (one pump moves fluid from the left to the right chamber), volume or pressure
        (both chambers prescribed, the left one's by --left-over-right), or filtered (a grid of pressures,
        kept where the volume changes are opposite within 3 %).
    left_over_right
        Left chamber's volume change or pressure over the right one's.
    air_right_ml
        Trapped air of the right pressure branch at zero gauge [mL].
    air_left_ml
        Trapped air of the left pressure branch at zero gauge [mL].
    self_contact
        Whether walls that touch hold each other; with --no-self-contact the path ends there.
    rigid_parts
        clamp (the base cap is held at its underside) or modelled (socket, plate and tubes are stiff parts).
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

    part = _part(design, mesh, solid)
    if grasp is not None and (part is not None or until != UNTIL):
        raise ConfigError("--grasp goes with a design, and its file says how far: leave --until out")
    table: dict[str, Any] = {
        **parse_until(until),
        "states": states,
        "mesh_kind": mesh_kind,
        "ports": ports,
        "cavities": cavities,
        "left_over_right": left_over_right,
        "air_right_ml": air_right_ml,
        "air_left_ml": air_left_ml,
        "self_contact": self_contact,
        "rigid_parts": rigid_parts,
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
    options: dict[str, Any] = {"settings": settings, "progress": _print_row, "overwrite": overwrite}
    goal = f"until {settings.until} = {settings.target:g}"
    if part is not None:
        from tubefoot.fea.solve_part import solve_part

        directory = out or Path("out") / part.name
        print(f"{part.name}: {part.mesh}, {goal}")
        result = solve_part(part, directory, **options)
    else:
        from tubefoot.fea.solve import solve_design

        assert design is not None
        finger = load_design(design)
        directory = out or Path("out") / finger.name
        if grasp is not None:
            _solve_grasp(finger, grasp, directory, options, pictures)
            return
        print(f"{finger.name}: {finger.bellows.units} units, {goal}")
        result = solve_design(finger, directory, **options)
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


def _solve_grasp(
    finger: FingerDesign, grasp: Path, directory: Path, options: dict[str, Any], pictures: bool
) -> None:
    """Solve a grasp, say what came out and draw it."""
    from tubefoot.config import load_settings
    from tubefoot.fea.grasp_settings import GraspSettings
    from tubefoot.fea.grasp_solve import solve_grasp

    settings = load_settings(grasp, GraspSettings)
    thing = settings.object
    print(f"{finger.name}: {finger.bellows.units} units grasp {thing.name} at {settings.height_mm:g} mm")
    found = solve_grasp(finger, directory, settings, **{**options, "progress": _print_grasp}).summary
    print(f"ended: {found['end_reason']}")
    print(
        f"one finger presses with {found['normal_force_n']:.3f} N on {found['patch_mm2']:.1f} mm2, "
        f"{found['pressure_mean_kpa']:.2f} kPa in the mean; theta1 {found['theta1_deg']:.2f} deg, "
        f"theta2 {found['theta2_deg']:.2f} deg"
    )
    if found["damage_margin"] is not None:
        print(f"bound over load ({found['damage_margin_by']}): {found['damage_margin']:.2f}")
    if pictures:
        from tubefoot.report.grasp_contact import draw_grasp_pictures

        for path in draw_grasp_pictures(directory):
            print(f"picture: {path}")
    print(f"results: {directory}")


def _print_grasp(row: dict[str, Any]) -> None:
    print(
        f"  state {row['step']:3d}: pumped {row['pumped_volume_ml']:7.4f} ml, right "
        f"{row['pressure_right_kpa']:6.2f} kPa, theta1 {row['theta1_deg']:6.2f}, theta2 "
        f"{row['theta2_deg']:6.2f} deg, force {row['normal_force_n']:7.4f} N, patch {row['patch_mm2']:6.1f} "
        f"mm2, {row['newton_iterations']} iterations, {row['wall_s']:.1f} s",
        flush=True,
    )


def _part(design: Path | None, mesh: Path | None, solid: Path | None) -> SolidPart | None:
    """The part to solve, None where a design says it all.

    Raises ConfigError where nothing, or too much, is named.
    """
    if solid is not None:
        if design is not None or mesh is not None:
            raise ConfigError("--solid names the mesh and the material; leave the design and --mesh out")
        from tubefoot.fea.solid_part import load_part

        return load_part(solid)
    if mesh is not None:
        from tubefoot.design.finger import load_design
        from tubefoot.fea.solid_part import SolidPart

        part = SolidPart(name=mesh.stem, mesh=str(mesh))
        return part if design is None else part.model_copy(update={"body": load_design(design).body})
    if design is None:
        raise ConfigError(
            "nothing to solve: name a design file (`tubefoot new NAME` writes one), --mesh FILE "
            "or --solid FILE"
        )
    return None


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
    moment = f"{row['time_s']:9.4g} s, " if row.get("time_s") is not None else ""
    print(
        f"  state {row['step']:3d}: {moment}pumped {row['pumped_volume_ml']:7.4f} ml, "
        f"right {row['pressure_right_kpa']:7.2f} kPa, left {row['pressure_left_kpa']:7.2f} kPa, "
        f"bend {row['bend_deg']:6.2f} deg, {row['newton_iterations']} iterations, {row['wall_s']:.1f} s",
        flush=True,
    )
