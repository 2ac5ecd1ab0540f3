"""Where a finger is stressed most: the hottest part of the body and the regions that it lies in.

Peaks at sharp edges depend on the mesh. So a stress is judged by the 5 % of the body's volume that bears most
of it: which share of that lies in a region, beside the region's share of the volume. S33 counts where it
pulls, shear by its size.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.measures import Stresses
from tubefoot.units import KPA

FloatArray = NDArray[np.float64]
Row = dict[str, Any]

HOTTEST = 0.05
"""Share of the body's volume that counts as its hottest part."""
NEAR_MID_PLANE = 0.25
"""Share of the half height that lies near the mid-plane."""


def hotspot_rows(number: int, stresses: Stresses, points: FloatArray, half_height: float) -> list[Row]:
    """Rows of hotspots.csv: for each stress and zone, its share of the hottest volume, and its peak.

    number : the state's step; stresses : of the half finger; points : (n_cells, n_q, 3) where, at rest [mm]
    half_height : from the mid-plane to the side [mm]
    """
    soft = stresses.soft
    weights, places = stresses.weights[soft], points[soft]
    total = weights.sum()
    rows = []
    for quantity, values in _quantities(stresses):
        values = values[soft]
        hot = _hottest(values, weights)
        for zone, mask in _zones(stresses.region[soft], places, half_height):
            inside = np.where(mask, weights, 0.0)
            share = inside.sum() / total
            hottest = (inside * hot).sum() / (weights * hot).sum()
            peak = np.unravel_index(np.argmax(np.where(mask, values, -np.inf)), values.shape)
            x, y, z = places[peak]
            rows.append(
                {
                    "step": number,
                    "stress": quantity,
                    "zone": zone,
                    "volume_share": float(share),
                    "hottest_share": float(hottest),
                    "peak_kpa": float(values[peak]) / KPA,
                    "peak_x_mm": float(x),
                    "peak_y_mm": float(y),
                    "peak_z_mm": float(z),
                }
            )
    return rows


def _quantities(stresses: Stresses) -> Iterator[tuple[str, FloatArray]]:
    yield "von_mises", stresses.von_mises
    for name in ("s13", "s23"):
        yield name, np.abs(stresses.component(name))
    yield "s33", stresses.component("s33")


def _hottest(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Which part of each point's volume belongs to the hottest share, 0 to 1; for one point in between."""
    order = np.argsort(-values, axis=None)
    volume = weights.ravel()[order]
    left = HOTTEST * volume.sum() - (np.cumsum(volume) - volume)
    parts = np.empty(values.size)
    parts[order] = np.clip(left / volume, 0.0, 1.0)
    return parts.reshape(values.shape)


def _zones(
    region: NDArray[np.str_], places: FloatArray, half_height: float
) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Each zone with the mask of its points: the regions, and all that lies near the mid-plane."""
    yield "near_mid_plane", places[..., 1] < NEAR_MID_PLANE * half_height
    for name in np.unique(region):
        yield str(name), np.broadcast_to((region == name)[:, None], places.shape[:2])
