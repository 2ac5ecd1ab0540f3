"""A sheet of fingers: one panel a run, all at one scale of length, wrapped into rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Box = tuple[float, float, float, float]
"""Left, right, bottom, top [mm]."""

MM_PER_INCH = 11.0
MOST_IN_A_ROW = 4
NARROWEST_MM = 22.0
"""Room for the line above a panel."""


def sheet(boxes: Sequence[Box]) -> tuple[Canvas, list[Axes]]:
    """A figure with one panel for each box, limits set so that a millimetre is as long in all of them.

    boxes : what each panel must show; panels of a row stand on the same height
    """
    from matplotlib import pyplot

    n_rows = math.ceil(len(boxes) / MOST_IN_A_ROW)
    n_columns = math.ceil(len(boxes) / n_rows)
    rows = [boxes[row * n_columns : (row + 1) * n_columns] for row in range(n_rows)]
    widths = [
        max(NARROWEST_MM, *(row[column][1] - row[column][0] for row in rows if column < len(row)))
        for column in range(n_columns)
    ]
    floors = [min(box[2] for box in row) for row in rows]
    heights = [max(box[3] for box in row) - floor for row, floor in zip(rows, floors, strict=True)]
    size = (sum(widths) / MM_PER_INCH + 1.1, sum(heights) / MM_PER_INCH + 0.7 * n_rows)
    canvas, grid = pyplot.subplots(
        n_rows,
        n_columns,
        figsize=size,
        layout="constrained",
        width_ratios=widths,
        height_ratios=heights,
        squeeze=False,
    )
    axes = list(grid.flat)
    for spare in axes[len(boxes) :]:
        spare.remove()
    for number, box in enumerate(boxes):
        row, column = divmod(number, n_columns)
        middle = (box[0] + box[1]) / 2
        axes[number].set_xlim(middle - widths[column] / 2, middle + widths[column] / 2)
        axes[number].set_ylim(floors[row], floors[row] + heights[row])
        axes[number].set_aspect("equal")
    return canvas, axes[: len(boxes)]
