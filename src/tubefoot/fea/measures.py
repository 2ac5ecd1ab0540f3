"""What is read off a solved finger: angles, tip, stresses by region.

Stress components bear the paper's axes: 1 = x (bending direction), 2 = z (along the finger), 3 = y (across
the mid-plane). Percentiles are by volume over the quadrature points: peaks at sharp edges do not converge.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.items import State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import Solid

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

RIGID_REGIONS = ("mount", "tubes")
"""Regions of rigid parts, which the stresses of the body leave out."""

PAPER_AXES = {"s11": (0, 0), "s22": (2, 2), "s33": (1, 1), "s12": (0, 2), "s13": (0, 1), "s23": (2, 1)}
"""Stress components of the paper as (row, column) of the x, y, z tensor."""


class SectionRotation:
    """Turn of a set of points in the x-z plane, positive towards -x at their upper side; with its gradient.

    The rotation that fits best in the sense of least squares (Procrustes):
    angle = atan2(sum X x z, sum X . x) over reference positions X and current positions x from their means.
    """

    def __init__(self, mesh: Mesh, points: IntArray):
        """Keep the reference positions.

        mesh : the mesh; points : numbers of the points that make the section
        """
        rest = mesh.points[points][:, [0, 2]]
        self._lever = rest - rest.mean(axis=0)
        self._slots = 3 * points[:, None] + np.array([0, 2])
        self._rest = self._lever
        self._size = mesh.points.size

    def __call__(self, unknowns: FloatArray) -> tuple[float, FloatArray]:
        """Angle [rad] and its gradient by the displacements, (3 n_points,) [1/mm].

        unknowns : displacements first [mm]
        """
        now = self._rest + unknowns[self._slots]
        now = now - now.mean(axis=0)
        lever = self._lever
        across = float((lever[:, 0] * now[:, 1] - lever[:, 1] * now[:, 0]).sum())
        along = float((lever * now).sum())
        squared = across**2 + along**2
        gradient = np.zeros(self._size)
        gradient[self._slots[:, 0]] = (-along * lever[:, 1] - across * lever[:, 0]) / squared
        gradient[self._slots[:, 1]] = (along * lever[:, 0] - across * lever[:, 1]) / squared
        return float(np.arctan2(across, along)), gradient


class Centreline:
    """The line x = y = 0 of a finger, from base to tip."""

    def __init__(self, mesh: Mesh, bellows_length: float, pitch: float):
        """Find its points.

        mesh : of a finger; bellows_length, pitch : [mm]
        """
        on_line = (np.abs(mesh.points[:, 0]) < 1e-9) & (np.abs(mesh.points[:, 1]) < 1e-9)
        points = np.flatnonzero(on_line)
        self.points = points[np.argsort(mesh.points[points, 2])]
        self._rest = mesh.points[self.points]
        self._middle = bellows_length / 2
        self._reach = min(pitch, bellows_length) / 2

    def middle_turn(self, unknowns: FloatArray) -> float:
        """Direction of the line at half the bellows' length, over one unit about it [rad].

        unknowns : displacements first [mm]
        """
        now = self._rest + unknowns[: 3 * (self.points.max() + 1)].reshape(-1, 3)[self.points]
        ends = [
            [np.interp(self._middle + sign * self._reach, self._rest[:, 2], now[:, axis]) for axis in (0, 2)]
            for sign in (-1, 1)
        ]
        run, rise = np.subtract(ends[1], ends[0])
        return float(np.arctan2(-run, rise))


@dataclass(frozen=True)
class Stresses:
    """Cauchy stresses at the quadrature points of one solid.

    cauchy : (n_cells, n_q, 3, 3) [MPa]; weights : (n_cells, n_q) rest volumes [mm^3]
    region : (n_cells,) names; von_mises, max_principal : (n_cells, n_q) [MPa]
    """

    cauchy: FloatArray
    weights: FloatArray
    region: NDArray[np.str_]
    von_mises: FloatArray
    max_principal: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid, state: State) -> Stresses:
        """The stresses of a solid at a state.

        mesh : the mesh; solid : its cells; state : where to evaluate
        """
        cauchy, _ = solid.stresses(state)
        mean = np.trace(cauchy, axis1=-2, axis2=-1) / 3.0
        deviator = cauchy - mean[..., None, None] * np.eye(3)
        von_mises = np.sqrt(1.5 * np.einsum("cqij,cqij->cq", deviator, deviator))
        principal = np.asarray(np.linalg.eigvalsh(cauchy)[..., -1], dtype=np.float64)
        region = np.array(mesh.regions)[solid.block.region]
        return cls(cauchy, solid.weights, region, von_mises, principal)

    def component(self, name: str) -> FloatArray:
        """One component in the paper's axes, (n_cells, n_q) [MPa].

        name : s11, s22, s33, s12, s13 or s23
        """
        row, column = PAPER_AXES[name]
        return self.cauchy[..., row, column]

    @property
    def soft(self) -> NDArray[np.bool_]:
        """(n_cells,) which cells are of the soft body, not of a rigid part."""
        return ~np.isin(self.region, RIGID_REGIONS)

    def by_region(self) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Each region's name with the mask of its cells; first `all`, which is the soft body."""
        yield "all", self.soft
        for name in np.unique(self.region):
            yield str(name), self.region == name


def percentile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """The value below which a share of the weight lies.

    values, weights : same shape; share : 0 to 1
    """
    order = np.argsort(values, axis=None)
    cumulative = np.cumsum(weights.ravel()[order])
    index = np.searchsorted(cumulative, share * cumulative[-1])
    return float(values.ravel()[order][min(index, values.size - 1)])
