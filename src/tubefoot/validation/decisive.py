"""What a bench should measure next: how much each further measurement would narrow the seam and its effect.

A measurement is one more row in the information matrix of a fit: what it depends on, over its uncertainty. No
recording is needed to know what it would be worth.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.validation.attribution import TOP, state_at
from tubefoot.validation.bench_fit import BenchFit
from tubefoot.validation.fit_problem import FitProblem

FloatArray = NDArray[np.float64]

MEASUREMENTS: dict[str, tuple[dict[str, float], ...]] = {
    "tensile coupon printed beside the finger, modulus to 3 %": ({"scale": 1 / 0.03},),
    "relaxation of that coupon, strength to 3 %, times to 10 %": (
        {"relaxation_strength": 1 / 0.03},
        {"relaxation_time": 1 / 0.10},
    ),
    "weight hung at the tip, stiffness against bending to 2 %": ({"scale": 1 / 0.02, "seam*": 1 / 0.02},),
    "air columns measured with a syringe to 2 %": ({"air_right_ml": 1 / 0.02}, {"air_left_ml": 1 / 0.02}),
    "pump weighed out to 1 %": ({"flow_forward_ml_per_s": 1 / 0.01}, {"flow_reverse_ml_per_s": 1 / 0.01}),
    "finger filled under vacuum, bubbles below 0.01 ml": (
        {"bubble_right_ml": 1 / 0.005},
        {"bubble_left_ml": 1 / 0.005},
    ),
    "the same finger printed in one piece, stiffness to 3 %": ({"scale": 1 / 0.03}, {"seam*": 1 / 0.042}),
}
"""Rows in the logarithms (bubbles in ml) of the unknowns; `seam*` is the logarithm of 1 + seam."""


def decisive_rows(problem: FitProblem, fit: BenchFit, top: float = TOP) -> list[dict[str, Any]]:
    """Rows of decisive.csv: standard deviations of seam, scale and of the seam's effect with each
    measurement.

    problem, fit : of the recordings; the measurements are made on the first one's finger
    top : pressure of the right branch at which the effect is taken [MPa]
    """
    names = [unknown.name for unknown, _ in problem.columns]
    values = fit.values(problem.observations[0].name)
    slope = _effect_slope(problem, values, top)
    information = np.linalg.inv(fit.covariance)
    rows = []
    for what, measured in {"recordings alone": (), **MEASUREMENTS}.items():
        more = information.copy()
        for row in measured:
            line = np.zeros(len(names))
            for key, weight in row.items():
                if key == "seam*":
                    line[names.index("seam")] = weight / (1.0 + values["seam"])
                elif key in names:
                    line[names.index(key)] = weight
            more += np.outer(line, line)
        covariance = np.linalg.inv(more)
        rows.append(
            {
                "measurement": what,
                "seam_sigma": float(np.sqrt(covariance[names.index("seam"), names.index("seam")])),
                "scale_sigma": float(np.sqrt(covariance[names.index("scale"), names.index("scale")])),
                "seam_effect_sigma_deg": float(np.sqrt(slope @ covariance @ slope)),
            }
        )
    return rows


def _effect_slope(problem: FitProblem, values: Mapping[str, float], top: float) -> FloatArray:
    """Derivatives of the seam's effect on the angle [deg] by the inner unknowns, (p,)."""
    bench, relaxation = problem.benches[0], problem.relaxation

    def effect(of: Mapping[str, float]) -> float:
        with_seam = state_at(of, bench, relaxation, top).in_units()[0]
        return with_seam - state_at({**of, "seam": 0.0}, bench, relaxation, top).in_units()[0]

    slope, base = np.zeros(len(problem.columns)), effect(values)
    for k, (unknown, owner) in enumerate(problem.columns):
        if unknown.nuisance or owner > 0:
            continue
        step = 0.02 * unknown.sigma
        moved = unknown.outer(unknown.inner(values[unknown.name]) + step)
        slope[k] = (effect({**values, unknown.name: moved}) - base) / step
    return slope
