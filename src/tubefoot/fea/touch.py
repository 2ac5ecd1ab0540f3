"""What is read off a contact: pressure and area sample by sample, shared out to the points of facets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.elements import element_kind

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Touch:
    """Contact sample by sample.

    places : (n, 3) [mm]; pressure : (n,) across the gripper [MPa]; area : (n,) across it, undeformed [mm^2]
    """

    places: FloatArray
    pressure: FloatArray
    area: FloatArray

    @property
    def patch(self) -> float:
        """Area that touches [mm^2]."""
        return float(self.area[self.pressure > 0.0].sum())

    def peak(self, share: float = 0.99) -> float:
        """Pressure that a share of the touching area stays below [MPa], 0 where nothing touches.

        share : 0 to 1
        """
        touching = self.pressure > 0.0
        if not touching.any():
            return 0.0
        pressure, area = self.pressure[touching], self.area[touching]
        order = np.argsort(pressure)
        below = np.cumsum(area[order])
        return float(pressure[order][min(int(np.searchsorted(below, share * below[-1])), len(order) - 1)])


class Unheard:
    """A sink for evaluations of which only what the item keeps is wanted."""

    stiff = False

    def add(self, item: object, first: int, matrices: FloatArray, residuals: FloatArray) -> None:
        """Drop it.

        item, first, matrices, residuals : as in `Sink`
        """


def across_area(
    corners: FloatArray, at: FloatArray, weights: FloatArray, direction: FloatArray
) -> FloatArray:
    """Area across a direction that each quadrature point of nine-node facets stands for, (n, n_q) [mm^2].

    corners : (n, 9, 3) of the facets [mm]; at, weights : (n_q, 2) and (n_q,) of the rule
    direction : unit vector
    """
    along = np.einsum("qad,fai->fqdi", element_kind("quad9").shape_gradient(at), corners)
    found: FloatArray = np.abs(np.cross(along[..., 0, :], along[..., 1, :]) @ direction) * weights
    return found


def quarters(places: FloatArray) -> FloatArray:
    """Bilinear shape functions (n, 9) on the quarters of nine-node facets: never negative.

    places : (n, 2) reference coordinates
    """
    away = np.abs(places[:, None] - element_kind("quad9").nodes)
    found: FloatArray = np.prod(np.maximum(0.0, 1.0 - away), axis=2)
    return found
