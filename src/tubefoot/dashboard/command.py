"""`tubefoot dashboard`: the live bench, or a recording, in the browser."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from tubefoot.dashboard.benches import Bench
    from tubefoot.dashboard.desk import Showing
    from tubefoot.dashboard.eye import Shown
    from tubefoot.dashboard.motions import FingerPlans
    from tubefoot.design.finger import FingerDesign
    from tubefoot.lab.settings import RigSettings

Opening = Callable[["Shown"], "AbstractContextManager[Bench]"]
HTTP_PORT = 8321


def dashboard(
    *,
    sim: Annotated[bool, Parameter(help="the virtual bench instead of a port", negative="")] = False,
    port: Annotated[str | None, Parameter(help="serial port, e.g. /dev/ttyACM0")] = None,
    replay: Annotated[Path | None, Parameter(help="a recording (.mcap) instead of a bench")] = None,
    source: Annotated[str, Parameter(help="webcam: number or device")] = "0",
    camera: Annotated[
        Path | None,
        Parameter(help="camera.toml from `tubefoot calibrate-camera`; without it no closed loop"),
    ] = None,
    layout: Annotated[Path | None, Parameter(help="marker layout (TOML)")] = None,
    rig_file: Annotated[Path | None, Parameter(name="--rig", help="rig file (TOML)")] = None,
    model: Annotated[
        Path | None, Parameter(help="finger from `tubefoot reduce`; the 12-unit reference if not given")
    ] = None,
    design: Annotated[
        Path | None, Parameter(help="design file, for the 3D view; the 12-unit reference if not given")
    ] = None,
    settings: Annotated[Path | None, Parameter(help="TOML: controllers, goal, guard")] = None,
    bench: Annotated[Path | None, Parameter(help="TOML of the virtual bench; nominal if not given")] = None,
    board: Annotated[
        Literal["native", "simavr"],
        Parameter(help="of the virtual bench: the firmware's core on this computer, or its binary"),
    ] = "native",
    quick: Annotated[
        bool, Parameter(help="virtual bench without camera pictures, for slow computers", negative="")
    ] = False,
    seed: Annotated[int, Parameter(help="of what is random on the virtual bench")] = 0,
    heartbeat_s: Annotated[
        float, Parameter(help="a closed page stops what it started after so long [s]")
    ] = 2.0,
    host: Annotated[str, Parameter(help="loopback address to listen on")] = "127.0.0.1",
    http_port: Annotated[
        int, Parameter(help="of the page; the emergency stop takes the next one")
    ] = HTTP_PORT,
    open_page: Annotated[bool, Parameter(name="--open", help="open it in the browser", negative="")] = False,
    out: Annotated[Path, Parameter(help="directory for recordings, traces and the token")] = Path(
        "out/dashboard"
    ),
) -> None:
    """Show the bench in the browser: camera, pressures, angle, controllers, emergency stop; until Ctrl-C.

    The bench must stand with its finger straight and at rest when this begins.

    Example: tubefoot dashboard --sim
    """
    from tubefoot.dashboard.access import Access, kept_token, loopback
    from tubefoot.dashboard.finger_model import finger_model
    from tubefoot.dashboard.serving import Dashboard
    from tubefoot.errors import ConfigError
    from tubefoot.records import Run

    if sum((sim, port is not None, replay is not None)) > 1:
        raise ConfigError("give one of --sim, --port and --replay")
    if not 0.5 <= heartbeat_s <= 60:
        raise ConfigError(f"--heartbeat-s {heartbeat_s:g}: choose 0.5 to 60 s")
    if not 1 <= http_port <= 65534:
        raise ConfigError(f"--http-port {http_port}: choose 1 to 65534")
    host = loopback(host)
    rig = _rig(rig_file, port)
    plans = _plans(model, settings)
    opening: Opening | None = None
    if sim:
        opening = _virtual(rig, seed, bench, board, not quick)
    elif replay is None:
        opening = _real(rig, source, camera, layout)
    kept = {"sim": sim, "replay": replay, "rig": rig.model_dump(mode="json"), "heartbeat_s": heartbeat_s}
    run = Run(out, "dashboard", kept, seed=seed if sim else None)
    showing = _player(replay, camera, layout) if replay else _desk(opening, out, plans, heartbeat_s)
    mode = "replay" if replay else "live"
    access = Access(kept_token(out))
    shown = Dashboard(showing, access, finger_model(_design(design)), mode, host, http_port)
    try:
        showing.start()
        print(f"dashboard: {shown.address}\nCtrl-C ends it; the pump then stands.", flush=True)
        if open_page:
            _browse(shown.address)
        shown.serve()
    finally:
        shown.close()
        run.finish()
        print(f"results: {run.directory}")


def _desk(opening: Opening | None, out: Path, plans: FingerPlans, heartbeat_s: float) -> Showing:
    from tubefoot.dashboard.desk import Desk
    from tubefoot.dashboard.feed import Feed
    from tubefoot.dashboard.helm import Helm
    from tubefoot.dashboard.logbook import Logbook
    from tubefoot.dashboard.session import Session

    assert opening is not None
    return Desk(Session(opening, Feed(), Helm(heartbeat_s), Logbook(out), plans))


def _virtual(rig: RigSettings, seed: int, path: Path | None, board: Any, pixels: bool) -> Opening:
    from tubefoot.config import load_settings
    from tubefoot.dashboard.benches import virtual_bench
    from tubefoot.twin.bench import VirtualBench
    from tubefoot.twin.bench_settings import BenchSettings

    make = load_settings(path, BenchSettings) if path else BenchSettings()

    def opening(show: Shown) -> AbstractContextManager[Bench]:
        virtual = VirtualBench(make, seed, board, rig_settings=rig, real_time=True)
        return virtual_bench(virtual, rig, show, pixels)

    return opening


def _real(rig: RigSettings, source: str, camera: Path | None, layout: Path | None) -> Opening:
    from tubefoot.dashboard.benches import real_bench

    return lambda show: real_bench(rig, show, source, camera, layout)


def _player(replay: Path, camera: Path | None, layout: Path | None) -> Showing:
    from tubefoot.dashboard.player import Player
    from tubefoot.lab.recording import Recording
    from tubefoot.vision.layout import chosen_layout

    beside, markers = replay.with_name("camera.toml"), replay.with_name("layout.toml")
    known = camera or (beside if beside.exists() else None)
    chosen = layout or (markers if markers.exists() else None)
    return Player(Recording(replay), known, chosen_layout(chosen))


def _plans(model: Path | None, path: Path | None) -> FingerPlans:
    from tubefoot.config import load_settings
    from tubefoot.control.creep import creep_law
    from tubefoot.control.settings import BendSettings
    from tubefoot.dashboard.motions import FingerPlans
    from tubefoot.reduced.files import read_reduced, reference_file

    content = read_reduced(model) if model else reference_file()
    finger = content.to_finger()
    settings = load_settings(path, BendSettings) if path else BendSettings()
    largest = finger.n_units * finger.valid.angle
    return FingerPlans(creep_law(finger, content.to_prony()), settings, largest)


def _rig(rig_file: Path | None, port: str | None) -> RigSettings:
    from tubefoot.config import load_settings
    from tubefoot.lab.settings import RigSettings

    settings = load_settings(rig_file, RigSettings) if rig_file else RigSettings()
    return settings.on_port(port) if port else settings


def _design(path: Path | None) -> FingerDesign:
    from tubefoot.design.finger import FingerDesign, load_design

    return load_design(path) if path else FingerDesign().with_bellows(units=12)


def _browse(address: str) -> None:
    import webbrowser

    webbrowser.open(address)
