"""`tubefoot grasp`: the grasp protocol on the bench, or on the virtual gripper."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tubefoot.cli.bench import rig_settings
from tubefoot.cli.grasp_record import carry_out

if TYPE_CHECKING:
    from tubefoot.cli.grasp_stage import VirtualGrasp
    from tubefoot.control.grasp_settings import GraspSettings
    from tubefoot.lab.grasp_object import GraspObject, Pose
    from tubefoot.lab.settings import RigSettings


def grasp(
    what: Annotated[str, Parameter(help="tofu, blueberry, or the TOML file of an object")],
    /,
    *,
    pose: Annotated[
        Literal["front", "side"], Parameter(help="which width lies between the fingers")
    ] = "front",
    sim: Annotated[bool, Parameter(help="the virtual gripper instead of ports", negative="")] = False,
    seed: Annotated[int, Parameter(help="of what is random on the virtual gripper")] = 0,
    settings: Annotated[Path | None, Parameter(help="TOML: pulses, contact, grip, test")] = None,
    rig_file: Annotated[
        list[Path] | None,
        Parameter(
            name="--rig", help="rig file (TOML) of the right finger; again for the left one", negative=""
        ),
    ] = None,
    port: Annotated[
        list[str] | None,
        Parameter(help="serial port of the right finger's rig; again for the left one's", negative=""),
    ] = None,
    source: Annotated[
        list[str] | None, Parameter(help="webcam that sees both fingers; again for one each", negative="")
    ] = None,
    camera: Annotated[
        list[Path] | None,
        Parameter(help="camera.toml of the right finger, and again of the left one", negative=""),
    ] = None,
    layout: Annotated[Path | None, Parameter(help="marker layout (TOML)")] = None,
    bench: Annotated[Path | None, Parameter(help="TOML of the virtual benches; nominal if not given")] = None,
    population: Annotated[
        int | None, Parameter(help="virtual benches of the population drawn by this seed and the next")
    ] = None,
    gripper: Annotated[Path | None, Parameter(help="TOML of the virtual gripper: gap, pumps, tilt")] = None,
    friction: Annotated[
        float | None, Parameter(help="of the virtual object on the fingers; that of its file if not given")
    ] = None,
    error_mm: Annotated[
        tuple[float, float, float], Parameter(help="of the virtual object's placement along x, y, z")
    ] = (0.0, 0.0, 0.0),
    quick: Annotated[
        bool, Parameter(help="virtual gripper without pixels, firmware core on this computer", negative="")
    ] = False,
    map_: Annotated[
        bool, Parameter(name="--map", help="no grasp: both angles over grip level, size, place", negative="")
    ] = False,
    out: Annotated[Path, Parameter(help="directory for the results")] = Path("out/grasp"),
) -> None:
    """Grasp an object gently: open, place, close to first contact, grip, hold, lift, shake, let go.

    Writes grasp.csv (one row a frame), strip.png, angles.png, forces.png, grasp.avi, summary.json,
    bench.mcap, run.toml.

    Example: tubefoot grasp blueberry --pose front --sim --quick
    """
    from tubefoot.cli.grasp_record import raise_for, tell
    from tubefoot.config import load_settings
    from tubefoot.control.grasp_settings import GraspSettings
    from tubefoot.lab.grasp_object import load_object

    chosen = load_settings(settings, GraspSettings) if settings else GraspSettings()
    thing = load_object(what)
    if map_:
        from tubefoot.cli.grasp_map import write_map

        write_map(thing, out)
        return
    rigs = _rigs(rig_file or [], port or [])
    if sim:
        mu = thing.friction if friction is None else friction
        virtual = _virtual(seed, bench, population, gripper, mu, error_mm, quick, chosen)
        summary = simulated_grasp(thing, pose, chosen, rigs[0], virtual, out)
    else:
        summary = _real(thing, pose, chosen, rigs, source or ["0"], camera or [], layout, out)
    tell(summary)
    print(f"results: {out}")
    raise_for(summary["end_reason"])


def simulated_grasp(
    thing: GraspObject,
    pose: Pose,
    settings: GraspSettings,
    rig: RigSettings,
    virtual: VirtualGrasp,
    out: Path,
    say: Callable[[str], None] = print,
) -> dict[str, Any]:
    """The summary of a grasp on the virtual gripper, whose record is in `out`.

    thing : the object; pose : front or side; settings : of the grasp; rig : of the rigs
    virtual : what is simulated; out : directory; say : told of each phase
    """
    from tubefoot.cli.grasp_stage import virtual_grasp
    from tubefoot.records import Run

    resolved = _resolved(thing, pose, settings, [rig], virtual)
    run = Run(out, "grasp", resolved, seed=virtual.seed)
    recordings = _recordings(run.directory, virtual.make.pumps)
    stage = virtual_grasp(thing, pose, settings, rig, virtual, recordings)
    return carry_out(run, stage, thing, pose, settings, virtual.make.pumps == 1, virtual.seed, say)


def _real(
    thing: GraspObject,
    pose: Pose,
    settings: GraspSettings,
    rigs: list[RigSettings],
    sources: list[str],
    cameras: list[Path],
    layout: Path | None,
    out: Path,
) -> dict[str, Any]:
    """The summary of a grasp on the bench."""
    from tubefoot.cli.grasp_stage import real_grasp
    from tubefoot.control.placing import placing_height
    from tubefoot.errors import ConfigError
    from tubefoot.records import Run
    from tubefoot.reduced.files import reference_file

    if len(cameras) != 2:
        raise ConfigError(
            "--camera is needed twice: the camera.toml of the right and of the left finger, from `tubefoot "
            "calibrate-camera`; or use --sim"
        )
    if len(sources) > 2:
        raise ConfigError(f"{len(sources)} sources: give one for each finger, or one that sees both")
    run = Run(out, "grasp", _resolved(thing, pose, settings, rigs, None))
    recordings = _recordings(run.directory, len(rigs))
    height = placing_height(thing, pose, settings, reference_file().to_finger().length)
    stage = real_grasp(rigs, sources, cameras, layout, recordings, height)
    return carry_out(run, stage, thing, pose, settings, len(rigs) == 1, None, print)


def _rigs(files: list[Path], ports: list[str]) -> list[RigSettings]:
    """Settings of the right and the left finger's rig, or of one for both."""
    from tubefoot.errors import ConfigError

    count = max(len(files), len(ports), 1)
    if count > 2:
        raise ConfigError(
            f"{len(ports)} ports and {len(files)} rig files: give one for each finger, or one for both "
            "through a splitter"
        )
    rigs = [
        rig_settings(
            files[min(number, len(files) - 1)] if files else None,
            ports[number] if number < len(ports) else None,
        )
        for number in range(count)
    ]
    if count == 2 and rigs[0].board.port == rigs[1].board.port:
        raise ConfigError(f"both rigs are on {rigs[0].board.port}; give --port twice, or two rig files")
    return rigs


def _virtual(
    seed: int,
    bench: Path | None,
    population: int | None,
    gripper: Path | None,
    friction: float,
    error_mm: tuple[float, float, float],
    quick: bool,
    settings: GraspSettings,
) -> VirtualGrasp:
    """What is simulated; its gap between the fingers must be the protocol's."""
    from tubefoot.cli.grasp_stage import VirtualGrasp
    from tubefoot.config import load_settings
    from tubefoot.errors import ConfigError
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.twin.gripper_scene import GripperMake
    from tubefoot.twin.population import drawn_bench

    if bench is not None and population is not None:
        raise ConfigError("give --bench FILE or --population SEED, not both")
    make = load_settings(gripper, GripperMake) if gripper else GripperMake(finger_gap_mm=settings.gap_mm)
    if make.finger_gap_mm != settings.gap_mm:
        raise ConfigError(
            f"the virtual gripper's finger_gap_mm is {make.finger_gap_mm:g}, but gap_mm of the grasp "
            f"settings is {settings.gap_mm:g}; make them equal"
        )
    if not 0.0 < friction <= 3.0:
        raise ConfigError(f"friction {friction:g}: allowed are values above 0 up to 3")
    if population is not None:
        both = (drawn_bench(population), drawn_bench(population + 1))
    else:
        one = load_settings(bench, BenchSettings) if bench else BenchSettings()
        both = (one, one)
    return VirtualGrasp(both, make, friction, error_mm, seed, quick)


def _recordings(directory: Path, count: int) -> list[Path]:
    """Names for the rigs' recordings that are not taken."""
    names = ["bench"] if count == 1 else ["bench-right", "bench-left"]
    found = []
    for name in names:
        path, number = directory / f"{name}.mcap", 1
        while path.exists():
            number += 1
            path = directory / f"{name}-{number}.mcap"
        found.append(path)
    return found


def _resolved(
    thing: GraspObject,
    pose: Pose,
    settings: GraspSettings,
    rigs: list[RigSettings],
    virtual: VirtualGrasp | None,
) -> dict[str, Any]:
    resolved: dict[str, Any] = {
        "sim": virtual is not None,
        "object": thing.model_dump(mode="json", exclude_none=True),
        "pose": pose,
        "grasp": settings.model_dump(mode="json"),
        "rig": rigs[0].model_dump(mode="json"),
        "ports": [rig.board.port for rig in rigs],
    }
    if virtual is not None:
        resolved |= {
            "gripper": virtual.make.model_dump(mode="json"),
            "friction": virtual.friction,
            "error_mm": list(virtual.error),
            "quick": virtual.quick,
            "bench_right": virtual.benches[0].model_dump(mode="json"),
            "bench_left": virtual.benches[1].model_dump(mode="json"),
        }
    return resolved
