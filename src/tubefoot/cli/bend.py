"""`tubefoot bend`: closed-loop bending to an angle, back, or along a trajectory."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tubefoot.cli.bench import recording_path, rig_settings

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from tubefoot.cli.bend_stage import Stage
    from tubefoot.control.creep import CreepLaw
    from tubefoot.control.loop import Motion
    from tubefoot.control.settings import BendSettings
    from tubefoot.control.trajectory import Trajectory
    from tubefoot.lab.settings import RigSettings
    from tubefoot.records import Run

ControllerName = Literal["paper", "adaptive", "tracking"]
GAUGE_S = 0.2
GAUGE_WIDTH = 41


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
    plan = _Plan.made(name, target_deg, back, trajectory, settings, model)
    rig = rig_settings(rig_file, port)
    run = _begin(out, plan, rig, sim, seed, bench, population)
    recording = recording_path(run.directory)
    stage: AbstractContextManager[Stage]
    if sim:
        from tubefoot.cli.bend_stage import virtual_stage

        stage = virtual_stage(rig, recording, seed, _bench(bench, population), quick, real_time)
    else:
        from tubefoot.cli.bend_stage import real_stage

        assert camera is not None
        stage = real_stage(rig, recording, source, camera, layout)
    motions: list[Motion] = []
    with stage as opened:
        plan.carry_out(opened, rig, motions)
    _finish(run, plan, motions, rig, seed if sim else None)


class _Plan:
    """What is to be done: which controller, where to, with which model of the finger."""

    def __init__(
        self,
        name: str,
        targets: list[float],
        trajectory: Trajectory | None,
        settings: BendSettings,
        law: CreepLaw,
        largest_deg: float,
    ):
        self.name, self.targets, self.trajectory = name, targets, trajectory
        self.settings, self.law, self.largest_deg = settings, law, largest_deg

    @classmethod
    def made(
        cls,
        name: str,
        target_deg: float | None,
        back: bool,
        trajectory: Path | None,
        settings: Path | None,
        model: Path | None,
    ) -> _Plan:
        import math

        from tubefoot.config import load_settings
        from tubefoot.control.creep import creep_law
        from tubefoot.control.settings import BendSettings
        from tubefoot.control.trajectory import load_trajectory
        from tubefoot.errors import ConfigError
        from tubefoot.reduced.files import read_reduced, reference_file
        from tubefoot.units import DEG

        content = read_reduced(model) if model else reference_file()
        finger = content.to_finger()
        largest = finger.n_units * finger.valid.angle / DEG
        followed = load_trajectory(trajectory) if trajectory else None
        most = abs(target_deg) if target_deg is not None else 0.0
        if followed is not None:
            most = float(abs(followed.bends).max()) / DEG
        if not math.isfinite(most) or most > largest:
            raise ConfigError(
                f"a bend of {most:g} deg is outside of the {largest:.0f} deg that `{finger.name}` was "
                "identified for; bend less, or give another --model"
            )
        targets = [] if target_deg is None else [target_deg, 0.0][: 2 if back else 1]
        read = load_settings(settings, BendSettings) if settings else BendSettings()
        return cls(name, targets, followed, read, creep_law(finger, content.to_prony()), largest)

    def carry_out(self, stage: Stage, rig: RigSettings, motions: list[Motion]) -> None:
        """Run the motions, each after the one before has settled."""
        from tubefoot.control.choice import step_controller, volume_foreseen
        from tubefoot.control.loop import BendLoop
        from tubefoot.control.tracking import TrackingController
        from tubefoot.units import DEG

        gauge = Gauge()
        loop = BendLoop(stage.rig, stage.angles, self.settings, stage.recorder, gauge.show, stage.further)
        if self.trajectory is not None:
            tracking = TrackingController(self.trajectory, self.law, rig.pump, self.settings.tracking)
            motions.append(loop.run(tracking, part="trajectory", timed=False))
            gauge.close()
            return
        steps = step_controller(self.name, self.law, rig, self.settings)
        foreseen = volume_foreseen(self.law, max(abs(target) for target in self.targets) * DEG)
        for target, part in zip(self.targets, ("to target", "return"), strict=False):
            steps.aim(target * DEG)
            motions.append(loop.run(steps, foreseen, part))
            gauge.close()
            if not motions[-1].settled:
                break


class Gauge:
    """The angle in the terminal: a bar that moves, or a line a second where the output is a file."""

    def __init__(self) -> None:
        self._live = sys.stdout.isatty()
        self._next = 0.0
        self._open = False

    def show(self, row: dict[str, Any]) -> None:
        """Draw a row of the trace when it is due.

        row : the newest
        """
        if row["time_s"] < self._next and row["command"] not in ("pulse", "finished"):
            return
        if not self._live and row["time_s"] < self._next:
            return
        self._next = row["time_s"] + (GAUGE_S if self._live else 1.0)
        text = gauge_line(row)
        print(f"\r\x1b[K{text}" if self._live else text, end="" if self._live else "\n", flush=True)
        self._open = self._live

    def close(self) -> None:
        """End the line; the next motion begins at 0 s."""
        if self._open:
            print()
        self._next, self._open = 0.0, False


def gauge_line(row: dict[str, Any]) -> str:
    """One line: time, angle, a bar with angle and target, pressures, pulses.

    row : of the trace
    """
    right, left = row["pressure_right_kpa"], row["pressure_left_kpa"]
    tail = f"R {right:6.1f} L {left:6.1f} kPa  pulse {row['pulses']:3d}  {row['note'][:32]}"
    if "bend_deg" not in row:
        return f"{row['time_s']:7.2f} s   blind  {'?' * GAUGE_WIDTH}  {tail}"
    reach = max(45.0, 1.2 * abs(row["target_deg"]), abs(row["bend_deg"]))
    bar = ["."] * GAUGE_WIDTH
    for value, sign in ((0.0, "|"), (row["target_deg"], "x"), (row["bend_deg"], "o")):
        bar[round((value / reach + 1.0) / 2.0 * (GAUGE_WIDTH - 1))] = sign
    return f"{row['time_s']:7.2f} s {row['bend_deg']:7.2f} deg {''.join(bar)}  {tail}"


def _bench(path: Path | None, population: int | None) -> Any:
    from tubefoot.config import load_settings
    from tubefoot.errors import ConfigError
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.twin.population import drawn_bench

    if path is not None and population is not None:
        raise ConfigError("give --bench FILE or --population SEED, not both")
    if population is not None:
        return drawn_bench(population)
    return load_settings(path, BenchSettings) if path else BenchSettings()


def _begin(
    out: Path, plan: _Plan, rig: RigSettings, sim: bool, seed: int, bench: Path | None, population: int | None
) -> Run:
    from tubefoot.records import Run

    resolved = {
        "sim": sim,
        "controller": plan.name,
        "targets_deg": plan.targets,
        "bend": plan.settings.model_dump(mode="json"),
        "rig": rig.model_dump(mode="json"),
        "population": population,
    }
    if sim:
        resolved["bench"] = _bench(bench, population).model_dump(mode="json")
    return Run(out, "bend", resolved, seed=seed if sim else None)


def _finish(run: Run, plan: _Plan, motions: list[Motion], rig: RigSettings, seed: int | None) -> None:
    """Write everything; raise what the end of the motions means."""
    from tubefoot.control.trace import COLUMNS
    from tubefoot.records import write_json, write_table
    from tubefoot.report.bending import draw_bending

    rows = [row for motion in motions for row in motion.rows]
    extra = [key for key in (rows[-1] if rows else {}) if key not in COLUMNS]
    write_table(run.path("bend.csv"), rows, [*COLUMNS, *extra])
    summary = _summary(plan, motions, rig, seed)
    write_json(run.path("summary.json"), summary)
    draw_bending(run.directory)
    run.finish()
    for key, value in summary.items():
        if not isinstance(value, dict):
            print(f"{key:<22} {value:.4g}" if isinstance(value, float) else f"{key:<22} {value}")
    for key, value in summary.get("return", {}).items():
        print(f"return {key:<15} {value:.4g}" if isinstance(value, float) else f"return {key:<15} {value}")
    print(f"results: {run.directory}")
    _raise_for(motions[-1])


def _summary(plan: _Plan, motions: list[Motion], rig: RigSettings, seed: int | None) -> dict[str, Any]:
    import numpy as np

    from tubefoot.control.trace import step_figures, tracking_figures
    from tubefoot.control.trajectory import flow_needed
    from tubefoot.units import DEG, ML

    if plan.trajectory is None:
        target = plan.targets[0]
        summary = {"target_deg": target, "controller": plan.name, "seed": seed}
        band = plan.settings.goal.band_deg
        summary |= step_figures(motions[0], target, band)
        if len(motions) > 1:
            summary["return"] = {"target_deg": 0.0, **step_figures(motions[1], 0.0, band)}
        return summary
    needed = flow_needed(plan.law, plan.trajectory, plan.settings.tracking.ahead_s)
    summary = {"target_deg": float(np.abs(plan.trajectory.bends).max()) / DEG, "controller": plan.name}
    summary |= {"seed": seed, **tracking_figures(motions[0])}
    pump = rig.pump
    flow = min(pump.forward.flow_ml_per_s, pump.reverse.flow_ml_per_s)
    most = float(np.abs(needed).max()) / ML
    summary |= {"flow_needed_ml_per_s": most, "flow_of_pump_ml_per_s": flow, "within_pump_flow": most <= flow}
    return summary


def _raise_for(motion: Motion) -> None:
    """The error that an unsettled motion stands for, for the exit code."""
    from tubefoot.errors import ConvergenceError, LinkError, SafetyStop

    if motion.settled:
        return
    if motion.reason.startswith("interrupted"):
        raise KeyboardInterrupt
    if motion.reason.startswith("link lost"):
        raise LinkError(motion.reason)
    if motion.reason.startswith(("safety stop", "board fault", "no answer", "leak", "blind")):
        raise SafetyStop(motion.reason)
    raise ConvergenceError(motion.reason)
