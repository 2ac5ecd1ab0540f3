"""Parameters of bench and finger from recordings: least squares with priors and bounds, and what is
identified.

The misfit is sum ((model - mean) / sigma)^2 over all windows plus sum ((x - middle) / sigma)^2 over the
priors. A lean model leaves residuals that are larger than the noise and alike from window to window; so after
a first fit each quantity's sigma is multiplied by sqrt(mean r^2 times the correlation length of r), and the
fit is repeated. Covariance: (J'J + priors)^-1 at the end. What the data add to the priors is 1 - (sigma after
/ sigma before)^2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_parameters import (
    MAIN,
    NAMES,
    UNKNOWNS,
    Unknown,
    bench_numbers,
    pumped_volumes,
    starting_values,
    unknown_named,
)
from tubefoot.validation.lean_bench import Course, LeanBench
from tubefoot.validation.windows import Observation

FloatArray = NDArray[np.float64]

OWN = tuple(name for name in NAMES if name.startswith(("bubble", "zero", "angle_zero", "ripple")))
"""Unknowns that each recording has for itself of several fitted together: another finger or filling."""
MEASURED_ONLY = ("gain_right", "gain_left", "angle_gain", "angle_zero_deg", "zero_right_kpa", "zero_left_kpa")
"""Unknowns that change what is measured, not what happens."""
STEP = 1e-3
"""Of a difference, over the prior's sigma."""
MOST_EVALUATIONS = 30
COARSE, FINE = 1e-3, 1e-4
"""Relative changes at which a search ends."""
ROLLERS_TRIED = 0.72 * 1.02 ** np.arange(30)
"""Volumes between two rollers at which ripple is looked for, over the prior's middle."""
TRIED_UL = 4.0
"""Amplitude with which its effect is found: it is linear [mm^3]."""
LOOKED_AT = 70
"""Pulses in which ripple is looked for: enough to see it, few enough for a coarse search."""
ALIKE = 0.8
"""Correlation from which on two unknowns count as not told apart."""
GOALS = {"scale": 0.05, "seam": 0.20, "air_right_ml": 0.15, "air_left_ml": 0.15}
"""Relative standard deviation below which an unknown counts as identified; 0.2 for the others."""
OTHER_GOAL = 0.20


@dataclass(frozen=True)
class Estimate:
    """One unknown after the fit.

    name : of the unknown; recording : it belongs to, empty where it is shared
    value : in its unit; low, high : 95 % interval, within the physical bounds
    relative_sigma : standard deviation over the value
    learnt : share of the prior's variance that the data took away
    identified : whether the relative standard deviation is under its goal
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
    off : root mean square differences: right, left [MPa], angle [rad]
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

    def of(self, name: str) -> Estimate:
        """The first estimate of a name.

        name : of the unknown
        """
        return next(each for each in self.estimates if each.name == name)


class FitProblem:
    """Residuals and derivatives of one or several recordings of one bench."""

    def __init__(
        self,
        finger: ReducedFinger,
        relaxation: Prony,
        observations: Sequence[Observation],
        fixed: Mapping[str, float] | None = None,
        priors: Mapping[str, Unknown] | None = None,
        tilt: float = 0.0,
    ):
        """Lay it out.

        finger : reduced model at scale one, of any length; relaxation : of its wall at 23 degC
        observations : recordings; fixed : values of unknowns that are not fitted
        priors : unknowns with other priors or bounds than usual, by name
        tilt : of the straight finger against the vertical, 0 stands [rad]
        """
        self.finger, self.tilt = finger, tilt
        self.observations = list(observations)
        self.relaxation = relaxation
        self.fixed = dict(fixed or {})
        given = dict(priors or {})
        self.benches = [LeanBench(finger.with_units(each.units), tilt) for each in observations]
        several = len(self.observations) > 1
        self.columns: list[tuple[Unknown, int]] = []
        start = starting_values(self.observations)
        for unknown in UNKNOWNS:
            if unknown.name in self.fixed:
                continue
            entry = given.get(unknown.name, unknown)
            if unknown.name.startswith("flow") and unknown.name not in given:
                entry = replace(unknown, middle=unknown.inner(start[unknown.name]))
            own = several and unknown.name in OWN
            self.columns += [(entry, k) for k in range(len(observations))] if own else [(entry, -1)]
        self.middle = np.array([unknown.middle for unknown, _ in self.columns])
        self.spread = np.array([unknown.sigma for unknown, _ in self.columns])
        self.low = np.array([unknown.inner(unknown.low) for unknown, _ in self.columns])
        self.high = np.array([unknown.inner(unknown.high) for unknown, _ in self.columns])
        self.inflation = np.ones(3)
        self.evaluations = 0

    def values(self, x: FloatArray, which: int) -> dict[str, float]:
        """Values of all unknowns of one recording.

        x : (p,) inner values; which : number of the recording
        """
        found = dict(self.fixed)
        for (unknown, owner), inner in zip(self.columns, x, strict=True):
            if owner in (-1, which):
                found[unknown.name] = unknown.outer(float(inner))
        return found

    def course(self, x: FloatArray, which: int) -> Course:
        """What the lean bench does in one recording.

        x : (p,) inner values; which : number of the recording
        """
        self.evaluations += 1
        values, seen = self.values(x, which), self.observations[which]
        volumes = pumped_volumes(seen, values)
        return self.benches[which].simulate(
            np.diff(seen.grid), volumes, bench_numbers(values, self.relaxation)
        )

    def measured(
        self, x: FloatArray, which: int, course: Course
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Means over the windows as the sensors would show them: right, left [MPa], angle [rad].

        x : (p,) inner values; which : number of the recording; course : its course
        """
        values, seen = self.values(x, which), self.observations[which]
        right = (
            values["gain_right"] * seen.right.of_model(course.branch[:, 0]) + values["zero_right_kpa"] * KPA
        )
        left = values["gain_left"] * seen.left.of_model(course.branch[:, 1]) + values["zero_left_kpa"] * KPA
        angle = values["angle_gain"] * seen.angle.of_model(course.bend) + values["angle_zero_deg"] * DEG
        return right, left, angle

    def residuals(self, x: FloatArray, which: int, course: Course | None = None) -> FloatArray:
        """Weighted residuals of one recording, (n,).

        x : (p,) inner values; which : number of the recording; course : its course, if known
        """
        model = self.measured(x, which, course or self.course(x, which))
        return np.concatenate(
            [
                (mean - seen.values) / seen.sigma / scale
                for mean, seen, scale in zip(model, self._seen(which), self.inflation, strict=True)
            ]
        )

    def all_residuals(self, x: FloatArray) -> FloatArray:
        """Weighted residuals of all recordings and, last, those of the priors.

        x : (p,) inner values
        """
        parts = [self.residuals(x, which) for which in range(len(self.observations))]
        return np.concatenate([*parts, (x - self.middle) / self.spread])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives of `all_residuals`, by differences; courses only where something else happens.

        x : (p,) inner values
        """
        count, blocks = len(x), []
        for which in range(len(self.observations)):
            course = self.course(x, which)
            base = self.residuals(x, which, course)
            block = np.zeros((len(base), count))
            for column, (unknown, owner) in enumerate(self.columns):
                if owner not in (-1, which):
                    continue
                step = STEP * self.spread[column]
                if x[column] + step > self.high[column]:
                    step = -step
                moved = x.copy()
                moved[column] += step
                known = course if unknown.name in MEASURED_ONLY else None
                block[:, column] = (self.residuals(moved, which, known) - base) / step
            blocks.append(block)
        return np.vstack([*blocks, np.diag(1.0 / self.spread)])

    def start(self) -> FloatArray:
        """Inner values at which a fit starts: the priors' middles."""
        return np.clip(self.middle, self.low + 1e-9, self.high - 1e-9)

    def inflate(self, x: FloatArray) -> None:
        """Take residuals beyond noise, and alike from window to window, into the uncertainties.

        x : (p,) inner values of a fit
        """
        parts: list[list[FloatArray]] = [[], [], []]
        for which in range(len(self.observations)):
            ends = np.cumsum([len(seen.values) for seen in self._seen(which)])[:-1]
            for kind, part in enumerate(np.split(self.residuals(x, which), ends)):
                parts[kind].append(part)
        for kind, of_kind in enumerate(parts):
            size = float(np.mean(np.concatenate(of_kind) ** 2)) if sum(map(len, of_kind)) else 1.0
            length = np.mean([_correlation_length(each) for each in of_kind if len(each)] or [1.0])
            self.inflation[kind] *= max(1.0, float(np.sqrt(size * length)))

    def _seen(self, which: int) -> tuple[Any, Any, Any]:
        seen = self.observations[which]
        return seen.right, seen.left, seen.angle


def _correlation_length(residuals: FloatArray) -> float:
    """How many successive residuals count as one: 1 + 2 sum of correlations up to the first negative one."""
    left = residuals - residuals.mean()
    variance = float(left @ left)
    length = 1.0
    for lag in range(1, len(left) // 3):
        share = float(left[lag:] @ left[:-lag]) / max(variance, 1e-300)
        if share <= 0.05:
            break
        length += 2.0 * share
    return length


def fit_bench(problem: FitProblem, say: Callable[[str], None] = lambda _: None) -> BenchFit:
    """The most probable values and what the recordings say about each.

    problem : recordings and priors; say : told of each step

    Raises ConvergenceError when the lean bench finds no balance at the start.
    """
    x = _search(problem, problem.start(), 8, COARSE).x
    x = _with_rollers(problem, x)
    for number in (1, 2):
        found = _search(problem, x, MOST_EVALUATIONS, COARSE if number == 1 else FINE)
        x = found.x
        say(f"pass {number}: misfit {np.sqrt(2 * found.cost / len(found.fun)):.2f}, {found.nfev} steps")
        if number == 1:
            first = _misfits(problem, x)
            problem.inflate(x)
    rows = problem.jacobian(x)
    information = rows.T @ rows
    covariance: FloatArray = np.asarray(np.linalg.inv(information), float)
    return BenchFit(
        _estimates(problem, x, covariance),
        covariance,
        rows[: -len(x)],
        first,
        _differences(problem, x),
        bool(found.status > 0),
        problem.evaluations,
        problem.fixed,
    )


def calibrate(problem: FitProblem) -> FloatArray:
    """Inner values of a fit whose print and bench are known, without uncertainties.

    problem : with those unknowns fixed
    """
    x = _search(problem, problem.start(), 8, COARSE).x
    x = _with_rollers(problem, x)
    return np.asarray(_search(problem, x).x)


def _search(problem: FitProblem, x: FloatArray, most: int = MOST_EVALUATIONS, tolerance: float = FINE) -> Any:
    """SciPy's result; a course without balance counts as a very bad one."""
    from scipy.optimize import least_squares

    size = len(problem.all_residuals(x))

    def residuals(at: FloatArray) -> FloatArray:
        try:
            return problem.all_residuals(at)
        except ConvergenceError:
            return np.full(size, 1e3)

    return least_squares(
        residuals,
        x,
        jac=problem.jacobian,
        bounds=(problem.low, problem.high),
        x_scale=problem.spread,
        max_nfev=most,
        ftol=tolerance,
        xtol=tolerance,
        gtol=1e-6,
    )


def _with_rollers(problem: FitProblem, x: FloatArray) -> FloatArray:
    """Inner values with the pump's ripple found: the volume between two rollers at which it explains most.

    A search by derivatives does not find a phase that is many turns off. The flows are wrong by some per cent
    at first, and the volume between rollers takes that up: it starts where flow over volume is right.
    """
    names = [unknown.name for unknown, _ in problem.columns]
    if not any(name.startswith("ripple") for name in names):
        return x
    column = names.index("roller_volume_ml") if "roller_volume_ml" in names else None
    x, found = x.copy(), []
    x[[k for k, name in enumerate(names) if name.startswith("ripple")]] = 0.0
    base = [problem.residuals(x, which) for which in range(len(problem.observations))]
    for factor in ROLLERS_TRIED if column is not None else (1.0,):
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
        if unknown.name.startswith("ripple") and owner in (-1, which)
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
    right, left, angle = (float(np.sqrt(np.mean(np.concatenate(part) ** 2))) for part in squares)
    return right, left, angle


def _estimates(problem: FitProblem, x: FloatArray, covariance: FloatArray) -> tuple[Estimate, ...]:
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    found = []
    for k, (unknown, owner) in enumerate(problem.columns):
        value = unknown.outer(float(x[k]))
        ends = [unknown.outer(float(x[k] + side * 1.96 * sigma[k])) for side in (-1, 1)]
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
                bool(relative <= goal),
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
    name : of the unknown; values : at which it is held, in its unit

    A rise of 3.84 bounds the 95 % interval. Raises ConvergenceError when the lean bench finds no balance.
    """
    unknown = unknown_named(name)
    best = {(each.name, each.recording): each.value for each in fit.estimates}
    found, least = [], None
    for value in [fit.of(name).value, *values]:
        held = FitProblem.__new__(FitProblem)
        held.__dict__.update(problem.__dict__)
        held.fixed = {**problem.fixed, name: value}
        keep = [k for k, (each, _) in enumerate(problem.columns) if each.name != name]
        held.columns = [problem.columns[k] for k in keep]
        for key in ("middle", "spread", "low", "high"):
            setattr(held, key, getattr(problem, key)[keep])
        start = np.array(
            [
                each.inner(best[each.name, problem.observations[owner].name if owner >= 0 else ""])
                for each, owner in held.columns
            ]
        )
        start = np.clip(start, held.low + 1e-9, held.high - 1e-9)
        prior = (unknown.inner(value) - unknown.middle) / unknown.sigma
        cost = 2.0 * float(_search(held, start).cost) + prior**2
        if least is None:
            least = cost
        else:
            found.append((float(value), cost - least))
    return found
