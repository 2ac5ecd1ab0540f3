"""`tubefoot demo`: the paper on embedded defaults, ending with one page whose first screen is the claims."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage

PACE_SHARE = 0.08
"""Share of the work after which its pace is known; before, most of the time went into starting up."""


def demo(
    *,
    out: Path = Path("out/demo"),
    quick: Annotated[bool, Parameter(negative="")] = False,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
    workers: Annotated[int | None, Parameter(validator=Number(gte=1, lte=64))] = None,
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
    workers
        Stages side by side, each in a process of its own; one per processor, at most 4, when not given.
    """
    from tubefoot.cli.demo_stages import judge, stages
    from tubefoot.cli.demo_workers import run_side_by_side, usual_workers
    from tubefoot.records import Run, write_json
    from tubefoot.report.build import write_report

    planned = stages(quick)
    run = Run(out, "demo", {"quick": quick, "stages": [stage.name for stage in planned]})
    root = run.path("quick" if quick else "full")
    progress = Progress(planned)
    if overwrite:
        for stage in planned:
            remove_run(root / stage.name)
    if (number := workers or usual_workers()) > 1:
        run_side_by_side(planned, quick, root, number, progress.note, progress.finished)
    else:
        for stage in planned:
            stage.run(root / stage.name, partial(progress.note, stage))
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
        self._begun: dict[str, float] = {}
        self._shares = dict.fromkeys(self._planned, 0.0)

    def note(self, stage: Stage, share: float, line: str) -> None:
        """Tell how far a stage is.

        stage : which; share : of it that is done, 0 to 1; line : what is going on
        """
        self._begun.setdefault(stage.name, share)
        self._shares[stage.name] = share
        place = f"[{self._planned.index(stage.name) + 1} of {len(self._planned)}]"
        print(f"{place} {stage.name}: {line}{self._left()}", flush=True)

    def finished(self, stage: Stage) -> None:
        """Note the end of a stage, and say so if it was done already.

        stage : which
        """
        self._shares[stage.name] = 1.0
        if stage.name not in self._begun:
            self._begun[stage.name] = 1.0
            print(f"{stage.name}: done already", flush=True)

    def say(self, step: str) -> None:
        """Name a step after the stages.

        step : what begins
        """
        print(f"report: {step}", flush=True)

    def _left(self) -> str:
        """Time left, from what was done since the start; nothing until there is a pace."""
        everything = sum(self._costs.values())
        passed = sum(cost * self._shares[name] for name, cost in self._costs.items())
        # What an interrupted run had already is not work of this one.
        worked = sum(self._costs[name] * (self._shares[name] - begun) for name, begun in self._begun.items())
        elapsed = time.perf_counter() - self._started
        seconds = (everything - passed) / max(worked, 1e-9) * elapsed
        if worked < PACE_SHARE * everything or seconds < 1.0:
            return ""
        return f", about {seconds:.0f} s left" if seconds < 100 else f", about {seconds / 60:.0f} min left"
