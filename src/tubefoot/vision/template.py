"""Template: a marker's ideal picture under blur, with its slopes and curvatures, for look-up at any point.

Marker coordinates u (right) and v (down) run from -0.5 to 0.5 over the black square. The blur is a
Gaussian; its second derivatives tell how the picture would change under a little more blur in any direction
(heat equation), so that an unknown blur, also one from motion, can be solved for together with the pose.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.marker import marker_cells

SAMPLES_A_CELL = 16
MARGIN_CELLS = 3
BLUR_STEP = 1.15
"""Ratio between neighbouring blur levels that are kept ready."""

CHANNELS = 6
"""Brightness, its slopes along u and v, its curvatures uu, uv, vv."""


def rounded_blur(blur: float) -> float:
    """The nearest blur level that templates are kept for, in marker sides.

    blur : standard deviation in marker sides
    """
    return float(BLUR_STEP ** np.rint(np.log(blur) / np.log(BLUR_STEP)))


class Template:
    """Look-up of one marker's picture at one blur."""

    def __init__(self, dictionary: str, marker_id: int, blur: float):
        """Blur the picture and tabulate it.

        dictionary : name of the marker dictionary
        marker_id : which marker
        blur : standard deviation in marker sides
        """
        cells = marker_cells(dictionary, marker_id)
        self.cells = cells
        self.blur = blur
        count = cells.shape[0]
        self._step = 1.0 / (count * SAMPLES_A_CELL)
        padded = np.pad(cells, MARGIN_CELLS, constant_values=1.0)
        fine = np.kron(padded, np.ones((SAMPLES_A_CELL, SAMPLES_A_CELL), dtype=np.float32))
        spread = blur / self._step
        picture = cv2.GaussianBlur(fine, (0, 0), spread, borderType=cv2.BORDER_REPLICATE)
        slope_v, slope_u = np.gradient(picture, self._step)
        curve_uv, curve_uu = np.gradient(slope_u, self._step)
        curve_vv = np.gradient(slope_v, self._step, axis=0)
        table = np.stack([picture, slope_u, slope_v, curve_uu, curve_uv, curve_vv], axis=-1)
        self._size = picture.shape[0]
        self._table = np.ascontiguousarray(table.reshape(-1, CHANNELS), dtype=np.float32)

    def at(self, u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
        """Brightness and derivatives (6, n) at points of the marker: T, Tu, Tv, Tuu, Tuv, Tvv.

        Brightness 1 is paper, 0 is ink; derivatives are by marker sides. Second-order exact between table
        points.

        u : (n,) to the right [marker sides]
        v : (n,) down [marker sides]
        """
        scale = np.float32(1 / self._step)
        centre = np.float32((self._size - 1) / 2)
        column = u * scale + centre
        row = v * scale + centre
        near_column = np.clip(np.rint(column), 0, self._size - 1)
        near_row = np.clip(np.rint(row), 0, self._size - 1)
        index = (near_row * self._size + near_column).astype(np.intp)
        values = self._table.take(index, axis=0).T.copy()
        ahead_u = (column - near_column) * np.float32(self._step)
        ahead_v = (row - near_row) * np.float32(self._step)
        values[0] += values[1] * ahead_u + values[2] * ahead_v
        values[1] += values[3] * ahead_u + values[4] * ahead_v
        values[2] += values[4] * ahead_u + values[5] * ahead_v
        return values


@lru_cache(maxsize=256)
def find_template(dictionary: str, marker_id: int, blur: float) -> Template:
    """The template of a marker at a blur level, made once.

    dictionary : name of the marker dictionary
    marker_id : which marker
    blur : a level from `rounded_blur`
    """
    return Template(dictionary, marker_id, blur)
