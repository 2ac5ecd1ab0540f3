"""`tubefoot`: verbs are imported only when they are called, so that `--help` stays quick."""

from __future__ import annotations

import sys

from cyclopts import App

from tubefoot import __version__
from tubefoot.errors import TubefootError

app = App(
    name="tubefoot",
    help="Design, simulate, print, drive and control compact hydraulic soft fingers.",
    version=f"tubefoot {__version__}",
    result_action="return_value",
)
app.command(
    "tubefoot.cli.design:new",
    name="new",
    help="Write a commented design file to start from.\n\nExample: `tubefoot new my-finger`",
)
app.command(
    "tubefoot.cli.design:check",
    name="check",
    help="Judge a design: each rule of geometry and printability, pass or fail.\n\n"
    "Example: `tubefoot check examples/designs/reference-6.toml`",
)
app.command(
    "tubefoot.cli.design:export",
    name="export",
    help="Print files of a design: STEP, STL, 3MF, drawing, bill of materials, instructions.\n\n"
    "Example: `tubefoot export examples/designs/reference-6.toml --compensate-growth`",
)


app.command(
    "tubefoot.cli.solve:solve",
    name="solve",
    help="Solve a finger by finite elements: pressures, volumes, bend angle, stress.\n\n"
    "Example: `tubefoot solve examples/designs/reference-6.toml`",
)
app.command(
    "tubefoot.cli.reduce:reduce",
    name="reduce",
    help="Reduce a finger to a chain of units, for the virtual bench and the controllers.\n\n"
    "Example: `tubefoot reduce examples/designs/reference-12.toml --out out/reduced-12`",
)
app.command(
    "tubefoot.cli.screen:screen",
    name="screen",
    help="Solve, judge and rank the designs of a study, on one machine or a cluster; resumable.\n\n"
    "Example: `tubefoot screen examples/studies/paper.toml --out out/paper`",
)
app.command(
    "tubefoot.cli.screen:optimise",
    name="optimise",
    help="Search a study's ranges for the Pareto front of gain, stress and footprint.\n\n"
    "Example: `tubefoot optimise examples/studies/space.toml --out out/front`",
)
app.command(
    "tubefoot.cli.rig:rig_app",
    name="rig",
    help="The bench, real or simulated: check, calibrate, pulse, monitor, record, flash.",
)


app.command(
    "tubefoot.cli.report:report",
    name="report",
    help="One self-contained HTML report about runs, side by side.\n\n"
    "Example: `tubefoot report out/reference-3 out/reference-6 --out out/report`",
)
app.command(
    "tubefoot.cli.demo:demo",
    name="demo",
    help="Run the whole paper on embedded defaults, judge its claims, write one report.\n\n"
    "Example: `tubefoot demo --quick --out out/demo-quick`",
)
app.command(
    "tubefoot.cli.camera_calibration:camera_app",
    name="calibrate-camera",
    help="Calibrate the camera: print sheets, lens, bending plane, neutral zero.\n\n"
    "Example: `tubefoot calibrate-camera rehearse --out out/rehearsal`",
)
app.command(
    "tubefoot.cli.track:track",
    name="track",
    help="Bending angle, theta1 and theta2 from a camera, video, pictures or recording.\n\n"
    "Example: `tubefoot track virtual --frames 60 --out out/track`",
)
app.command(
    "tubefoot.cli.bend:bend",
    name="bend",
    help="Bend the finger in closed loop, on the bench or --sim.\n\n"
    "Example: `tubefoot bend 30 --sim --return --out out/bend-30`",
)
app.command(
    "tubefoot.cli.fit:fit_app",
    name="fit",
    help="Parameters with uncertainty, from recordings of a bench or tests of a material.\n\n"
    "Example: `tubefoot fit out/rig-record/bench.mcap --out out/fit`, or "
    "`tubefoot fit material examples/materials/agilus30_dma_20C.csv --out out/agilus30`",
)
app.command(
    "tubefoot.cli.validate:validate",
    name="validate",
    help="Recordings against finite elements: overlays, offsets with confidence, claims C5, C6, C9.\n\n"
    "Example: `tubefoot validate out/rig-record/bench.mcap --against out/reference-3`",
)
app.command(
    "tubefoot.dashboard.command:dashboard",
    name="dashboard",
    help="The live bench in the browser: camera, pressures, controllers, emergency stop.\n\n"
    "Example: `tubefoot dashboard --sim`",
)
app.command(
    "tubefoot.cli.grasp:grasp",
    name="grasp",
    help="Grasp an object gently with two fingers, on the bench or --sim.\n\n"
    "Example: `tubefoot grasp blueberry --pose front --sim --quick`",
)


def main() -> None:
    """Run the command line; a foreseen error or a missing extra prints a message and sets the exit code."""
    try:
        app()
    except TubefootError as error:
        print(f"tubefoot: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        if package in ("", "tubefoot"):
            raise
        from tubefoot.cli.extras import missing_package

        print(f"tubefoot: {missing_package(package, sys.argv[1:])}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("tubefoot: interrupted; finished states are kept", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.exit(0)
