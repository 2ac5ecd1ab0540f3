"""The stages of `tubefoot demo`: each makes a run in a directory of its own and skips what is done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign
    from tubefoot.fea.finger_model import SolveSettings
    from tubefoot.study.claims import Claim

Tell = Callable[[float, str], None]
"""Told how much of a stage is done, 0 to 1, and what is going on."""

QUICK = {"element_size_mm": 3.0, "states": 5}
"""Solve settings of `--quick`."""
GRID_COST = 6.0
"""A grid of pressures takes so many times as long as one path."""
PITCH_RUNS_MM = {"3/12": 4.0, "3/9": 3.0}
"""Fold run of the pitches beside the reference finger's 3/15, at a rise of 1 mm."""
VALLEY_OUTSIDE_MM = 6.0
"""Where the outside of the valley stays while walls change; the chamber gap gives way."""
WALLS_MM = {"thin": (1.5, 1.5, 3.0), "uniform": (2.0, 2.0, 3.0)}
"""Fold wall, valley wall and partition beside the reference finger's mixed 1.5, 2, 2."""


@dataclass(frozen=True)
class Case:
    """One solve of the demo: its directory's name, the finger, and how it is solved."""

    name: str
    design: FingerDesign
    settings: SolveSettings


@dataclass(frozen=True)
class Stage:
    """One part of the demo.

    name : for the reader, and of its directory; cost : about how long it takes, in seconds of one core
    run : makes the run in a directory, telling how far it is
    after : stages whose runs it needs
    """

    name: str
    cost: float
    run: Callable[[Path, Tell], None]
    after: tuple[str, ...] = ()


def stages(quick: bool) -> list[Stage]:
    """The stages of the demo, in their order.

    quick : coarser meshes and fewer states
    """
    from tubefoot.cli.demo_bending import bending_stages
    from tubefoot.cli.demo_grasps import grasp_stages
    from tubefoot.cli.demo_validation import validation_stages

    solves = [solve_stage(case) for case in cases(quick)]
    return [*solves, print_stage(), *validation_stages(), *bending_stages(quick), *grasp_stages(quick)]


def judge(root: Path) -> list[Claim]:
    """The claims that the demo's runs decide, by their numbers.

    root : directory of the runs
    """
    from tubefoot.cli.demo_bending import judge_bending
    from tubefoot.cli.demo_grasps import judge_grasps
    from tubefoot.cli.demo_validation import judge_validation
    from tubefoot.study.claims import join_claims

    bench = [*judge_validation(root), *judge_bending(root), *judge_grasps(root)]
    return sorted(join_claims(judge_solves(root), bench), key=lambda claim: int(claim.id[1:]))


def cases(quick: bool) -> list[Case]:
    """The solves of the demo, in their order.

    quick : coarser meshes and fewer states
    """
    from tubefoot.design.finger import Bellows, FingerDesign
    from tubefoot.fea.finger_model import SolveSettings

    table: dict[str, Any] = {"fields": "last", **(QUICK if quick else {})}
    forward = SolveSettings(**table)
    shown = SolveSettings(**{**table, "fields": "all"})
    backward = SolveSettings(**table, until="pressure_left_kpa")
    grid = SolveSettings(**{**table, "states": 4, "fields": "none"}, cavities="filtered")
    fingers = {n: FingerDesign(name=f"reference-{n}", bellows=Bellows(units=n)) for n in (3, 6)}
    pitches = [
        FingerDesign(name=f"pitch-{pitch.replace('/', '-')}", bellows=Bellows(units=3, fold_run_mm=run))
        for pitch, run in PITCH_RUNS_MM.items()
    ]
    walls = [
        fingers[3].with_bellows(
            valley_outside_mm=VALLEY_OUTSIDE_MM, fold_wall_mm=fold, valley_wall_mm=valley, partition_mm=web
        )
        for fold, valley, web in WALLS_MM.values()
    ]
    return [
        Case("reference-3", fingers[3], shown),
        Case("reference-6", fingers[6], shown),
        Case("reference-3-reversed", fingers[3], backward),
        Case("reference-3-filtered", fingers[3], grid),
        *(Case(finger.name, finger, forward) for finger in pitches),
        *(
            Case(f"walls-{name}", finger.model_copy(update={"name": f"walls-{name}"}), forward)
            for name, finger in zip(WALLS_MM, walls, strict=True)
        ),
    ]


def solve_stage(case: Case) -> Stage:
    """A stage that solves one finger, or goes on where it was interrupted.

    case : the solve
    """

    def run(directory: Path, tell: Tell) -> None:
        from tubefoot.fea.solve import solve_design

        def report(row: dict[str, Any]) -> None:
            tell(
                min(abs(row[case.settings.until] / case.settings.target), 1.0),
                f"{row['pressure_right_kpa']:6.2f} kPa right, {row['bend_deg']:6.2f} deg",
            )

        solve_design(case.design, directory, case.settings, report)

    share = 0.3 if case.settings.element_size_mm >= QUICK["element_size_mm"] else 1.0
    paths = 1.0 if case.settings.cavities == "coupled" else GRID_COST
    return Stage(case.name, 5.0 * share * paths * case.design.bellows.units, run)


def judge_solves(root: Path) -> list[Claim]:
    """The claims that the demo's solves decide, by their numbers.

    root : directory of the demo's runs
    """
    from tubefoot.study import claims, stress_claims
    from tubefoot.study.curve import Curve
    from tubefoot.study.figures_of_merit import solve_figures
    from tubefoot.study.wall_claims import judge_walls

    three, six = Curve(root / "reference-3"), Curve(root / "reference-6")
    pitches = {pitch: Curve(root / f"pitch-{pitch.replace('/', '-')}") for pitch in PITCH_RUNS_MM}
    both = {"3_units": three, "6_units": six}
    walls = {"mixed": root / "reference-3", **{name: root / f"walls-{name}" for name in WALLS_MM}}
    return [
        claims.judge_pitch({"3/15": three, **pitches}),
        stress_claims.judge_concentration({"3/15": three, **pitches}),
        replace(
            judge_walls(
                {name: Curve(path) for name, path in walls.items()},
                {name: solve_figures(path, angle_deg=10.0) for name, path in walls.items()},
            ),
            figure="regions",
        ),
        claims.judge_length(three, six),
        claims.judge_inverse_pressures(both),
        claims.judge_linearity(both),
        claims.judge_filter(Curve(root / "reference-3-filtered"), three),
        stress_claims.judge_components(three),
        claims.judge_reversal(three, Curve(root / "reference-3-reversed")),
    ]


def print_stage() -> Stage:
    """A stage that writes the print files of the six-unit finger."""

    def run(directory: Path, tell: Tell) -> None:
        from tubefoot.cli.design import export_design
        from tubefoot.design.finger import Bellows, FingerDesign

        if (directory / "run.toml").exists():
            return
        steps = iter(range(100))
        design = FingerDesign(name="reference-6", bellows=Bellows(units=6))
        export_design(design, directory, say=lambda step: tell(min(next(steps) / 16, 1.0), step))

    return Stage("print-files", 20.0, run)
