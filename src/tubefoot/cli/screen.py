"""`tubefoot screen` and `tubefoot optimise`: many designs solved, judged and ranked; the Pareto front."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from rich.console import Console

    from tubefoot.study.crew import CrewSettings
    from tubefoot.study.optimisation import OptimiseResult
    from tubefoot.study.screening import ScreenResult

WIDE = 150
SHOWN = 10
"""Rows of the ranking that are printed."""


def screen(
    study: Path,
    /,
    *,
    out: Path | None = None,
    scheduler: str | None = None,
    scheduler_file: Path | None = None,
    workers: int | None = None,
    threads: int = 1,
    look: bool | None = None,
    pictures: Annotated[bool, Parameter(negative="--no-pictures")] = True,
) -> None:
    """Solve the designs of a study, judge and rank them; what is finished is never solved again.

    Written are candidates.csv (a row as each result comes, with score and rank at the end), best.csv,
    claims.json, one folder a design in designs/, and figures of each comparison.

    Example: tubefoot screen examples/studies/paper.toml --out out/paper

    Example: tubefoot screen examples/studies/space.toml --scheduler tcp://head:8786

    Parameters
    ----------
    study
        Study file: base design, what varies or is compared, how to rank.
    out
        Directory for the results; out/NAME if not given. The same one goes on with an interrupted study.
    scheduler
        Address of a running Dask scheduler; a cluster on this machine if not given.
    scheduler_file
        File that a running Dask scheduler wrote.
    workers
        Workers on this machine; as many as its processors allow if not given.
    threads
        Threads of one job.
    look
        Whether to look first by a coarse model, as look.use of the study says if not given.
    pictures
        Whether stress panels and curves of each comparison are drawn.
    """
    from tubefoot.cli.tally import TallyPrinter
    from tubefoot.records import write_json
    from tubefoot.study.paper_claims import judge_study, require_candidates
    from tubefoot.study.screening import Screening
    from tubefoot.study.study_file import load_study

    loaded, base = load_study(study)
    if look is not None:
        loaded = loaded.model_copy(update={"look": loaded.look.model_copy(update={"use": look})})
    for comparison in loaded.comparison:
        require_candidates(comparison)
    crew = _crew(scheduler, scheduler_file, workers, threads)
    directory = out or Path("out") / loaded.name
    with TallyPrinter() as printer:
        screening = Screening(loaded, base, directory, printer)
        result = screening.screen(crew)
    claims, reason = judge_study(screening)
    if claims:
        write_json(directory / "claims.json", [claim.as_record() for claim in claims])
    _print_ranking(result, list(screening.columns.values()))
    for claim in claims:
        print(f"{claim.id:>4} {claim.verdict}: {claim.statement or claim.rule}")
    if reason:
        print(f"     {reason}")
    if pictures and loaded.comparison:
        from tubefoot.report.comparison import draw_comparisons

        for path in draw_comparisons(directory):
            print(f"picture: {path}")
    print(f"results: {result.table}")


def optimise(
    study: Path,
    /,
    *,
    out: Path | None = None,
    warm_start: Path | None = None,
    designs: int | None = None,
    scheduler: str | None = None,
    scheduler_file: Path | None = None,
    workers: int | None = None,
    threads: int = 1,
    pictures: Annotated[bool, Parameter(negative="--no-pictures")] = True,
) -> None:
    """Search the ranges of a study for the Pareto front of gain, stress at a fixed angle, and footprint.

    Written are evaluations.csv (every design of the search), front.csv (the front with its uncertainty),
    summary.json with the cost in core-hours, one folder a design in designs/, and a figure.

    Example: tubefoot optimise examples/studies/space.toml --designs 30 --out out/front

    Parameters
    ----------
    study
        Study file; the ranges under [vary] are searched.
    out
        Directory for the results; out/NAME-front if not given. The same one goes on where a search broke off.
    warm_start
        Directory of a finished screening with a first look, whose designs and calibration are taken over.
    designs
        How many designs are evaluated, as search.designs of the study says if not given.
    scheduler
        Address of a running Dask scheduler; a cluster on this machine if not given.
    scheduler_file
        File that a running Dask scheduler wrote.
    workers
        Workers on this machine; as many as its processors allow if not given.
    threads
        Threads of one job.
    pictures
        Whether the front is drawn.
    """
    from tubefoot.cli.tally import TallyPrinter
    from tubefoot.config import parse_settings
    from tubefoot.study.optimisation import SOROFORGE_CORE_HOURS, Optimisation
    from tubefoot.study.study_file import SearchSettings, load_study

    loaded, base = load_study(study)
    if designs is not None:
        search = parse_settings(
            {**loaded.search.model_dump(), "designs": designs}, SearchSettings, "--designs"
        )
        loaded = loaded.model_copy(update={"search": search})
    crew = _crew(scheduler, scheduler_file, workers, threads)
    directory = out or Path("out") / f"{loaded.name}-front"
    with TallyPrinter() as printer:
        result = Optimisation(loaded, base, directory, printer).optimise(crew, warm_start)
    _print_front(result)
    print(
        f"{result.evaluated} designs evaluated, {result.core_s / 3600:.3f} core-hours "
        f"(SoRoForge published {SOROFORGE_CORE_HOURS:g} for one front)"
    )
    if pictures:
        from tubefoot.report.front import draw_front

        print(f"picture: {draw_front(directory)}")
    print(f"results: {result.table}")


def _print_front(result: OptimiseResult) -> None:
    import numpy as np
    from rich.table import Table

    table = Table("design", "gain [deg/kPa]", "stress at angle [kPa]", "cm3", "on the front", "source")
    for row in result.front:
        table.add_row(
            row["name"],
            f"{row['gain_deg_per_kpa']:.4f} ± {row['gain_sd_percent']:.1f} %",
            f"{row['von_mises_p99_at_angle_kpa']:.1f} ± {row['stress_sd_percent']:.1f} %",
            f"{row['footprint_cm3']:.2f}",
            f"{100 * row['probability']:.0f} %",
            row["source"],
        )
    _console().print(table)
    if len(result.look_error):
        gain, stress = (100.0 * (np.exp(error.max()) - 1.0) for error in np.abs(result.look_error).T)
        print(
            f"{len(result.look_error)} designs of the front solved in full; largest error of the look: "
            f"gain {gain:.1f} %, stress {stress:.1f} %"
        )


def _console() -> Console:
    """As wide as the terminal, and wide enough for the tables where there is none."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=WIDE)


def _crew(
    scheduler: str | None, scheduler_file: Path | None, workers: int | None, threads: int
) -> CrewSettings:
    from tubefoot.config import parse_settings
    from tubefoot.study.crew import CrewSettings

    table: dict[str, Any] = {
        "scheduler": scheduler,
        "scheduler_file": str(scheduler_file) if scheduler_file else None,
        "workers": workers,
        "threads": threads,
    }
    return parse_settings(table, CrewSettings, source="cluster")


def _print_ranking(result: ScreenResult, varied: list[str]) -> None:
    from rich.table import Table

    table = Table("rank", "name", *varied, "bend [deg]", "stress at angle [kPa]", "cm3", "score", "source")
    for row in result.best[:SHOWN]:
        figures = (row.get("bend_deg_at_35kpa"), row.get("von_mises_p99_at_angle_kpa"), row["footprint_cm3"])
        table.add_row(
            str(row["rank"]),
            f"{row['comparison']} {row['name']}".strip(),
            *(f"{row[name]:.4g}" for name in varied),
            *("" if value is None else f"{value:.4g}" for value in figures),
            f"{row['score']:+.3f}",
            row["source"],
        )
    _console().print(table)
    counts = ", ".join(f"{number} {status}" for status, number in result.counts.items())
    print(f"{counts}; {result.core_s / 3600:.3f} core-hours")
    if result.calibration is not None:
        summary = result.calibration.summary()
        print(f"first look against {summary['pairs']} full solves, each left out in turn:")
        for name, found in summary.items():
            if isinstance(found, dict):
                print(
                    f"  {name}: median error {found['median_error_percent']:.1f} %, "
                    f"largest {found['largest_error_percent']:.1f} %"
                )
        print(f"  rank correlation of the bend angle {summary['rank_correlation_bend']:.3f}")
