"""The paper's claims C1 to C4 and its selection, judged on the comparisons of a screening."""

from __future__ import annotations

from typing import Any

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.study.candidates import make_candidate
from tubefoot.study.claims import Claim, judge_length, judge_pitch
from tubefoot.study.curve import Curve
from tubefoot.study.ranking import criteria_of, group_scores, weights_of
from tubefoot.study.screening import Screening
from tubefoot.study.stress_claims import judge_concentration
from tubefoot.study.study_file import Comparison
from tubefoot.study.wall_claims import judge_selection, judge_walls

Row = dict[str, Any]

NEEDED = {
    "C1": ("3/15", "3/12", "3/9"),
    "C2": ("3/15", "3/9"),
    "C3": ("thin", "uniform", "mixed"),
    "C4": ("3 units", "6 units"),
}
"""Names of the candidates that a claim is about."""


def require_candidates(comparison: Comparison) -> None:
    """Raise ConfigError when a comparison lacks a candidate that one of its claims is about.

    comparison : with its claims
    """
    for claim in comparison.claims:
        if missing := [name for name in NEEDED[claim] if name not in comparison.candidates]:
            raise ConfigError(
                f"comparison `{comparison.name}`: claim {claim} is about {', '.join(NEEDED[claim])}; "
                f"missing: {', '.join(missing)}"
            )


def judge_study(screening: Screening) -> tuple[list[Claim], str]:
    """The claims that a finished screening decides, and the reason of the verdict on its selection.

    screening : finished, in full
    """
    claims = [
        _judge(claim, comparison.name, screening)
        for comparison in screening.study.comparison
        for claim in comparison.claims
    ]
    selection, reason = _selection(screening)
    return [*claims, *selection], reason


def _solved(screening: Screening, comparison: str) -> dict[str, tuple[Curve, Row]]:
    """Curve and figures of each candidate of a comparison that was solved."""
    found = {}
    for candidate in screening.candidates():
        if candidate.comparison == comparison:
            job, record, source = screening.record(candidate)
            if source == "full" and record["status"] == "solved":
                found[candidate.name] = Curve(job.folder), record
    return found


def _judge(claim: str, comparison: str, screening: Screening) -> Claim:
    found = _solved(screening, comparison)
    if missing := [name for name in NEEDED[claim] if name not in found]:
        return Claim(claim, "", f"not solved up to 35 kPa: {', '.join(missing)}", "not computed")
    curves = {name: curve for name, (curve, _) in found.items()}
    if claim == "C1":
        return judge_pitch(curves)
    if claim == "C2":
        return judge_concentration(curves)
    if claim == "C3":
        return judge_walls(curves, {name: record for name, (_, record) in found.items()})
    return judge_length(curves["3 units"], curves["6 units"])


def _selection(screening: Screening) -> tuple[list[Claim], str]:
    rank = screening.study.rank
    if not rank.selected:
        return [], ""
    among = rank.among or tuple(comparison.name for comparison in screening.study.comparison)
    figures: dict[str, Row] = {}
    by_folder: dict[str, str] = {}
    for comparison in among:
        for candidate in screening.candidates():
            job, record, _ = screening.record(candidate)
            usable = record["status"] == "solved" and record["printable"]
            if candidate.comparison == comparison and usable:
                name = by_folder.setdefault(job.key, candidate.name)
                if candidate.name == rank.selected:
                    figures.pop(name, None)
                    by_folder[job.key] = name = candidate.name
                figures[name] = record
    if rank.selected not in figures:
        raise ConfigError(
            f"rank.selected = `{rank.selected}` is none of the printable candidates that were solved: "
            f"{', '.join(figures)}"
        )
    base = screening.record(make_candidate(screening.base, "base", {}))[1]
    groups = group_scores(np.array([criteria_of(record) for record in figures.values()]), criteria_of(base))
    claim, reason = judge_selection(rank.selected, list(figures), groups, weights_of(rank))
    return [claim], reason
