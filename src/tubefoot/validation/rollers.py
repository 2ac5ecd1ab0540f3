"""Where the pump's rollers stood: the search for its ripple in the pressures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.validation.fit_problem import FitProblem

FloatArray = NDArray[np.float64]

ROLLERS_TRIED: FloatArray = np.array([0.72 * 1.02**k for k in range(30)])
"""Volumes between two rollers at which ripple is looked for, over the prior's middle."""
ROLLERS_FAR: FloatArray = np.array([0.6 * 1.02**k for k in range(65)])
"""The same where flows fitted without ripple may be off to half or twice the true ones."""
TRIED_UL = 4.0
"""Amplitude with which its effect is found: it is linear [mm^3]."""
LARGE = ("_1_ul", "_2_ul")
"""The harmonics by which it is found."""
LOOKED_AT = 70
"""Pulses in which ripple is looked for: enough to see it, few enough for a coarse search."""


def with_rollers(problem: FitProblem, x: FloatArray, tried: FloatArray = ROLLERS_TRIED) -> FloatArray:
    """Inner values with the pump's ripple found: the volume between two rollers at which it explains most.

    A search by derivatives does not find a phase that is many turns off. The flows are wrong by some per cent
    at first, and the volume between rollers takes that up: it starts where flow over volume is right.

    problem : of one or several recordings; x : (p,) inner values of a fit without ripple
    tried : volumes between two rollers over the prior's middle
    """
    names = [unknown.name for unknown, _ in problem.columns]
    if not any(name.startswith("ripple") for name in names):
        return x
    column = names.index("roller_volume_ml") if "roller_volume_ml" in names else None
    x, found = x.copy(), []
    x[[k for k, name in enumerate(names) if name.startswith("ripple")]] = 0.0
    base = [problem.residuals(x, which) for which in range(len(problem.observations))]
    for factor in tried if column is not None else (1.0,):
        if column is not None:
            x[column] = problem.middle[column] + np.log(factor)
        gain = 0.0
        amplitudes: dict[int, float] = {}
        for which in range(len(problem.observations)):
            saved, best = _ripple_of(problem, x, which, base[which])
            gain += saved
            amplitudes |= best
        found.append((gain, x.copy(), amplitudes))
    _, x, chosen = max(found, key=lambda entry: entry[0])
    for k, value in chosen.items():
        x[k] = value
    return np.clip(x, problem.low + 1e-9, problem.high - 1e-9)


def _ripple_of(
    problem: FitProblem, x: FloatArray, which: int, base: FloatArray
) -> tuple[float, dict[int, float]]:
    """What the best ripple saves of the squared pressure residuals of the early pulses, and its amplitudes.

    base : residuals of the recording without ripple
    """
    seen = problem.observations[which]
    early = np.concatenate([seen.right.pulse < LOOKED_AT, seen.left.pulse < LOOKED_AT])
    columns = [
        k
        for k, (unknown, owner) in enumerate(problem.columns)
        if unknown.name.startswith("ripple") and unknown.name.endswith(LARGE) and owner in (-1, which)
    ]
    effects = []
    for k in columns:
        moved = x.copy()
        moved[k] = TRIED_UL
        change = (problem.residuals(moved, which) - base)[: len(early)]
        effects.append(change[early] / TRIED_UL)
    wanted, matrix = -base[: len(early)][early], np.array(effects).T
    best, *_ = np.linalg.lstsq(matrix, wanted, rcond=None)
    saved = float(wanted @ wanted - ((wanted - matrix @ best) ** 2).sum())
    return saved, dict(zip(columns, map(float, best), strict=True))
