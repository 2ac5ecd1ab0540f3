"""The report page: one HTML file that needs no network, with everything it shows inside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from tubefoot import __version__
from tubefoot.records import write_whole
from tubefoot.report.claims import MARKS, Claim
from tubefoot.report.differences import difference_lines, meeting_pressure
from tubefoot.report.embed import data_uri, image_size, inline_svg
from tubefoot.report.look import Picture
from tubefoot.report.merit import check_lines, summary_lines
from tubefoot.report.pictures import Gallery
from tubefoot.report.runs import RunRecord
from tubefoot.report.viewer import Viewer

NOTHING = "–"


@dataclass(frozen=True)
class Shown:
    """A picture as the template places it: its record, and its markup or its image with width and height."""

    picture: Picture
    markup: str
    source: str
    width: int
    height: int

    @classmethod
    def of(cls, picture: Picture) -> Shown:
        """Embed a picture.

        picture : with its files
        """
        width, height = image_size(picture.png)
        if picture.svg is not None:
            alternative = f"{picture.title}. {picture.caption}"
            return cls(picture, inline_svg(picture.svg, picture.key, alternative), "", width, height)
        return cls(picture, "", data_uri(picture.png), width, height)


def write_page(
    path: Path, title: str, runs: Sequence[RunRecord], gallery: Gallery, claims: Sequence[Claim]
) -> Path:
    """The path of the page, after writing it.

    path : file to write; title : its heading
    runs : in the order in which they are shown; gallery : their pictures; claims : judged, may be empty
    """
    environment = Environment(
        loader=PackageLoader("tubefoot.report", "."),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(number=number, percent=percent, unit=spaced_unit)
    solves = [run for run in runs if run.is_solve]
    settings = {run.name: flat(run.settings) for run in runs}
    page = environment.get_template("page.html.j2").render(
        title=title,
        version=__version__,
        runs=runs,
        solves=solves,
        others=_by_verb([run for run in runs if not run.is_solve]),
        side_by_side=side_by_side,
        differences=difference_lines(solves),
        meeting_kpa=meeting_pressure(solves),
        viewer=Viewer.of(gallery.scene) if gallery.scene else None,
        keys=gallery.keys,
        marks=MARKS,
        claims=claims,
        tally=_tally(claims),
        summary=summary_lines(solves) if solves else [],
        checks=check_lines(solves) if solves else [],
        shown=[Shown.of(picture) for picture in gallery.pictures],
        missing=gallery.missing,
        by_verb=[
            (verb, group, _differing([settings[run.name] for run in group])) for verb, group in _by_verb(runs)
        ],
        settings=settings,
    )
    return write_whole(path, page)


def number(value: Any) -> str:
    """A value for a table: four significant digits, a true minus sign, a dash for nothing.

    value : number, text, truth value or None
    """
    if value is None or value == "":
        return NOTHING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, int | float):
        return str(value)
    if not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    if float(value).is_integer() and abs(value) < 1e7:
        text = f"{int(value):,}".replace(",", "\u202f")
    elif 1e-4 <= abs(value) < 1e6:
        text = f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"
    else:
        text = f"{value:.2e}"
    return text.replace("-", "\u2212")


def percent(share: float) -> str:
    """A signed difference for a table, in percent.

    share : of the reference
    """
    return f" {100 * share:+.1f} %".replace("-", "\u2212")


def spaced_unit(unit: str) -> str:
    """A unit as it follows a number: parted by a thin space, but for degrees.

    unit : may be empty
    """
    return unit if not unit or unit.startswith("°") else f"\u202f{unit}"


def side_by_side(runs: Sequence[RunRecord]) -> list[tuple[str, list[Any]]]:
    """Rows of a table of summaries: key and one value a run, None where a run does not have it.

    runs : of one verb
    """
    tables = [flat(run.summary) for run in runs]
    keys = dict.fromkeys(key for table in tables for key in table)
    return [(key, [table.get(key) for table in tables]) for key in keys]


def flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested settings as one level, keys joined by dots, lists as text.

    table : settings; prefix : put before every key
    """
    result: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            result |= flat(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            result[f"{prefix}{key}"] = ", ".join(str(item) for item in value)
        else:
            result[f"{prefix}{key}"] = value
    return result


def _differing(settings: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[Any]]]:
    """Settings that are not the same in all runs: key and one value a run."""
    keys = dict.fromkeys(key for table in settings for key in table)
    rows = [(key, [table.get(key) for table in settings]) for key in keys]
    return [(key, values) for key, values in rows if any(value != values[0] for value in values)]


def _by_verb(runs: Sequence[RunRecord]) -> list[tuple[str, list[RunRecord]]]:
    """Runs in groups of one verb, in the order in which the verbs first occur."""
    groups: dict[str, list[RunRecord]] = {}
    for run in runs:
        groups.setdefault(run.verb, []).append(run)
    return list(groups.items())


def _tally(claims: Sequence[Claim]) -> dict[str, int]:
    counts: dict[str, int] = {}
    for claim in claims:
        counts[claim.verdict] = counts.get(claim.verdict, 0) + 1
    return counts
