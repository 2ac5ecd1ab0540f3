"""`tubefoot rig ...`: the bench, real or simulated."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from tubefoot.cli.bench import Bench, open_bench, recording_path, rig_settings
from tubefoot.cli.campaign import NO_OPTIONS, CampaignOptions, run_campaign

if TYPE_CHECKING:
    from tubefoot.lab.settings import RigSettings
    from tubefoot.records import Run

rig_app = App(name="rig", help="The bench: check, calibrate, pulse, monitor, record, flash.")

Port = Annotated[
    str | None, Parameter(help="serial port, e.g. /dev/ttyACM0; that of the rig file if not given")
]
Sim = Annotated[
    bool, Parameter(help="the virtual bench with the real firmware, instead of a port", negative="")
]
RigFile = Annotated[Path | None, Parameter(name="--rig", help="rig file (TOML); defaults if not given")]
Out = Annotated[Path, Parameter(help="directory for the results")]
Seed = Annotated[int, Parameter(help="seed of the virtual bench's noise")]


@rig_app.command
def check(
    *,
    port: Port = None,
    sim: Sim = False,
    rig_file: RigFile = None,
    pump: Annotated[bool, Parameter(help="run the pump for 0.2 s each way")] = True,
    seed: Seed = 0,
    out: Out = Path("out/rig-check"),
) -> None:
    """Ask the bench whether it is fit to work: link, samples, supply, sensors, pump.

    Example: tubefoot rig check --sim
    """
    from tubefoot.errors import LinkError
    from tubefoot.lab.check import check_rig
    from tubefoot.records import write_json, write_table

    settings = rig_settings(rig_file, port)
    run = _run(out, "rig check", settings, sim, seed)
    with open_bench(settings, sim, seed=seed) as bench:
        checks = check_rig(bench.rig, pump, _say)
    rows = [
        {"check": c.name, "value": c.value, "limit": c.limit, "passed": c.passed, "advice": c.advice}
        for c in checks
    ]
    for row in rows:
        mark = "pass" if row["passed"] else "FAIL"
        print(f"{mark}  {row['check']:<15} {row['value']:<38} ({row['limit']})")
        if not row["passed"]:
            print(f"      -> {row['advice']}")
    write_table(run.path("check.csv"), rows)
    failed = [c.name for c in checks if not c.passed]
    write_json(run.path("summary.json"), {"passed": not failed, "checks": rows})
    _finish(run)
    if failed:
        raise LinkError(f"the bench is not fit to work: {', '.join(failed)}")


@rig_app.command
def calibrate(
    what: Annotated[Literal["pressure", "supply", "pump"], Parameter(help="what is calibrated")],
    /,
    *,
    port: Port = None,
    sim: Sim = False,
    rig_file: RigFile = None,
    seed: Seed = 0,
    out: Out = Path("out/rig-calibrate"),
) -> None:
    """Calibrate the pressure sensors, the supply's influence on them, or the pump, step by step.

    Writes the readings and a new rig file, to be used with --rig. Do pressure first, then supply, then pump.

    Example: tubefoot rig calibrate pump --sim
    """
    import tomli_w

    from tubefoot.lab.rig_calibrations import CALIBRATIONS
    from tubefoot.records import write_table, write_whole

    settings = rig_settings(rig_file, port)
    run = _run(out, f"rig calibrate {what}", settings, sim, seed)
    with open_bench(settings, sim, recording_path(run.directory), seed) as bench:
        rows, calibrated = CALIBRATIONS[what](bench.rig, bench.operator, settings, _say)
    write_table(run.path(f"{what}.csv"), rows)
    write_whole(run.path("rig.toml"), tomli_w.dumps(calibrated.model_dump(mode="json")))
    print(f"use it: --rig {run.path('rig.toml')}")
    _finish(run)


@rig_app.command
def pulse(
    direction: Annotated[
        Literal["forward", "reverse"], Parameter(help="forward presses into the right chamber")
    ],
    /,
    *,
    duty: Annotated[float, Parameter(help="share of full speed, 0 to 1")] = 0.8,
    duration_s: Annotated[float, Parameter(help="how long the pump runs [s]")] = 0.5,
    settle_s: Annotated[float, Parameter(help="wait before the pressures are read [s]")] = 0.5,
    port: Port = None,
    sim: Sim = False,
    rig_file: RigFile = None,
    seed: Seed = 0,
    out: Out = Path("out/rig-pulse"),
) -> None:
    """Run the pump once and tell what the pressures did; forward presses into the right chamber.

    Example: tubefoot rig pulse forward --duty 0.8 --duration-s 0.5 --sim
    """
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.records import write_json
    from tubefoot.units import KPA, ML

    settings = rig_settings(rig_file, port)
    _demand_within(duty, settings.limits.duty_max, "duty", "", "limits.duty_max")
    _demand_within(duration_s, settings.limits.pulse_max_s, "duration", " s", "limits.pulse_max_s")
    run = _run(out, "rig pulse", settings, sim, seed, duty=duty, duration_s=duration_s, direction=direction)
    with open_bench(settings, sim, recording_path(run.directory), seed) as bench:
        rig = bench.rig
        measure_neutral(rig)
        sent = rig.pulse(1 if direction == "forward" else -1, duty, duration_s)
        rig.wait(sent.duration + settle_s)
        ended, reading = rig.last_pulse, rig.read()
    summary: dict[str, Any] = {
        "sent_direction": sent.direction,
        "sent_duty": sent.duty,
        "sent_duration_s": sent.duration,
        "expected_volume_ml": sent.volume / ML,
        "expected_volume_sigma_ml": sent.volume_sigma / ML,
        "ran_s": ended.duration if ended else None,
        "end_reason": ended.reason.name.lower() if ended else "running",
        "pressure_right_kpa": reading.pressures[0] / KPA,
        "pressure_left_kpa": reading.pressures[1] / KPA,
        "faults": int(reading.faults),
    }
    for key, value in summary.items():
        print(f"{key:<26} {value:.4g}" if isinstance(value, float) else f"{key:<26} {value}")
    write_json(run.path("summary.json"), summary)
    _finish(run)


@rig_app.command
def monitor(
    *,
    seconds: Annotated[float | None, Parameter(help="how long; until Ctrl-C if not given")] = None,
    port: Port = None,
    sim: Sim = False,
    rig_file: RigFile = None,
    seed: Seed = 0,
) -> None:
    """Show pressures, supply and faults, five times a second; reconnects when the cable was pulled.

    Example: tubefoot rig monitor --sim --seconds 3
    """
    settings = rig_settings(rig_file, port)
    with open_bench(settings, sim, seed=seed, real_time=True) as bench:
        _watch(bench, seconds, interval=0.2)


@rig_app.command
def record(
    *,
    seconds: Annotated[float | None, Parameter(help="how long; until Ctrl-C, or the end of --pulses")] = None,
    pulses: Annotated[
        Path | None, Parameter(help="CSV of pulses: time_s, direction (1 or -1), duty, duration_s")
    ] = None,
    campaign: Annotated[
        Path | None,
        Parameter(help="TOML of a campaign: loading, unloading, reversal, holds, repeats; resumable"),
    ] = None,
    options: Annotated[CampaignOptions, Parameter(name="*")] = NO_OPTIONS,
    port: Port = None,
    sim: Sim = False,
    rig_file: RigFile = None,
    seed: Seed = 0,
    out: Out = Path("out/rig-record"),
) -> None:
    """Record everything that happens on the bench into one MCAP file; run a list of pulses, or a campaign.

    Example: tubefoot rig record --sim --seconds 3

    Example: tubefoot rig record --campaign examples/campaigns/short.toml --sim --quick --units 3

    options : of a campaign
    """
    from tubefoot.errors import ConfigError

    if campaign is not None:
        _demand_alone(seconds, pulses)
        run_campaign(campaign, options, rig_settings(rig_file, port), seed if sim else None, out)
        return
    if options != NO_OPTIONS:
        raise ConfigError("--units, --camera, --bench, --quick and their like go with --campaign")
    from tubefoot.lab.program import load_program, play
    from tubefoot.lab.sensing import measure_neutral

    settings = rig_settings(rig_file, port)
    program = load_program(pulses) if pulses else []
    run = _run(out, "rig record", settings, sim, seed, seconds=seconds, pulses=pulses)
    recording = recording_path(run.directory)
    try:
        with open_bench(settings, sim, recording, seed) as bench:
            measure_neutral(bench.rig)
            if program:
                play(bench.rig, program, _say)
            if seconds is not None or not program:
                _watch(bench, seconds, interval=1.0)
    finally:
        print(f"recording: {recording}")
        print(f"to pandas: Recording({str(recording)!r}).samples   # from tubefoot.lab.recording")
        _finish(run)


@rig_app.command
def repair(recording: Annotated[Path, Parameter(help="MCAP file")], /) -> None:
    """Give a recording whose program was killed its index, so that every viewer opens it.

    Example: tubefoot rig repair out/rig-record/bench.mcap
    """
    from tubefoot.lab.recording import repair_recording

    done = repair_recording(recording)
    print(f"{recording}: {'repaired' if done else 'was whole, nothing to do'}")


@rig_app.command
def flash(*, port: Port = None, rig_file: RigFile = None) -> None:
    """Build the firmware if needed and write it to the board with avrdude.

    Example: tubefoot rig flash --port /dev/ttyACM0
    """
    from tubefoot.lab.flashing import flash as flash_board
    from tubefoot.twin.firmware import built

    name = rig_settings(rig_file, port).board.port
    flash_board(name, built("board.hex"))
    print(f"{name}: flashed and verified; next: tubefoot rig check --port {name}")


def _watch(bench: Bench, seconds: float | None, interval: float) -> None:
    """Print a line every interval, reconnecting as needed, until time is up or Ctrl-C."""
    from tubefoot.errors import LinkError
    from tubefoot.lab.rig import fault_names
    from tubefoot.units import KPA

    rig, start = bench.rig, bench.rig.clock.now()
    print("  time_s  " + "  ".join(f"{name:>9}" for name in _branches(bench)) + "  supply_v  faults")
    try:
        while seconds is None or rig.clock.now() - start < seconds - 1e-6:
            try:
                rig.wait(interval)
                reading = rig.read()
            except LinkError as error:
                print(f"{error}; trying again", file=sys.stderr)
                _reconnect(bench)
                continue
            values = "  ".join(f"{pressure / KPA:9.2f}" for pressure in reading.pressures)
            passed = rig.clock.now() - start
            print(
                f"{passed:8.2f}  {values}  {reading.supply:8.3f}  {fault_names(reading.faults)}", flush=True
            )
    except KeyboardInterrupt:
        print("stopped")


def _reconnect(bench: Bench) -> None:
    """Try until the bench is back; Ctrl-C gives up."""
    from tubefoot.errors import LinkError

    while True:
        try:
            bench.rig.connect()
            return
        except LinkError:
            bench.rig.clock.sleep(1.0)


def _branches(bench: Bench) -> list[str]:
    from tubefoot.lab.settings import BRANCHES

    return [f"{branch}_kpa" for branch in BRANCHES[: bench.rig.limits.channels]]


def _run(out: Path, verb: str, settings: RigSettings, sim: bool, seed: int, **extra: Any) -> Run:
    from tubefoot.records import Run

    resolved = {"sim": sim, "rig": settings.model_dump(mode="json"), **extra}
    return Run(out, verb, resolved, seed=seed if sim else None)


def _finish(run: Run) -> None:
    run.finish()
    print(f"results: {run.directory}")


def _demand_alone(seconds: float | None, pulses: Path | None) -> None:
    from tubefoot.errors import ConfigError

    if seconds is not None or pulses is not None:
        raise ConfigError(
            "--campaign says itself what is pumped and how long; leave --seconds and --pulses out"
        )


def _demand_within(value: float, limit: float, name: str, unit: str, key: str) -> None:
    from tubefoot.errors import ConfigError

    if not 0 < value <= limit:
        raise ConfigError(
            f"{name} {value:g}{unit} is outside 0 to {limit:g}{unit}, the limit of this rig; "
            f"edit {key} in the rig file"
        )


def _say(text: str) -> None:
    print(text, flush=True)
