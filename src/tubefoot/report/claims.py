"""Judged claims as the page shows them, read from `claims.json`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from tubefoot.errors import ConfigError
from tubefoot.report.runs import read_json

MARKS = {"holds": "✓", "refuted": "✗", "mixed": "◐", "not computed": "–"}
"""A sign beside each verdict: colour alone would not do."""


@dataclass(frozen=True)
class Claim:
    """One judged statement: numbers as (name, value) pairs, figure as an anchor of the page or None."""

    id: str
    statement: str
    verdict: str
    numbers: Sequence[tuple[str, Any]]
    rule: str
    figure: str | None

    @property
    def mark(self) -> str:
        """The sign of the verdict."""
        return MARKS[self.verdict]


def load_claims(paths: Sequence[Path], anchors: Collection[str]) -> list[Claim]:
    """The claims in `claims.json` of the named directories, by their numbers; later ones replace earlier.

    paths : directories; those without claims are passed over
    anchors : keys of the figures on the page, to which a claim can link

    Raises ConfigError when an entry lacks a key or has an unknown verdict.
    """
    found: dict[str, Claim] = {}
    for path in paths:
        for entry in read_json(path / "claims.json") or []:
            claim = _claim(entry, path / "claims.json", anchors)
            found[claim.id] = claim
    return sorted(found.values(), key=lambda claim: (len(claim.id), claim.id))


def _claim(entry: Mapping[str, Any], path: Path, anchors: Collection[str]) -> Claim:
    missing = [key for key in ("id", "verdict", "numbers", "rule") if key not in entry]
    if missing:
        raise ConfigError(f"{path}: a claim has no key {', '.join(missing)}")
    if entry["verdict"] not in MARKS:
        raise ConfigError(
            f"{path}: {entry['id']} has the verdict `{entry['verdict']}`; allowed: {', '.join(MARKS)}"
        )
    figure = PurePath(str(entry.get("figure") or "")).stem
    return Claim(
        str(entry["id"]),
        str(entry.get("statement", "")),
        str(entry["verdict"]),
        _pairs(entry["numbers"]),
        str(entry["rule"]),
        figure if figure in anchors else None,
    )


def _pairs(numbers: Any, prefix: str = "") -> list[tuple[str, Any]]:
    """Nested numbers as one list of names and values."""
    if isinstance(numbers, Mapping):
        items = [(f"{prefix}{key}", value) for key, value in numbers.items()]
    elif isinstance(numbers, list):
        items = [(f"{prefix}{place}", value) for place, value in enumerate(numbers, 1)]
    else:
        return [(prefix.strip(), numbers)]
    pairs: list[tuple[str, Any]] = []
    for name, value in items:
        pairs += _pairs(value, f"{name} ") if isinstance(value, Mapping | list) else [(name, value)]
    return pairs
