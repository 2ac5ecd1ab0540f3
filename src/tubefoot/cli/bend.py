"""`tubefoot bend`: closed-loop bending to an angle, back, or along a trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tubefoot.cli.bench import recording_path, rig_settings

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from tubefoot.cli.bend_stage import Stage
    from tubefoot.control.loop import Motion
    from tubefoot.twin.bench_settings import BenchSettings

ControllerName = Literal["paper", "adaptive", "tracking"]


def bend(
    target_deg: Annotated[float | None, Parameter(help="bend angle; left out with --trajectory")] = None,
    /,
    *,
    sim: Annotated[bool, Parameter(help="the virtual bench instead of a port", negative="")] = False,
    seed: Annotated[int, Parameter(help="of what is random on the virtual bench")] = 0,
    controller: Annotated[
        ControllerName | None, Parameter(help="adaptive for a target, tracking for a trajectory")
    ] = None,
    back: Annotated[bool, Parameter(name="--return", help="then back to 0 deg", negative="")] = False,
    trajectory: Annotated[Path | None, Parameter(help="CSV: time_s, bend_deg")] = None,
    settings: Annotated[Path | None, Parameter(help="TOML: controllers, goal, guard")] = None,
    rig_file: Annotated[Path | None, Parameter(name="--rig", help="rig file (TOML)")] = None,
    port: Annotated[str | None, Parameter(help="serial port, e.g. /dev/ttyACM0")] = None,
    source: Annotated[str, Parameter(help="webcam: number or device")] = "0",
    camera: Annotated[Path | None, Parameter(help="camera.toml from `tubefoot calibrate-camera`")] = None,
    layout: Annotated[Path | None, Parameter(help="marker layout (TOML)")] = None,
    model: Annotated[
        Path | None, Parameter(help="finger from `tubefoot reduce`; the 12-unit reference if not given")
    ] = None,
    bench: Annotated[Path | None, Parameter(help="TOML of the virtual bench; nominal if not given")] = None,
    population: Annotated[
        int | None, Parameter(help="the virtual bench of the population drawn by this seed")
    ] = None,
    quick: Annotated[
        bool,
        Parameter(help="virtual bench without pixels, firmware core on this computer", negative=""),
    ] = False,
    real_time: Annotated[bool, Parameter(help="virtual bench at the wall clock's pace", negative="")] = False,
    out: Annotated[Path, Parameter(help="directory for the results")] = Path("out/bend"),
) -> None:
    """Bend the finger to an angle in closed loop; Ctrl-C stops the pump and keeps the record.

    Writes bend.csv (one row a frame), bend.png, summary.json, bench.mcap, run.toml.

    Example: tubefoot bend 30 --sim --return
    """
    from tubefoot.errors import ConfigError

    if (target_deg is None) == (trajectory is None):
        raise ConfigError("give a target in degrees or --trajectory FILE, one of them")
    name = controller or ("tracking" if trajectory else "adaptive")
    if (name == "tracking") != (trajectory is not None):
        raise ConfigError(f"--controller {name}: tracking goes with --trajectory, the others with a target")
    if back and trajectory is not None:
        raise ConfigError("--return goes with a target; let the trajectory itself end at 0 deg")
    if not sim and camera is None:
        raise ConfigError(
            "--camera is missing: name the camera.toml of `tubefoot calibrate-camera`, or use --sim"
        )
    from tubefoot.cli.bend_gauge import Gauge
    from tubefoot.cli.bend_plan import BendPlan
    from tubefoot.cli.bend_record import begin_record, finish_record, raise_for

    plan = BendPlan.made(name, target_deg, back, trajectory, settings, model)
    rig, make = rig_settings(rig_file, port), _bench(bench, population) if sim else None
    known_seed = seed if sim else None
    run = begin_record(out, plan, rig, make, known_seed, population)
    recording = recording_path(run.directory)
    stage: AbstractContextManager[Stage]
    if make is not None:
        from tubefoot.cli.bend_stage import virtual_stage

        stage = virtual_stage(rig, recording, seed, make, quick, real_time)
    else:
        from tubefoot.cli.bend_stage import real_stage

        assert camera is not None
        stage = real_stage(rig, recording, source, camera, layout)
    motions: list[Motion] = []
    gauge = Gauge()
    with stage as opened:
        plan.carry_out(opened, rig, motions, gauge.show)
    gauge.close()
    _show(finish_record(run, plan, motions, rig, known_seed))
    print(f"results: {run.directory}")
    raise_for(motions[-1])


def _show(summary: dict[str, Any]) -> None:
    """Print the figures, those of the way back after the others."""
    back = summary.get("return", {})
    for prefix, figures in (("", summary), ("return ", back)):
        for key, value in figures.items():
            if not isinstance(value, dict):
                text = f"{value:.4g}" if isinstance(value, float) else str(value)
                print(f"{prefix}{key:<{22 - len(prefix)}} {text}")


def _bench(path: Path | None, population: int | None) -> BenchSettings:
    """The virtual bench of a file, of the population, or the nominal one."""
    from tubefoot.config import load_settings
    from tubefoot.errors import ConfigError
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.twin.population import drawn_bench

    if path is not None and population is not None:
        raise ConfigError("give --bench FILE or --population SEED, not both")
    if population is not None:
        return drawn_bench(population)
    return load_settings(path, BenchSettings) if path else BenchSettings()
