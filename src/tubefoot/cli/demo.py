"""`tubefoot demo`: the paper on embedded defaults, ending with one page whose first screen is the claims."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign
    from tubefoot.fea.finger_model import SolveSettings
    from tubefoot.study.claims import Claim

QUICK = {"element_size_mm": 3.0, "states": 5}
"""Solve settings of `--quick`."""
PITCH_RUNS_MM = {"3/12": 4.0, "3/9": 3.0}
"""Fold run of the pitches beside the reference finger's 3/15, at a rise of 1 mm."""


@dataclass(frozen=True)
class Case:
    """One solve of the demo: its directory's name, the finger, and how it is solved."""

    name: str
    design: FingerDesign
    settings: SolveSettings


def demo(
    *,
    out: Path = Path("out/demo"),
    quick: Annotated[bool, Parameter(negative="")] = False,
    overwrite: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Solve the reference fingers, judge the paper's claims on them, and write one report of it all.

    Runs that are finished are not repeated; an interrupted one goes on at its last converged state.

    Example: tubefoot demo --quick --out out/demo-quick

    Parameters
    ----------
    out
        Directory for report.html, claims.json, figures/ and the solves.
    quick
        Coarser meshes and fewer states, in directories of their own.
    overwrite
        Solve again also what is finished.
    """
    from tubefoot.fea.solve import solve_design
    from tubefoot.records import Run, write_json
    from tubefoot.report.build import write_report

    planned = cases(quick)
    run = Run(out, "demo", {"quick": quick, "solves": [case.name for case in planned]})
    root = run.path("solves-quick" if quick else "solves")
    progress = Progress(planned)
    for case in planned:
        solve_design(case.design, root / case.name, case.settings, progress.of(case), overwrite=overwrite)
        progress.finished(case)
    claims = judge(root)
    write_json(run.path("claims.json"), [claim.as_record() for claim in claims])
    directories = [root / case.name for case in planned]
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


def cases(quick: bool) -> list[Case]:
    """The solves of the demo, in their order.

    quick : coarser meshes and fewer states
    """
    from tubefoot.design.finger import Bellows, FingerDesign
    from tubefoot.fea.finger_model import SolveSettings

    table: dict[str, Any] = {"fields": "last", **(QUICK if quick else {})}
    forward = SolveSettings(**table)
    backward = SolveSettings(**table, until="pressure_left_kpa")
    grid = SolveSettings(**{**table, "states": 4, "fields": "none"}, cavities="filtered")
    fingers = {n: FingerDesign(name=f"reference-{n}", bellows=Bellows(units=n)) for n in (3, 6)}
    pitches = [
        FingerDesign(name=f"pitch-{pitch.replace('/', '-')}", bellows=Bellows(units=3, fold_run_mm=run))
        for pitch, run in PITCH_RUNS_MM.items()
    ]
    return [
        Case("reference-3", fingers[3], forward),
        Case("reference-6", fingers[6], forward),
        Case("reference-3-reversed", fingers[3], backward),
        Case("reference-3-filtered", fingers[3], grid),
        *(Case(finger.name, finger, forward) for finger in pitches),
    ]


def judge(root: Path) -> list[Claim]:
    """The claims that the demo's solves decide, by their numbers.

    root : directory of the solves
    """
    from tubefoot.study import claims, stress_claims
    from tubefoot.study.curve import Curve

    three, six = Curve(root / "reference-3"), Curve(root / "reference-6")
    pitches = {pitch: Curve(root / f"pitch-{pitch.replace('/', '-')}") for pitch in PITCH_RUNS_MM}
    both = {"3_units": three, "6_units": six}
    return [
        claims.judge_pitch({"3/15": three, **pitches}),
        stress_claims.judge_concentration({"3/15": three, **pitches}),
        claims.judge_length(three, six),
        claims.judge_inverse_pressures(both),
        claims.judge_linearity(both),
        claims.judge_filter(Curve(root / "reference-3-filtered"), three),
        stress_claims.judge_components(three),
        claims.judge_reversal(three, Curve(root / "reference-3-reversed")),
    ]


class Progress:
    """Lines about how far the demo is, with the time left at the pace so far."""

    def __init__(self, planned: Sequence[Case]):
        """Start the clock.

        planned : all solves; one counts as much as its finger has units
        """
        self._weights = {case.name: case.design.bellows.units for case in planned}
        self._planned = list(self._weights)
        self._started = time.perf_counter()
        self._solved, self._done, self._before = 0.0, 0.0, 0.0

    def of(self, case: Case) -> Any:
        """The function that a solve calls with each new row of its curve.

        case : which solve
        """
        self._seen = False

        def report(row: dict[str, Any]) -> None:
            share = min(abs(row[case.settings.until] / case.settings.target), 1.0)
            if not self._seen:
                self._seen, self._before = True, share
            now = self._solved + (share - self._before) * self._weights[case.name]
            left = self._left(self._done + share * self._weights[case.name], now)
            place = f"[{self._planned.index(case.name) + 1} of {len(self._planned)}]"
            print(
                f"{place} {case.name}: {row['pressure_right_kpa']:6.2f} kPa right, "
                f"{row['bend_deg']:6.2f} deg{left}",
                flush=True,
            )

        return report

    def finished(self, case: Case) -> None:
        """Note the end of a solve, and say so if it was there already.

        case : which solve
        """
        weight = self._weights[case.name]
        self._done += weight
        if self._seen:
            self._solved += (1.0 - self._before) * weight
        else:
            print(f"{case.name}: already solved", flush=True)

    def say(self, step: str) -> None:
        """Name a step after the solves.

        step : what begins
        """
        print(f"report: {step}", flush=True)

    def _left(self, done: float, solved: float) -> str:
        """Time left, from what was solved since the start; nothing until there is a pace."""
        seconds = (
            (sum(self._weights.values()) - done) / max(solved, 1e-9) * (time.perf_counter() - self._started)
        )
        if solved < 0.5 or seconds < 1.0:
            return ""
        return f", about {seconds:.0f} s left" if seconds < 100 else f", about {seconds / 60:.0f} min left"
