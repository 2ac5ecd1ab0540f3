"""Claims C5, C6 and C9 of the paper, judged on recordings and what was predicted for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tubefoot.study.claims import Claim, verdict_of
from tubefoot.validation.overlay import Comparison, Points
from tubefoot.validation.settled import SettledState
from tubefoot.validation.spread import Estimate

INVERSE_SHARE = 0.95
"""Share of the steps of loading in which the other pressure must fall."""
LEAST_R_SQUARED = 0.99
LARGEST_RATIO = 0.95
"""Of measured to predicted, below which an offset counts: a virtual bench without any of the causes shows
ratios of 0.99 to 1.04, by the finger's weight and the error of the reduced one (docs/verification.md)."""
FIGURE = "validation"


def judge_recordings(
    comparisons: Sequence[Comparison], states: Mapping[str, Sequence[SettledState]]
) -> list[Claim]:
    """C5, C6 and C9 on the recordings.

    comparisons : one for each recording
    states : settled, by the recording's name
    """
    return [
        judge_inverse_pressures(comparisons, states),
        judge_linearity(comparisons),
        judge_offsets(comparisons),
    ]


def judge_inverse_pressures(
    comparisons: Sequence[Comparison], states: Mapping[str, Sequence[SettledState]]
) -> Claim:
    """C5: the measured pressures move against each other.

    comparisons : one for each recording
    states : settled, by the recording's name
    """
    numbers: dict[str, float] = {}
    parts = []
    for one in comparisons:
        slope, share = one.figures["coupling_slope"], falling_share(states[one.recording])
        numbers |= _interval(f"slope_{one.recording}", slope)
        numbers[f"predicted_slope_{one.recording}"] = one.predicted["coupling_slope"]
        numbers[f"falling_share_{one.recording}"] = share
        parts.append(slope.high < 0 and share >= INVERSE_SHARE)
    return Claim(
        "C5",
        "The two chambers show an inverse pressure relation during cyclic actuation (measured)",
        "in every recording the slope of P_left over P_right is below zero with its whole 95 % interval, and "
        f"P_left falls in at least {INVERSE_SHARE:.0%} of the steps in which P_right rises",
        verdict_of(parts),
        numbers,
        FIGURE,
    )


def judge_linearity(comparisons: Sequence[Comparison]) -> Claim:
    """C6: the measured angle is linear in the pressed pressure.

    comparisons : one for each recording
    """
    numbers: dict[str, float] = {}
    parts = []
    for one in comparisons:
        r_squared = one.figures["angle_r_squared"]
        numbers |= _interval(f"r_squared_{one.recording}", r_squared)
        numbers[f"pooled_r_squared_{one.recording}"] = one.figures["angle_pooled_r_squared"].value
        numbers[f"slope_{one.recording}_deg_per_kpa"] = one.figures["angle_slope_deg_per_kpa"].value
        numbers[f"largest_deviation_{one.recording}_deg"] = one.figures["angle_deviation_deg"].value
        parts.append(r_squared.value >= LEAST_R_SQUARED)
    return Claim(
        "C6",
        "The bend angle is linear in P_right (measured)",
        "in every recording the loading strokes have an R squared of at least "
        f"{LEAST_R_SQUARED:g} about lines of one slope, each stroke with its own offset",
        verdict_of(parts),
        numbers,
        FIGURE,
    )


def judge_offsets(comparisons: Sequence[Comparison]) -> Claim:
    """C9, its signs: angles below the prediction, suction smaller than predicted.

    comparisons : one for each recording
    """
    numbers: dict[str, float] = {}
    parts = []
    for one in comparisons:
        angle, suction = one.figures["angle_offset_high_deg"], one.figures["suction_offset_high_kpa"]
        numbers |= _interval(f"angle_offset_{one.recording}_deg", angle)
        numbers |= _interval(f"suction_offset_{one.recording}_kpa", suction)
        ratios = {kind: one.figures[f"{kind}_ratio_high"] for kind in ("angle", "suction")}
        for kind, ratio in ratios.items():
            numbers |= _interval(f"{kind}_ratio_{one.recording}", ratio)
        parts += [ratio.high < LARGEST_RATIO for ratio in ratios.values()]
    return Claim(
        "C9",
        "Experiments lie below FEA in angle, and the measured negative pressure is smaller than predicted",
        "at high loads (above two thirds of the largest pressure) angle and suction are less than "
        f"{LARGEST_RATIO:.0%} of the prediction at the same pressure, with their whole 95 % intervals, in "
        "every recording",
        verdict_of(parts),
        numbers,
        FIGURE,
    )


def falling_share(states: Sequence[SettledState]) -> float:
    """Share of the steps of loading in which the other pressure falls while one rises; nan without any.

    states : settled, of one recording
    """
    points = Points.of(states)
    falls = [
        other < 0
        for stroke in points.strokes(np.ones(len(points.pressed), dtype=bool))
        for pressed, other in zip(np.diff(points.pressed[stroke]), np.diff(points.other[stroke]), strict=True)
        if pressed > 0
    ]
    return float(np.mean(falls)) if falls else float("nan")


def _interval(name: str, estimate: Estimate) -> dict[str, float]:
    return {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
