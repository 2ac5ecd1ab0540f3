"""The fast first look: a short finger on a coarse mesh, calibrated against full solves.

A unit in the middle of a finger bends as its neighbours do, so two units say about all of it; what caps, mesh
and length add is a factor that designs share. For a figure x of a design with n units

    ln(x_full / x_look) = a + b ln(n / n_look) + error

(angles and gains are first multiplied by n / n_look). a, and b where lengths differ, are fitted by least
squares to a few candidates that were solved in full; the error is that of leaving one of them out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.candidates import Candidate
from tubefoot.study.ranking import FloatArray
from tubefoot.study.study_file import LookSettings, StudyFile

GROWS_WITH_LENGTH = ("bend_deg_at_35kpa", "gain_deg_per_kpa", "pumped_volume_ml")
LOOKED = (
    *GROWS_WITH_LENGTH,
    "von_mises_p99_kpa",
    "von_mises_p99_at_angle_kpa",
    "stress_concentration",
    "seam_s33_p99_kpa",
)
"""Figures that a look foretells; the others follow from the design alone, or need a full solve."""


def look_solve(study: StudyFile) -> SolveSettings:
    """How a look is solved.

    study : its settings of the look and of the full solve
    """
    changes = {"element_size_mm": study.look.element_size_mm, "states": study.look.states, "fields": "none"}
    return study.solve.model_copy(update=changes)


def short_candidate(candidate: Candidate, look: LookSettings) -> Candidate:
    """The short finger that stands for a candidate.

    candidate : the whole one; look : how many units
    """
    bellows = {**candidate.tables["bellows"], "units": look.units}
    return Candidate(
        candidate.name, candidate.values, {**candidate.tables, "bellows": bellows}, candidate.comparison
    )


@dataclass(frozen=True)
class Pair:
    """A candidate seen both ways: its units, figures of the look (lengths applied) and of the full solve."""

    units: int
    looked: FloatArray
    solved: FloatArray


@dataclass(frozen=True)
class Calibration:
    """Factors from look to full solve, and how far they can be trusted.

    factors : (2, n_figures) a and b of each figure; look_units : n_look
    errors : (n_pairs, n_figures) ln(foretold / solved) of each pair when it is left out
    rank_correlation : Spearman's, of the bend angle so foretold
    """

    factors: FloatArray
    look_units: int
    errors: FloatArray
    rank_correlation: float

    @property
    def spread(self) -> FloatArray:
        """Standard deviation of the logarithmic error of each figure, (n_figures,)."""
        return np.sqrt(np.nanmean(self.errors**2, axis=0))

    def foretell(self, units: int, looked: FloatArray) -> dict[str, float]:
        """Figures that a full solve would give.

        units : of the whole finger; looked : (n_figures,) of its look
        """
        length = np.array([1.0, math.log(units / self.look_units)])
        return dict(zip(LOOKED, (looked * np.exp(length @ self.factors)).tolist(), strict=True))

    def summary(self) -> dict[str, Any]:
        """The errors in percent, for people and for summary.json."""
        percent = 100.0 * np.expm1(np.abs(self.errors))
        return {
            "pairs": len(self.errors),
            "rank_correlation_bend": self.rank_correlation,
            **{
                name: {
                    "median_error_percent": float(np.nanmedian(percent[:, k])),
                    "largest_error_percent": float(np.nanmax(percent[:, k])),
                    "factor": float(np.exp(self.factors[0, k])),
                }
                for k, name in enumerate(LOOKED)
                if np.isfinite(percent[:, k]).any()
            },
        }


def looked_figures(figures: Mapping[str, Any], units: int, look: LookSettings) -> FloatArray:
    """The figures of a look, angles and gains scaled to the candidate's length, (n_figures,).

    figures : of the short finger; units : of the candidate; look : length of the short one
    """
    lengths = units / look.units
    return np.array(
        [_number(figures.get(name)) * (lengths if name in GROWS_WITH_LENGTH else 1.0) for name in LOOKED]
    )


def solved_figures(figures: Mapping[str, Any]) -> FloatArray:
    """The same figures of a full solve, (n_figures,).

    figures : of the candidate
    """
    return np.array([_number(figures.get(name)) for name in LOOKED])


def spread_over(values: FloatArray, count: int) -> list[int]:
    """Numbers of candidates that span the range of a figure evenly by rank, ends among them.

    values : (n,) of the figure, NaN where it is missing; count : how many, or all that there are
    """
    order = np.argsort(values)[: int(np.isfinite(values).sum())]
    if len(order) <= count:
        return [int(k) for k in order]
    return [int(order[k]) for k in np.unique(np.round(np.linspace(0, len(order) - 1, count)).astype(int))]


def calibrate(pairs: Sequence[Pair], look: LookSettings) -> Calibration:
    """The factors that fit some pairs best, with the error at each pair when it is left out.

    pairs : three at least; look : length of the short finger
    """
    lengths = np.log([pair.units / look.units for pair in pairs])
    ratios = np.log([pair.solved / pair.looked for pair in pairs])
    errors = np.full_like(ratios, np.nan)
    for k in range(len(pairs)):
        others = np.arange(len(pairs)) != k
        factors = _fit(lengths[others], ratios[others])
        errors[k] = factors[0] + factors[1] * lengths[k] - ratios[k]
    solved = np.array([pair.solved[0] for pair in pairs])
    return Calibration(
        _fit(lengths, ratios), look.units, errors, _rank_correlation(solved * np.exp(errors[:, 0]), solved)
    )


def _fit(lengths: FloatArray, ratios: FloatArray) -> FloatArray:
    """a and b of each column, (2, n_figures); b is 0 where all lengths are equal."""
    factors = np.zeros((2, ratios.shape[1]))
    for k, column in enumerate(ratios.T):
        known = np.isfinite(column)
        if not known.any():
            factors[0, k] = np.nan
        elif np.ptp(lengths[known]) < 1e-9:
            factors[0, k] = column[known].mean()
        else:
            factors[1, k], factors[0, k] = np.polyfit(lengths[known], column[known], 1)
    return factors


def _rank_correlation(foretold: FloatArray, solved: FloatArray) -> float:
    from scipy.stats import spearmanr

    known = np.isfinite(foretold) & np.isfinite(solved)
    return float(spearmanr(foretold[known], solved[known]).statistic) if known.sum() > 2 else math.nan


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
