"""`tubefoot demo`: the paper on embedded defaults, ending with one page whose first screen is the claims."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage


def demo(
    *,
    out: Path = Path("out/demo"),
    quick: Annotated[bool, Parameter(negative="")] = False,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Run the whole paper on embedded defaults, judge its claims, and write one report of it all.

    Runs that are finished are not repeated; an interrupted solve goes on at its last converged state.

    Example: tubefoot demo --quick --out out/demo-quick

    Parameters
    ----------
    out
        Directory for report.html, claims.json, figures/ and the runs.
    quick
        Coarser meshes and fewer states, in a directory of their own.
    overwrite
        Do again also what is finished.
    """
    from tubefoot.cli.demo_stages import judge, stages
    from tubefoot.records import Run, write_json
    from tubefoot.report.build import write_report

    planned = stages(quick)
    run = Run(out, "demo", {"quick": quick, "stages": [stage.name for stage in planned]})
    root = run.path("quick" if quick else "full")
    progress = Progress(planned)
    for stage in planned:
        directory = root / stage.name
        if overwrite:
            remove_run(directory)
        stage.run(directory, progress.of(stage))
        progress.finished(stage)
    claims = judge(root)
    write_json(run.path("claims.json"), [claim.as_record() for claim in claims])
    directories = [root / stage.name for stage in planned]
    title = "Tubefoot demo, quick" if quick else "Tubefoot demo"
    report = write_report(directories, run.directory, title, [run.directory], progress.say)
    for reason in report.missing:
        print(f"not drawn: {reason}")
    verdicts = {claim.id: claim.verdict for claim in claims}
    write_json(run.path("summary.json"), {"verdicts": verdicts, "wall_s": run.wall_s})
    run.finish(**verdicts)
    for claim in claims:
        print(f"{claim.id:>4} {claim.verdict}: {claim.statement}")
    print(f"report: {report.page}")


def remove_run(directory: Path) -> None:
    """Remove a run that is to be done again; what is no run is left alone.

    directory : with a `run.toml` or the states of an interrupted solve, or missing
    """
    import shutil

    if any((directory / name).exists() for name in ("run.toml", "curve.csv", "states")):
        shutil.rmtree(directory)


class Progress:
    """Lines about how far the demo is, with the time left at the pace so far."""

    def __init__(self, planned: Sequence[Stage]):
        """Start the clock.

        planned : all stages
        """
        self._costs = {stage.name: stage.cost for stage in planned}
        self._planned = list(self._costs)
        self._started = time.perf_counter()
        self._passed, self._worked = 0.0, 0.0
        self._began_at: float | None = None

    def of(self, stage: Stage) -> Callable[[float, str], None]:
        """The function that a stage calls with the share done, 0 to 1, and a line of text.

        stage : which
        """
        self._began_at = None

        def report(share: float, line: str) -> None:
            # What an interrupted run had already is not work of this one.
            if self._began_at is None:
                self._began_at = share
            left = self._left(
                self._passed + share * stage.cost, self._worked + (share - self._began_at) * stage.cost
            )
            place = f"[{self._planned.index(stage.name) + 1} of {len(self._planned)}]"
            print(f"{place} {stage.name}: {line}{left}", flush=True)

        return report

    def finished(self, stage: Stage) -> None:
        """Note the end of a stage, and say so if it was done already.

        stage : which
        """
        self._passed += stage.cost
        if self._began_at is None:
            print(f"{stage.name}: done already", flush=True)
        else:
            self._worked += (1.0 - self._began_at) * stage.cost

    def say(self, step: str) -> None:
        """Name a step after the stages.

        step : what begins
        """
        print(f"report: {step}", flush=True)

    def _left(self, passed: float, worked: float) -> str:
        """Time left, from what was done since the start; nothing until there is a pace."""
        elapsed = time.perf_counter() - self._started
        seconds = (sum(self._costs.values()) - passed) / max(worked, 1e-9) * elapsed
        if worked < 0.03 * sum(self._costs.values()) or seconds < 1.0:
            return ""
        return f", about {seconds:.0f} s left" if seconds < 100 else f", about {seconds / 60:.0f} min left"
