"""One colour scale for all runs of a figure, and the line that says which state is shown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.report.runs import RunRecord
from tubefoot.report.surface import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

SHARE = 0.995
"""Share of the drawn surface that lies within the scale: sharp edges would flatten it."""
NICE = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


@dataclass(frozen=True)
class ColourScale:
    """Field, name, ends and colour map of a picture.

    field : point data of the field files; name : for the colour bar, with unit; low, high : [kPa]
    """

    field: str
    name: str
    low: float
    high: float

    @classmethod
    def of(cls, field: str, name: str, surfaces: Sequence[Surface], signed: bool) -> ColourScale:
        """The scale that shows all the surfaces, its end a round number.

        field, name : as above; surfaces : what will be drawn; signed : symmetrical about zero
        """
        ends = [_covering(np.abs(surface.value(field)), surface.point_areas) for surface in surfaces]
        high = round_up(float(max(ends)))
        return cls(field, name, -high if signed else 0.0, high)

    @property
    def map_name(self) -> str:
        """Matplotlib's name of the colour map; both are told apart by colour-blind readers."""
        return "YlOrRd" if self.low == 0.0 else "RdBu_r"

    @property
    def keywords(self) -> dict[str, Any]:
        """Keywords of Matplotlib's drawing functions."""
        return {"cmap": self.map_name, "vmin": self.low, "vmax": self.high}


def _covering(values: NDArray[np.float64], areas: NDArray[np.float64]) -> float:
    order = np.argsort(values)
    covered = np.cumsum(areas[order])
    return float(values[order][np.searchsorted(covered, SHARE * covered[-1])])


def round_up(value: float) -> float:
    """The next round number, 1 for nothing at all.

    value : not negative
    """
    if not value > 0.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(value))
    return decade * next(step for step in NICE if step * decade >= value * (1 - 1e-12))


def colour_bar(canvas: Canvas, painted: Any, axes: list[Axes], scale: ColourScale) -> None:
    """Add the colour bar of a figure, with arrows where values lie beyond its ends.

    canvas : the figure; painted : what was drawn with the scale; axes : beside which; scale : its scale
    """
    ends = "max" if scale.low == 0.0 else "both"
    bar = canvas.colorbar(painted, ax=axes, extend=ends, shrink=0.7, aspect=26, pad=0.02)
    bar.set_label(scale.name)
    bar.outline.set_visible(False)


def state_line(run: RunRecord) -> str:
    """What is shown of a run: its name, right pressure and bend angle.

    run : a solve
    """
    last = run.last
    state = f"{last['pressure_right_kpa']:.1f} kPa, {last['bend_deg']:.1f}°"
    return f"{run.name}\n{state.replace('-', '−')}"
