"""The paper's claim about wall thicknesses (C3), and its selection among pitch and walls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tubefoot.study.claims import Claim, verdict_of
from tubefoot.study.curve import Curve
from tubefoot.study.ranking import GROUPS, FloatArray, win_shares
from tubefoot.study.stress_claims import CONCENTRATED, concentration

NEAR = 0.10
"""Share of the thin design's angle within which an angle stays near it."""
VALLEYS = ("valley_right", "valley_left")
WEB = ("partition",)
PLACES = {"valley": VALLEYS, "web": WEB}


def judge_walls(curves: Mapping[str, Curve], figures: Mapping[str, Mapping[str, Any]]) -> Claim:
    """C3: thin, uniform and mixed walls.

    curves : "thin", "uniform", "mixed" to its curve; figures : the same names to the figures of merit
    """
    names = ("thin", "uniform", "mixed")
    numbers: dict[str, float] = {}
    parts: list[bool] = []
    if all(name in figures and "bend_deg_at_35kpa" in figures[name] for name in names):
        bend = {name: float(figures[name]["bend_deg_at_35kpa"]) for name in names}
        stress = {
            place: {name: _highest(figures[name], regions) for name in names}
            for place, regions in PLACES.items()
        }
        zones = curves["thin"].hotspots("von_mises")
        heaped = {place: concentration(zones, regions) for place, regions in PLACES.items()}
        numbers = {f"bend_{name}_deg": bend[name] for name in names}
        for place in PLACES:
            numbers |= {f"von_mises_p99_{place}_{name}_kpa": stress[place][name] for name in names}
            numbers[f"concentration_{place}_thin"] = heaped[place]
        for name in names:
            numbers[f"largest_concentration_{name}"] = float(figures[name]["stress_concentration"])
        parts = [
            bend["thin"] == max(bend.values()),
            all(value >= CONCENTRATED for value in heaped.values()),
            bend["uniform"] < bend["thin"],
            all(stress[place]["uniform"] < stress[place]["thin"] for place in PLACES),
            abs(bend["mixed"] / bend["thin"] - 1.0) <= NEAR,
            all(stress[place]["mixed"] < stress[place]["thin"] for place in PLACES),
        ]
        titles = (
            "thin_bends_most",
            "thin_concentrates_at_valleys_and_web",
            "uniform_bends_less",
            "uniform_lowers_stress",
            "mixed_angle_near_thin",
            "mixed_lowers_stress",
        )
        numbers |= {f"part_{title}": float(part) for title, part in zip(titles, parts, strict=True)}
    return Claim(
        "C3",
        "Thin walls (1.5/1.5/3.0) bend most but concentrate stress at valleys and central web; 2/2/3 lowers "
        "stress and suppresses bending; mixed 1.5/2/2 keeps the angle near thin and spreads the stress",
        "at 35 kPa: thin has the largest angle; of the hottest 5 % of its volume 1.5 times their share of "
        "the volume lies in the valleys and in the web; uniform bends less; the 99th-percentile von Mises "
        "stress of valleys and of the web is lower for uniform than for thin; the mixed angle is within 10 % "
        "of thin; its stress is lower than thin's in valleys and web (each part 1 or 0 among the numbers)",
        verdict_of(parts),
        numbers,
        "walls",
    )


def judge_selection(
    selected: str, names: list[str], groups: FloatArray, weights: FloatArray
) -> tuple[Claim, str]:
    """Whether the selected candidate has the best score, and the reason in a sentence.

    selected : its name; names : of the candidates; groups : (n, 4) scores of the groups; weights : (4,)
    """
    scores = groups @ weights
    shares = win_shares(groups)
    best = int(np.argmax(scores))
    mine = names.index(selected)
    numbers = {f"score_{name}": float(score) for name, score in zip(names, scores, strict=True)}
    numbers |= {f"wins_{name}": float(share) for name, share in zip(names, shares, strict=True)}
    if best == mine:
        ahead = np.argsort(-scores)[1] if len(names) > 1 else mine
        reason = (
            f"{selected} scores best, before {names[ahead]}: {_contributions(groups, weights, mine, ahead)}"
        )
    else:
        reason = (
            f"{names[best]} scores {scores[best] - scores[mine]:+.3f} against {selected}: "
            f"{_contributions(groups, weights, best, mine)}"
        )
    reason += f"; {selected} scores best under {100 * shares[mine]:.0f} % of all weightings"
    claim = Claim(
        "selection",
        f"The candidate {selected} is the best compromise of bending, stress, sealing and footprint",
        "it has the highest score among the candidates that can be printed, with the study's weights; wins: "
        "share of all weightings under which a candidate is best",
        "holds" if best == mine else "refuted",
        numbers,
        "walls",
    )
    return claim, reason


def _contributions(groups: FloatArray, weights: FloatArray, one: int, other: int) -> str:
    """What each group adds to the score of one candidate over another's."""
    gained = weights * (groups[one] - groups[other])
    return ", ".join(f"{name} {value:+.3f}" for name, value in zip(GROUPS, gained, strict=True))


def _highest(figures: Mapping[str, Any], regions: tuple[str, ...]) -> float:
    return max(float(figures[f"von_mises_p99_{region}_kpa"]) for region in regions)
