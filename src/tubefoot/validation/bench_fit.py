"""Parameters of bench and finger from recordings: least squares with priors and bounds, and what is
identified.

The misfit is sum ((model - mean) / sigma)^2 over all windows plus sum ((x - middle) / sigma)^2 over the
priors. A lean model leaves residuals that are larger than the noise and alike from window to window; so after
a first fit the sizes of its own errors are found (`discrepancy.py`), and the fit is repeated with their
covariance. Covariance: (J'J + priors)^-1 at the end. What the data add to the priors is 1 - (sigma after
/ sigma before)^2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_parameters import MAIN
from tubefoot.validation.fit_problem import FitProblem
from tubefoot.validation.rollers import ROLLERS_FAR, with_rollers
from tubefoot.validation.search import COARSE, search

FloatArray = NDArray[np.float64]

ROUGH, ROUGH_STEPS = 5.0, 6
"""Of the search before the rollers are looked for."""
LATER = ("bubble", "tube", "relaxation", "fast_loss", "ripple", "lost_time", "pressure_late")
"""Unknowns that it leaves at their priors' middles."""
ALIKE = 0.8
"""Correlation from which on two unknowns count as not told apart."""
GOALS = {"scale": 0.05, "seam": 0.20, "air_right_ml": 0.15, "air_left_ml": 0.15}
"""Half of the 95 % interval over the value up to which an unknown is identified; 0.2 for the others."""
OTHER_GOAL = 0.20
SIGMAS_95 = 1.96
"""Half of a 95 % interval in standard deviations."""
FAR_MPA = 0.15 * KPA
"""Root mean square difference of a first pass above which its rollers may be wrong."""
DOUBTFUL_MPA, DOUBTFUL_RAD = 0.5 * KPA, 0.3 * DEG
"""Root mean square differences from which on a fit is doubtful: ten times what virtual benches leave."""


@dataclass(frozen=True)
class Estimate:
    """One unknown after the fit.

    name : of the unknown; recording : it belongs to, empty where it is shared
    value : in its unit; low, high : 95 % interval, within the physical bounds
    relative_sigma : standard deviation over the value
    learnt : share of the prior's variance that the data took away
    identified : whether the 95 % interval is within the goal about the value, not one standard deviation only
    mixed_with : unknowns that the data do not tell from it, with the correlation
    """

    name: str
    recording: str
    value: float
    low: float
    high: float
    relative_sigma: float
    learnt: float
    identified: bool
    mixed_with: Mapping[str, float]


@dataclass(frozen=True)
class BenchFit:
    """The result of a fit.

    estimates : of all unknowns; covariance : (p, p) of the inner values, in the order of `estimates`
    jacobian : (n, p) of the weighted residuals, priors not among them
    misfit : root mean square of residuals over their first uncertainties: right, left, angle
    off : root mean square differences: right, left [MPa], angle [rad]; nan for angles that were not recorded
    converged : whether the search ended by itself; evaluations : courses computed
    fixed : values of unknowns that were not fitted
    """

    estimates: tuple[Estimate, ...]
    covariance: FloatArray
    jacobian: FloatArray
    misfit: tuple[float, float, float]
    off: tuple[float, float, float]
    converged: bool
    evaluations: int
    fixed: Mapping[str, float]

    def values(self, recording: str) -> dict[str, float]:
        """Values of all unknowns of one recording.

        recording : its name
        """
        fitted = {each.name: each.value for each in self.estimates if each.recording in ("", recording)}
        return {**self.fixed, **fitted}

    @property
    def doubtful(self) -> bool:
        """Whether the model stays so far off that the search may have ended in a wrong place."""
        right, left, angle = self.off
        return max(right, left) > DOUBTFUL_MPA or angle > DOUBTFUL_RAD

    def of(self, name: str) -> Estimate:
        """The first estimate of a name.

        name : of the unknown
        """
        return next(each for each in self.estimates if each.name == name)


def fit_bench(problem: FitProblem, say: Callable[[str], None] = lambda _: None) -> BenchFit:
    """The most probable values and what the recordings say about each.

    problem : recordings and priors; say : told of each step

    Raises ConvergenceError when the lean bench finds no balance at the start.
    """
    rough = _rough(problem)
    found = search(problem, with_rollers(problem, rough), COARSE)
    say(f"first pass: {found.steps} steps")
    if max(_differences(problem, found.x)[:2]) > FAR_MPA:
        wider = search(problem, with_rollers(problem, rough, ROLLERS_FAR), COARSE)
        say(f"rollers looked for once more, farther off: {wider.steps} steps")
        found = min(found, wider, key=lambda each: each.cost)
    first = _misfits(problem, found.x)
    problem.weigh(found.x)
    found = search(problem, found.x)
    x = found.x
    say(f"second pass: {found.steps} steps")
    rows = problem.jacobian(x)
    information = rows.T @ rows
    covariance: FloatArray = np.asarray(np.linalg.inv(information), float)
    return BenchFit(
        _estimates(problem, x, covariance),
        covariance,
        rows[: -len(x)],
        first,
        _differences(problem, x),
        found.converged,
        problem.evaluations,
        problem.fixed,
    )


def calibrate(problem: FitProblem) -> FloatArray:
    """Inner values of a fit whose print and bench are known, without uncertainties.

    problem : with those unknowns fixed
    """
    return search(problem, with_rollers(problem, _rough(problem))).x


def _rough(problem: FitProblem) -> FloatArray:
    """Inner values near enough to look for the rollers: what is told apart only later stays at its prior.

    Without ripple the pulses are wrong by some per cent, and an air column and its bubble, alike but for
    their delay, would make up for it far from where they belong; from there the way back is a long one.
    """
    held, free = problem, np.ones(len(problem.columns), bool)
    for k, (unknown, _) in enumerate(problem.columns):
        if unknown.name.startswith(LATER):
            free[k] = False
            if unknown.name in (entry.name for entry, _ in held.columns):
                held = held.holding(unknown.name, unknown.outer(unknown.middle))
    x = problem.start()
    x[free] = search(held, held.start(), ROUGH, ROUGH_STEPS).x
    return x


def _misfits(problem: FitProblem, x: FloatArray) -> tuple[float, float, float]:
    return _root_mean_squares(problem, x, weighted=True)


def _differences(problem: FitProblem, x: FloatArray) -> tuple[float, float, float]:
    return _root_mean_squares(problem, x, weighted=False)


def _root_mean_squares(problem: FitProblem, x: FloatArray, weighted: bool) -> tuple[float, float, float]:
    """Over all windows of right, left, angle."""
    squares: list[list[FloatArray]] = [[], [], []]
    for which, seen in enumerate(problem.observations):
        model = problem.measured(x, which, problem.course(x, which))
        for kind, (mean, data) in enumerate(zip(model, (seen.right, seen.left, seen.angle), strict=True)):
            squares[kind].append((mean - data.values) / (data.sigma if weighted else 1.0))
    right, left, angle = (root_mean_square(np.concatenate(part)) for part in squares)
    return right, left, angle


def root_mean_square(values: FloatArray) -> float:
    """Root mean square, nan of no values.

    values : (n,) of any unit
    """
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _estimates(problem: FitProblem, x: FloatArray, covariance: FloatArray) -> tuple[Estimate, ...]:
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    found = []
    for k, (unknown, owner) in enumerate(problem.columns):
        value = unknown.outer(float(x[k]))
        ends = [unknown.outer(float(x[k] + side * SIGMAS_95 * sigma[k])) for side in (-1, 1)]
        low, high = max(ends[0], unknown.low), min(ends[1], unknown.high)
        relative = sigma[k] if unknown.kind == "log" else sigma[k] / max(abs(value), 1e-9)
        mixed = {
            _label(problem, other): round(float(correlation[k, other]), 3)
            for other in np.argsort(-np.abs(correlation[k]))
            if other != k and abs(correlation[k, other]) >= ALIKE
        }
        learnt = 1.0 - float(sigma[k] / problem.spread[k]) ** 2
        goal = GOALS.get(unknown.name, OTHER_GOAL)
        recording = problem.observations[owner].name if owner >= 0 else ""
        found.append(
            Estimate(
                unknown.name,
                recording,
                value,
                low,
                high,
                float(relative),
                learnt,
                bool(SIGMAS_95 * relative <= goal),
                mixed,
            )
        )
    return tuple(found)


def _label(problem: FitProblem, column: int) -> str:
    unknown, owner = problem.columns[column]
    return unknown.name if owner < 0 else f"{unknown.name} ({problem.observations[owner].name})"


def identified_combinations(fit: BenchFit, problem: FitProblem) -> list[dict[str, Any]]:
    """Combinations of the main unknowns, best known first: what the data say of each, beyond the priors.

    fit : the result; problem : what was fitted

    `ratio` is standard deviation after over before the data; 1 means that nothing was learnt. Nuisances are
    eliminated.
    """
    main = [k for k, (unknown, _) in enumerate(problem.columns) if unknown.name in MAIN]
    spread = problem.spread[main]
    inside = fit.covariance[np.ix_(main, main)] / np.outer(spread, spread)
    variances, directions = np.linalg.eigh(inside)
    return [
        {
            "ratio": float(np.sqrt(variance)),
            "weights": {
                _label(problem, main[k]): round(float(weight), 3)
                for k, weight in enumerate(direction)
                if abs(weight) >= 0.15
            },
        }
        for variance, direction in zip(variances, directions.T, strict=True)
    ]


def profile(
    problem: FitProblem, fit: BenchFit, name: str, values: Sequence[float]
) -> list[tuple[float, float]]:
    """Misfit (sum of squares above the least) with one unknown held, all others fitted anew.

    problem : what was fitted, its uncertainties as the fit left them; fit : the result
    name : of an unknown that was fitted, held alike in all recordings; values : at which, in its unit

    A rise of 3.84 bounds the 95 % interval. Raises ConvergenceError when the lean bench finds no balance.
    """
    columns = [k for k, (unknown, _) in enumerate(problem.columns) if unknown.name == name]
    unknown = problem.columns[columns[0]][0]
    best = {(each.name, each.recording): each.value for each in fit.estimates}
    costs = []
    for value in [fit.of(name).value, *values]:
        held = problem.holding(name, value)
        start = np.array(
            [
                each.inner(best[each.name, problem.observations[owner].name if owner >= 0 else ""])
                for each, owner in held.columns
            ]
        )
        start = np.clip(start, held.low + 1e-9, held.high - 1e-9)
        prior = (unknown.inner(value) - problem.middle[columns]) / problem.spread[columns]
        costs.append(2.0 * float(search(held, start).cost) + float(prior @ prior))
    return [(float(value), cost - costs[0]) for value, cost in zip(values, costs[1:], strict=True)]
