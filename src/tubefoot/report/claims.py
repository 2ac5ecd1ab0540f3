"""Judged claims as the page shows them, from `claims.json`: the paper's fifteen first, then others."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from tubefoot.errors import ConfigError
from tubefoot.report.runs import read_json

MARKS = {"holds": "✓", "refuted": "✗", "mixed": "◐", "not computed": "–"}
"""A sign beside each verdict: colour alone would not do."""
PAPER_CLAIMS = {
    "C1": "the 3/15 pitch has the highest gain",
    "C2": "the 3/9 pitch concentrates stress in the body",
    "C3": "walls: thin bends most, mixed spreads the stress",
    "C4": "six units bend more than three, per unit alike",
    "C5": "the chambers' pressures are inverse",
    "C6": "the angle is linear in the right pressure",
    "C7": "filtered pressure states approximate the cycle",
    "C8": "S23 in the folds, S13 at mid-plane and partition, S33 across the seam",
    "C9": "experiments lie below the simulation, for known causes",
    "C10": "reversing the pump bends the other way",
    "C11": "a step to 30° settles in 11 iterations, back in 7",
    "C12": "the columns move in opposite directions",
    "C13": "tofu: theta1 and theta2 of one sign, theta1 larger",
    "C14": "blueberries: opposite signs, an inflexion",
    "C15": "both are held without damage or slip",
}
"""What the paper says, each in a few words."""
FIRST = 2
"""How many of a claim's numbers the overview shows."""
UNITS = (
    ("deg_per_kpa", "°/kPa"),
    ("deg_percent", "% of the angle"),
    ("kpa_percent", "% of the pressure"),
    ("n_mm", "N mm"),
    ("kpa", "kPa"),
    ("deg", "°"),
    ("mm", "mm"),
    ("ml", "ml"),
    ("mj", "mJ"),
    ("ms", "ms"),
    ("n", "N"),
    ("s", "s"),
    ("percent", "%"),
)
"""Endings of names and the units that they stand for, longest first."""


@dataclass(frozen=True)
class Number:
    """One number behind a verdict: its name for a reader, its value and its unit, empty where it has none."""

    name: str
    value: Any
    unit: str = ""

    @classmethod
    def of(cls, key: str, value: Any) -> Number:
        """The number under a key whose end names the unit.

        key : as in `claims.json`; value : as found there
        """
        for ending, unit in UNITS:
            if key == ending or key.endswith(f"_{ending}"):
                return cls(_spoken(key[: -len(ending)]), value, unit)
        return cls(_spoken(key), value)


@dataclass(frozen=True)
class Claim:
    """One judged statement and its numbers; `figure` is an anchor of the page or None."""

    id: str
    statement: str
    verdict: str
    numbers: Sequence[Number]
    rule: str
    figure: str | None

    @property
    def mark(self) -> str:
        """The sign of the verdict."""
        return MARKS[self.verdict]

    @property
    def short(self) -> str:
        """The claim in a few words."""
        return PAPER_CLAIMS.get(self.id, self.statement)

    @property
    def first(self) -> list[Number]:
        """The numbers that stand for the verdict where there is little room."""
        return [number for number in self.numbers if isinstance(number.value, int | float)][:FIRST]


def load_claims(paths: Sequence[Path], anchors: Collection[str]) -> list[Claim]:
    """The claims in `claims.json` of the named directories, by their numbers; later ones replace earlier.

    Where any claim was judged, those of the paper's fifteen that were not are listed as not computed.

    paths : directories; those without claims are passed over
    anchors : keys of the figures on the page, to which a claim can link

    Raises ConfigError when an entry lacks a key or has an unknown verdict.
    """
    found: dict[str, Claim] = {}
    for path in paths:
        for entry in read_json(path / "claims.json") or []:
            claim = _claim(entry, path / "claims.json", anchors)
            earlier = found.get(claim.id)
            if earlier is None or claim.verdict != "not computed":
                found[claim.id] = claim
    if found:
        for name, words in PAPER_CLAIMS.items():
            found.setdefault(
                name, Claim(name, words, "not computed", [], "No run shown here decides it.", None)
            )
    return sorted(found.values(), key=_place)


def _place(claim: Claim) -> tuple[bool, int, str]:
    """The paper's claims by their numbers, then others by their names."""
    return claim.id not in PAPER_CLAIMS, len(claim.id), claim.id


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
        _numbers(entry["numbers"]),
        str(entry["rule"]),
        figure if figure in anchors else None,
    )


def _numbers(numbers: Any, prefix: str = "") -> list[Number]:
    """Nested numbers as one list."""
    if isinstance(numbers, Mapping):
        items = [(f"{prefix}{key}", value) for key, value in numbers.items()]
    elif isinstance(numbers, list):
        items = [(f"{prefix}{place}", value) for place, value in enumerate(numbers, 1)]
    else:
        return [Number.of(prefix.strip(), numbers)]
    found: list[Number] = []
    for name, value in items:
        nested = isinstance(value, Mapping | list)
        found += _numbers(value, f"{name} ") if nested else [Number.of(name, value)]
    return found


def _spoken(key: str) -> str:
    return key.replace("_", " ").strip()
