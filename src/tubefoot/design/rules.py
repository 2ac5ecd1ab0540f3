"""Rules a design must meet: each with its value, its limit and what to change."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tubefoot.design.profile import Profile

if TYPE_CHECKING:
    from tubefoot.design.finger import Ports

MIN_SLOT_MM = 0.3
"""Narrowest slot that still meshes and prints (PolyJet resolves 0.325 mm in plane, MacCurdy 2016)."""


@dataclass(frozen=True)
class Rule:
    """One rule and how a design stands by it."""

    name: str
    value: float
    limit: float
    sense: Literal[">=", "<="]
    unit: str
    advice: str
    """What to change when the rule is broken."""
    where: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value keeps the limit, up to rounding."""
        slack = 1e-9 * max(1.0, abs(self.limit))
        return self.value >= self.limit - slack if self.sense == ">=" else self.value <= self.limit + slack

    @property
    def sentence(self) -> str:
        """The rule, its value and its limit as one sentence, with the advice where it is broken."""
        verdict = "" if self.passed else f"; {self.advice}"
        place = f" ({self.where})" if self.where else ""
        return (
            f"{self.name}{place} is {self.value:.4g} {self.unit}, "
            f"must be {self.sense} {self.limit:.4g} {self.unit}{verdict}"
        )


def broken(rules: Iterable[Rule]) -> list[Rule]:
    """Those rules that the design does not meet.

    rules : rules to look through
    """
    return [rule for rule in rules if not rule.passed]


def geometry_rules(profile: Profile, ports: Ports) -> list[Rule]:
    """What must hold for the dimensions to make a finger at all.

    profile : derived lengths of the finger [mm]
    ports : its tubes
    """
    return [
        *_chamber_rules(profile),
        *_fillet_rules(profile),
        Rule("port bore", ports.bore_mm, profile.chamber_gap, "<=", "mm", "reduce ports.bore_mm"),
        Rule(
            "port tube wall",
            (ports.outer_diameter_mm - ports.bore_mm) / 2,
            0.3,
            ">=",
            "mm",
            "raise ports.outer_diameter_mm or reduce ports.bore_mm",
        ),
        Rule(
            "port tube diameter",
            ports.outer_diameter_mm,
            profile.partition_face + profile.valley_inside,
            "<=",
            "mm",
            "reduce ports.outer_diameter_mm: the tubes of the two chambers would meet",
            where="between the tubes",
        ),
        Rule(
            "port tube diameter",
            ports.outer_diameter_mm,
            profile.height,
            "<=",
            "mm",
            "reduce ports.outer_diameter_mm or raise bellows.height_mm",
        ),
    ]


def _chamber_rules(profile: Profile) -> list[Rule]:
    slot = "fold slot width"
    return [
        Rule(
            "chamber gap",
            profile.chamber_gap,
            0.3,
            ">=",
            "mm",
            "raise bellows.valley_outside_mm, or reduce valley_wall_mm or partition_mm",
        ),
        Rule(
            "chamber height",
            profile.height - 2 * profile.side_wall,
            0.5,
            ">=",
            "mm",
            "raise bellows.height_mm or reduce side_wall_mm",
        ),
        Rule(
            "fold slot depth",
            profile.slot_end - profile.valley_outside,
            0.3,
            ">=",
            "mm",
            "raise bellows.fold_run_mm or reduce fold_wall_mm",
        ),
        Rule(
            slot,
            2 * profile.slot_half_width(profile.slot_end),
            MIN_SLOT_MM,
            ">=",
            "mm",
            "raise bellows.crest_flat_mm or reduce fold_wall_mm",
            where="at the crest",
        ),
        Rule(
            "valley between slots",
            profile.inner_valley_flat,
            0.4,
            ">=",
            "mm",
            "raise bellows.valley_flat_mm or fold_wall_mm, or reduce valley_wall_mm",
            where="chamber side",
        ),
    ]


def _fillet_rules(profile: Profile) -> list[Rule]:
    """A fillet takes its setback from both edges at a corner: the shortest edge holds two of them."""
    slot = 2 * profile.slot_half_width(profile.slot_end)
    outside = min(profile.valley_flat, profile.crest_flat)
    chamber = min(slot, profile.inner_valley_flat)
    setback = profile.fillet_setback(1.0)
    return [
        Rule(
            "outside fillet",
            profile.fillet_outside,
            max(0.0, 0.49 * outside / setback),
            "<=",
            "mm",
            "reduce bellows.fillet_outside_mm or lengthen crest_flat_mm and valley_flat_mm",
        ),
        Rule(
            "chamber fillet",
            profile.fillet_chamber,
            max(0.0, 0.49 * chamber / setback),
            "<=",
            "mm",
            "reduce bellows.fillet_chamber_mm or widen the slot",
        ),
    ]
