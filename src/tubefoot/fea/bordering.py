"""The borders of the tangent: a row and column for each fluid, and a row for the control.

With K du = -r + sum_i b_i dp_i and b_i = dV_i/du,

    g_i + b_i . du + g_i,p dp_i - rate_i ds = 0   for each cavity,      c + c_u . du + c_p dp + c_s ds = 0.

One factorisation of K serves r and all b_i; dp and ds follow from a small dense system.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive, air_uptake
from tubefoot.fea.items import State

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass
class Borders:
    """The rows and columns around K, and their residuals.

    columns : (n_unknowns, n) dV/du [mm^2]; small : (n + 1, n + 1) their block of pressures and parameter
    right : (n + 1,) residuals of fluids and control; couples : (n,) whether a fluid's equation has its volume
    control_row : (n_unknowns,) derivative of the control, None where it has no displacement in it
    scale : of the control's residual
    """

    columns: FloatArray
    small: FloatArray
    right: FloatArray
    couples: NDArray[np.bool_]
    control_row: FloatArray | None
    scale: float

    @classmethod
    def of(
        cls,
        state: State,
        cavities: Sequence[Cavity],
        drive: Drive,
        control: Control,
        volume_scale: float,
    ) -> Borders:
        """The borders at a state that has just been evaluated.

        state : where; cavities : with their volumes and gradients there; drive : what is prescribed for each
        control : the last row; volume_scale : a volume of the model's size [mm^3]
        """
        n, n_unknowns = len(cavities), len(state.unknowns)
        columns = np.zeros((n_unknowns, n))
        small, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
        couples = np.zeros(n + 1, dtype=bool)
        for i, (cavity, kind, rate) in enumerate(zip(cavities, drive.kind, drive.rate, strict=True)):
            columns[:, i] = cavity.gradient(n_unknowns)
            small[i, n] = -rate
            if kind == "volume":
                uptake, slope = air_uptake(state.pressures[i], cavity.air_volume)
                right[i] = cavity.volume - cavity.rest_volume + uptake - rate * state.parameter
                small[i, i], couples[i] = slope, True
            else:
                right[i] = state.pressures[i] - rate * state.parameter
                small[i, i] = 1.0
        borders = cls(columns, small, right, couples, None, volume_scale)
        borders._set_control(state, cavities, control, "volume" in drive.kind)
        return borders

    def _set_control(
        self, state: State, cavities: Sequence[Cavity], control: Control, by_volume: bool
    ) -> None:
        n, small, right = len(cavities), self.small, self.right
        if control.quantity == "parameter":
            small[n, n], right[n] = 1.0, state.parameter - control.target
            self.scale = max(self.scale, 1.0) if by_volume else max(abs(control.target), 1e-9)
        elif control.quantity == "pressure":
            small[n, control.cavity], right[n] = 1.0, state.pressures[control.cavity] - control.target
            self.scale = max(abs(control.target), 1e-6)
        elif control.quantity == "volume_change":
            cavity = cavities[control.cavity]
            self.control_row = self.columns[:, control.cavity]
            right[n] = cavity.volume - cavity.rest_volume - control.target
        elif control.quantity == "plane":
            assert control.plane is not None
            self.control_row = control.plane.normal.unknowns
            small[n, :n], small[n, n] = control.plane.normal.pressures, control.plane.normal.parameter
            right[n], self.scale = control.plane.distance(state) - control.target, 1.0
        else:
            assert control.measure is not None
            value, gradient = control.measure(state.unknowns)
            self.control_row = np.zeros(len(state.unknowns))
            self.control_row[: len(gradient)] = gradient
            right[n], self.scale = value - control.target, max(abs(control.target), 1e-6)

    def condensed(self, free: IntArray, answers: FloatArray) -> FloatArray:
        """The small matrix after the displacements are eliminated, (n + 1, n + 1).

        free : numbers of the free unknowns; answers : (n_free, n) of K to the columns
        """
        n = answers.shape[1]
        small = self.small.copy()
        for i in np.flatnonzero(self.couples[:n]):
            small[i, :n] += self.columns[free, i] @ answers
        if self.control_row is not None:
            small[n, :n] += self.control_row[free] @ answers
        return small

    def answered(self, free: IntArray, relaxed: FloatArray) -> FloatArray:
        """What a displacement puts into the equations of the borders, (n + 1,).

        free : numbers of the free unknowns; relaxed : (n_free,) displacement at fixed pressures
        """
        n = self.columns.shape[1]
        found = np.zeros(n + 1)
        for i in np.flatnonzero(self.couples[:n]):
            found[i] = self.columns[free, i] @ relaxed
        if self.control_row is not None:
            found[n] = self.control_row[free] @ relaxed
        return found
