"""Residuals of recordings against the lean bench, with priors, and their derivatives.

Several recordings of one bench share what belongs to print and bench; each has its own filling, zeros and
rollers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_parameters import (
    NAMES,
    SAME_TIME_S,
    UNKNOWNS,
    Unknown,
    bench_numbers,
    pumped_volumes,
    starting_values,
    usual_duty,
)
from tubefoot.validation.discrepancy import Residuals, found_sizes
from tubefoot.validation.lean_bench import Course, LeanBench
from tubefoot.validation.windows import Observation

FloatArray = NDArray[np.float64]

OWN = tuple(name for name in NAMES if name.startswith(("bubble", "zero", "angle_zero", "ripple")))
"""Unknowns that each recording has for itself of several fitted together: another finger or filling."""
MEASURED_ONLY = (
    "gain_right",
    "gain_left",
    "pressure_late_s",
    "angle_gain",
    "angle_zero_deg",
    "zero_right_kpa",
    "zero_left_kpa",
)
"""Unknowns that change what is measured, not what happens."""
STEP = 1e-3
"""Of a difference, over the prior's sigma."""
VOLUME_STEP = 0.3
"""Of a difference by the volume of a pulse [mm^3]."""


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
        self.relaxation, self.duty = relaxation, usual_duty(self.observations)
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
        self.sizes: dict[str, float] = {}
        self._factors: list[FloatArray] = []
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
        values = self.values(x, which)
        return self._simulate(which, pumped_volumes(self.observations[which], values, self.duty), values)

    def _simulate(self, which: int, pumped: FloatArray, values: Mapping[str, float]) -> Course:
        self.evaluations += 1
        steps = np.diff(self.observations[which].grid)
        return self.benches[which].simulate(steps, pumped, bench_numbers(values, self.relaxation))

    def measured(
        self, x: FloatArray, which: int, course: Course
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Means over the windows as the sensors would show them: right, left [MPa], angle [rad].

        x : (p,) inner values; which : number of the recording; course : its course
        """
        values, seen = self.values(x, which), self.observations[which]
        late = values["pressure_late_s"]
        right, left = (
            values[f"gain_{name}"] * windows.of_model(course.branch[:, side], seen.grid, late)
            + values[f"zero_{name}_kpa"] * KPA
            for side, (name, windows) in enumerate((("right", seen.right), ("left", seen.left)))
        )
        angle = values["angle_gain"] * seen.angle.of_model(course.bend, seen.grid)
        angle += values["angle_zero_deg"] * DEG
        return right, left, angle

    def residuals(self, x: FloatArray, which: int, course: Course | None = None) -> FloatArray:
        """Weighted residuals of one recording, (n,).

        x : (p,) inner values; which : number of the recording; course : its course, if known
        """
        off = self.off(x, which, course)
        if self._factors:
            return np.asarray(solve_triangular(self._factors[which], off, lower=True))
        return off / np.concatenate([seen.sigma for seen in self.observations[which].quantities])

    def off(self, x: FloatArray, which: int, course: Course | None = None) -> FloatArray:
        """Model less data of one recording, (n,) [MPa], [rad]: windows of right, left and angle.

        x : (p,) inner values; which : number of the recording; course : its course, if known
        """
        model = self.measured(x, which, course or self.course(x, which))
        seen = self.observations[which].quantities
        return np.concatenate([mean - windows.values for mean, windows in zip(model, seen, strict=True)])

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
        blocks = [self._slopes(x, which, self.residuals) for which in range(len(self.observations))]
        return np.vstack([*blocks, np.diag(1.0 / self.spread)])

    def _slopes(self, x: FloatArray, which: int, of: Any) -> FloatArray:
        """Derivatives of `residuals` or `off` of one recording, (n, p)."""
        course = self.course(x, which)
        base = of(x, which, course)
        found = np.zeros((len(base), len(x)))
        for column, (unknown, owner) in enumerate(self.columns):
            if owner not in (-1, which):
                continue
            step = STEP * self.spread[column]
            if x[column] + step > self.high[column]:
                step = -step
            moved = x.copy()
            moved[column] += step
            known = course if unknown.name in MEASURED_ONLY else None
            found[:, column] = (of(moved, which, known) - base) / step
        return found

    def start(self) -> FloatArray:
        """Inner values at which a fit starts: the priors' middles."""
        return np.clip(self.middle, self.low + 1e-9, self.high - 1e-9)

    def weigh(self, x: FloatArray) -> None:
        """Find how large the lean model's own errors are, and count them in the residuals from now on.

        x : (p,) inner values of a first fit
        """
        recordings = [self._left_over(x, which) for which in range(len(self.observations))]
        self.sizes = found_sizes(recordings, self.spread, self.middle - x)
        self._factors = [cholesky(each.covariance(self.sizes), lower=True) for each in recordings]

    def _left_over(self, x: FloatArray, which: int) -> Residuals:
        """Residuals of one recording and what they depend on."""
        seen = self.observations[which]
        course = self.course(x, which)
        values = self.values(x, which)
        pumped = pumped_volumes(seen, values, self.duty)
        belongs = np.searchsorted(seen.starts - SAME_TIME_S, seen.grid[:-1], side="right") - 1
        base, volumes = self.off(x, which, course), []
        for pulse in range(len(seen.starts)):
            share = np.where(belongs == pulse, pumped, 0.0)
            more = share * VOLUME_STEP / max(abs(share.sum()), VOLUME_STEP)
            moved = self._simulate(which, pumped + more, values)
            volumes.append((self.off(x, which, moved) - base) / VOLUME_STEP)
        quantities = seen.quantities
        return Residuals(
            base,
            self._slopes(x, which, self.off),
            np.array(volumes).T,
            np.concatenate([each.noise for each in quantities]),
            np.concatenate([seen.grid[each.steps[:, 1]] for each in quantities]),
            np.repeat([0, 1, 2], [len(each.values) for each in quantities]),
            np.concatenate([~each.resting(seen) for each in quantities]),
        )

    def holding(self, name: str, value: float) -> Self:
        """The same problem with one unknown held.

        name : of the unknown; value : in its unit
        """
        held = copy(self)
        held.fixed = {**self.fixed, name: value}
        keep = [k for k, (unknown, _) in enumerate(self.columns) if unknown.name != name]
        held.columns = [self.columns[k] for k in keep]
        held.middle, held.spread = self.middle[keep], self.spread[keep]
        held.low, held.high = self.low[keep], self.high[keep]
        return held
