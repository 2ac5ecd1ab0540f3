"""`tubefoot screen` and `tubefoot optimise`: many designs solved, judged and ranked; the Pareto front."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.study.crew import CrewSettings
    from tubefoot.study.screening import ScreenResult

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
    from rich.console import Console
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
    Console().print(table)
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
