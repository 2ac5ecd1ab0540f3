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

from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_parameters import (
    NAMES,
    UNKNOWNS,
    Unknown,
    bench_numbers,
    pumped_volumes,
    starting_values,
    usual_duty,
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
        volumes = pumped_volumes(seen, values, self.duty)
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
