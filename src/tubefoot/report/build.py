"""The report of any runs: pictures as files, and the page that holds them all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tubefoot.report.claims import load_claims
from tubefoot.report.page import write_page
from tubefoot.report.pictures import draw_pictures, gather_scene
from tubefoot.report.runs import load_runs

MOST_NAMED = 4


@dataclass(frozen=True)
class Report:
    """What was written: the page, the pictures' PNG files, and why others are missing."""

    page: Path
    pictures: list[Path]
    missing: list[str]


def write_report(
    paths: Sequence[Path],
    directory: Path,
    title: str | None = None,
    claims_from: Sequence[Path] = (),
    say: Callable[[str], None] = print,
) -> Report:
    """The report of the runs in some directories, as `report.html` and `figures/`.

    paths : run directories; directory : where the report goes
    title : heading of the page; the names of a few runs, else their number, if not given
    claims_from : further directories with a `claims.json`
    say : told of each step

    Raises ConfigError when a directory holds no run or a file cannot be used.
    """
    runs = load_runs(paths)
    gallery = draw_pictures(runs, directory / "figures", say)
    say("shapes in space")
    gather_scene(runs, gallery)
    claims = load_claims([*paths, *claims_from], gallery.keys)
    say("page")
    names = ", ".join(run.name for run in runs)
    heading = title or (names if len(runs) <= MOST_NAMED else f"{len(runs)} runs")
    page = write_page(directory / "report.html", heading, runs, gallery, claims)
    return Report(page, [picture.png for picture in gallery.pictures], gallery.missing)
