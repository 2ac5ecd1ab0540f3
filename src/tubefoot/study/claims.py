"""The paper's claims, judged on computed runs: numbers, the rule they are held against, and the verdict.

A claim that the numbers contradict is reported as refuted; the rules are fixed here and not per run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from tubefoot.study.curve import Curve, line_fit

Verdict = Literal["holds", "refuted", "mixed", "not computed"]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper and what was found.

    statement : the claim; rule : when it holds; numbers : what was computed; figure : file that shows it
    """

    id: str
    statement: str
    rule: str
    verdict: Verdict
    numbers: dict[str, float] = field(default_factory=dict)
    figure: str = ""

    def as_record(self) -> dict[str, Any]:
        """The claim as it stands in claims.json."""
        return asdict(self)


def verdict_of(parts: Iterable[bool]) -> Verdict:
    """The verdict on a claim of several parts: holds when all do, mixed when some do.

    parts : whether each part holds; none at all means that nothing was computed
    """
    found = list(parts)
    if not found:
        return "not computed"
    return "holds" if all(found) else "mixed" if any(found) else "refuted"


def join_claims(solved: Iterable[Claim], seen: Iterable[Claim]) -> list[Claim]:
    """Claims of two origins; one that both judged holds only where both say so.

    solved : by finite elements; seen : on the bench
    """
    joined = {claim.id: claim for claim in solved}
    for claim in seen:
        first = joined.get(claim.id)
        if first is None:
            joined[claim.id] = claim
            continue
        joined[claim.id] = replace(
            first,
            rule=f"{first.rule}; on the bench: {claim.rule}",
            verdict=first.verdict if first.verdict == claim.verdict else "mixed",
            numbers=first.numbers | {f"bench_{key}": value for key, value in claim.numbers.items()},
        )
    return list(joined.values())


def judge_pitch(curves: Mapping[str, Curve]) -> Claim:
    """C1: which pitch has the highest pressure-angle gain.

    curves : pitch ("3/15", "3/12", "3/9") to its curve
    """
    gains = {pitch: line_fit(*curve.up_to_reference("pressure_right_kpa", "bend_deg"))[0]
             for pitch, curve in curves.items()}  # fmt: skip
    best = max(gains, key=lambda pitch: gains[pitch])
    return Claim(
        "C1",
        "Among tan(alpha) = 3/15, 3/12, 3/9 the 3/15 finger has the highest pressure-angle gain",
        "the least-squares slope of bend angle over P_right, 0 to 35 kPa, is largest for 3/15",
        "holds" if best == "3/15" else "refuted",
        {f"gain_{pitch}_deg_per_kpa": gain for pitch, gain in gains.items()},
        "pressure-angle",
    )


def judge_length(three: Curve, six: Curve) -> Claim:
    """C4: six units against three.

    three, six : curves of the reference fingers
    """
    angles = {3: three.at_reference("bend_deg"), 6: six.at_reference("bend_deg")}
    per_unit = {n: angle / n for n, angle in angles.items()}
    variation = {}
    for n, curve in ((3, three), (6, six)):
        stress = curve.unit_stress()
        variation[n] = float(stress.std() / stress.mean())
    more = angles[6] > angles[3]
    comparable = abs(per_unit[6] / per_unit[3] - 1.0) <= 0.15
    uniform = variation[6] < variation[3]
    return Claim(
        "C4",
        "Six units bend more than three at the same pressure, are comparable per unit length, and have "
        "more uniform stress",
        "at 35 kPa: larger angle; angle per unit within 15 %; smaller coefficient of variation of the "
        "99th-percentile von Mises stress between units",
        verdict_of([more, comparable, uniform]),
        {
            "bend_3_units_deg": angles[3],
            "bend_6_units_deg": angles[6],
            "bend_per_unit_3_deg": per_unit[3],
            "bend_per_unit_6_deg": per_unit[6],
            "stress_variation_3": variation[3],
            "stress_variation_6": variation[6],
        },
        "pressure-angle",
    )


def judge_inverse_pressures(curves: Mapping[str, Curve]) -> Claim:
    """C5: the two chambers' pressures move against each other.

    curves : name to curve
    """
    numbers: dict[str, float] = {}
    inverse = []
    for name, curve in curves.items():
        right, left = curve.up_to_reference("pressure_right_kpa", "pressure_left_kpa")
        slope, r_squared, _ = line_fit(right, left)
        numbers |= {f"slope_{name}": slope, f"r_squared_{name}": r_squared}
        inverse.append(bool((np.diff(left) < 0).all() and (np.diff(right) > 0).all()))
    return Claim(
        "C5",
        "The two chambers show an inverse pressure relation during cyclic actuation",
        "P_left falls whenever P_right rises, at every state up to 35 kPa",
        verdict_of(inverse),
        numbers,
        "pressure-pressure",
    )


def judge_linearity(curves: Mapping[str, Curve]) -> Claim:
    """C6: the bend angle is linear in the right pressure.

    curves : name to curve
    """
    numbers: dict[str, float] = {}
    linear = []
    for name, curve in curves.items():
        pressure, bend = curve.up_to_reference("pressure_right_kpa", "bend_deg")
        slope, r_squared, deviation = line_fit(pressure, bend)
        numbers |= {
            f"slope_{name}_deg_per_kpa": slope,
            f"r_squared_{name}": r_squared,
            f"largest_deviation_{name}_deg": deviation,
        }
        linear.append(r_squared >= 0.99)
    return Claim(
        "C6",
        "The bend angle is linear in P_right",
        "R squared of the least-squares line over 0 to 35 kPa is at least 0.99",
        verdict_of(linear),
        numbers,
        "pressure-angle",
    )


def judge_reversal(forward: Curve, backward: Curve) -> Claim:
    """C10: reversing the pump bends the other way.

    forward, backward : the same finger, pumped to the right and to the left by the same path
    """
    pairs = (("bend_deg", "bend_deg", -1), ("pressure_right_kpa", "pressure_left_kpa", 1))
    numbers = {}
    for name, mirrored, sign in pairs:
        a, b = forward.column(name), sign * backward.column(mirrored)
        n = min(len(a), len(b))
        numbers[f"largest_difference_{name}"] = float(np.abs(a[:n] - b[:n]).max())
        numbers[f"range_{name}"] = float(np.ptp(a[:n]))
    opposite = backward.column("bend_deg")[-1] < 0 < forward.column("bend_deg")[-1]
    same = all(
        numbers[f"largest_difference_{name}"] <= 1e-6 * numbers[f"range_{name}"] for name, _, _ in pairs
    )
    return Claim(
        "C10",
        "Reversing the pump bends the other way, without valves",
        "pumping the other way turns the bend angle's sign and mirrors every state within 1e-6 of the range",
        "holds" if opposite and same else "refuted",
        numbers,
        "volume-angle",
    )


FILTER_TOLERANCE = 0.05
"""Largest deviation from the coupled path, over its value, at which the filter still approximates it."""


def judge_filter(filtered: Curve, coupled: Curve) -> Claim:
    """C7: states of a pressure grid, filtered by their volume changes, against the directly coupled path.

    filtered : accepted states of a grid; coupled : the same finger and mesh, pumped
    """
    right = filtered.column("pressure_right_kpa")
    at = right[(right > 0) & (right <= coupled.column("pressure_right_kpa").max() + 1e-6)]
    numbers: dict[str, float] = {"accepted_states": float(len(at))}
    near = []
    for name in ("bend_deg", "pressure_left_kpa"):
        path = np.interp(at, coupled.column("pressure_right_kpa"), coupled.column(name))
        found = filtered.column(name)[np.isin(right, at)]
        share = np.abs(found / path - 1.0)
        numbers[f"largest_difference_{name}"] = float(np.abs(found - path).max(initial=0.0))
        numbers[f"largest_difference_{name}_percent"] = float(100.0 * share.max(initial=0.0))
        near.append(bool((share <= FILTER_TOLERANCE).all()))
    return Claim(
        "C7",
        "Independent pressure-driven states, filtered by opposite-signed volume changes with < 3 % "
        "mismatch, approximate the cyclic loop",
        f"at the same P_right every accepted state lies within {FILTER_TOLERANCE:.0%} of the coupled path in "
        "angle and in P_left",
        verdict_of(near) if len(at) else "not computed",
        numbers,
        "pressure-pressure",
    )
