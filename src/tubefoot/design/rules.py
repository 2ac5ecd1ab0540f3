"""Rules a design must meet: each with its value, its limit and what to change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from tubefoot.design.layout import tube_axis
from tubefoot.design.profile import FloatArray, Profile

if TYPE_CHECKING:
    from tubefoot.design.hardware import Ports

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
    place: tuple[float, float] | None = None
    """x and z of the spot on the mid-plane that decides [mm], for a picture."""

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


def at_least(
    name: str, value: float, limit: float, advice: str, place: Sequence[float] | FloatArray, unit: str = "mm"
) -> Rule:
    """A rule with a lower limit.

    name : what is limited
    value : how the design stands
    limit : the least allowed
    advice : what to change when the rule is broken
    place : x and z of the spot that decides [mm]
    unit : of value and limit
    """
    return Rule(name, float(value), limit, ">=", unit, advice, place=(float(place[0]), float(place[1])))


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
    return [*_chamber_rules(profile), *_fillet_rules(profile), *_port_rules(profile, ports)]


def _port_rules(profile: Profile, ports: Ports) -> list[Rule]:
    axis, radius = tube_axis(profile, ports), ports.outer_diameter_mm / 2
    bore_margin = min(axis - profile.partition_face, profile.valley_inside - axis) - ports.bore_mm / 2
    where = (axis, -profile.cap / 2)
    return [
        Rule(
            "port bore", ports.bore_mm, profile.chamber_gap, "<=", "mm", "reduce ports.bore_mm", place=where
        ),
        Rule(
            "port bore, distance to the chamber's walls",
            bore_margin,
            0.0,
            ">=",
            "mm",
            "leave ports.axis_mm out, or move it towards the middle of the chamber gap",
            place=where,
        ),
        Rule(
            "port tube wall",
            radius - ports.bore_mm / 2,
            0.3,
            ">=",
            "mm",
            "raise ports.outer_diameter_mm or reduce ports.bore_mm",
            place=where,
        ),
        Rule(
            "port tube diameter",
            2 * radius,
            2 * axis,
            "<=",
            "mm",
            "reduce ports.outer_diameter_mm: the tubes of the two chambers would meet",
            where="between the tubes",
            place=(0.0, -profile.cap / 2),
        ),
        Rule(
            "port tube, outermost",
            axis + radius,
            profile.valley_outside,
            "<=",
            "mm",
            "reduce ports.outer_diameter_mm: the tube would stand out of the cap's flank",
            place=where,
        ),
        Rule(
            "port tube diameter",
            2 * radius,
            profile.height,
            "<=",
            "mm",
            "reduce ports.outer_diameter_mm or raise bellows.height_mm",
            where="across the finger",
            place=where,
        ),
    ]


def _chamber_rules(profile: Profile) -> list[Rule]:
    middle = profile.pitch / 2
    gap_x = (profile.partition_face + profile.valley_inside) / 2
    return [
        Rule(
            "chamber gap",
            profile.chamber_gap,
            0.3,
            ">=",
            "mm",
            "raise bellows.valley_outside_mm, or reduce valley_wall_mm or partition_mm",
            place=(gap_x, 0.0),
        ),
        Rule(
            "chamber height",
            profile.height - 2 * profile.side_wall,
            0.5,
            ">=",
            "mm",
            "raise bellows.height_mm or reduce side_wall_mm",
            place=(gap_x, middle),
        ),
        Rule(
            "fold slot depth",
            profile.slot_end - profile.valley_outside,
            0.3,
            ">=",
            "mm",
            "raise bellows.fold_run_mm or reduce fold_wall_mm",
            place=(profile.slot_end, middle),
        ),
        Rule(
            "fold slot width",
            2 * profile.slot_half_width(profile.slot_end),
            MIN_SLOT_MM,
            ">=",
            "mm",
            "raise bellows.crest_flat_mm or reduce fold_wall_mm",
            where="at the crest",
            place=(profile.slot_end, middle),
        ),
        Rule(
            "valley between slots",
            profile.inner_valley_flat,
            0.4,
            ">=",
            "mm",
            "raise bellows.valley_flat_mm or fold_wall_mm, or reduce valley_wall_mm",
            where="chamber side",
            place=(profile.valley_inside, profile.pitch if profile.units > 1 else 0.0),
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
            place=(profile.crest_outside, profile.pitch / 2),
        ),
        Rule(
            "chamber fillet",
            profile.fillet_chamber,
            max(0.0, 0.49 * chamber / setback),
            "<=",
            "mm",
            "reduce bellows.fillet_chamber_mm or widen the slot",
            place=(profile.slot_end, profile.pitch / 2),
        ),
    ]
