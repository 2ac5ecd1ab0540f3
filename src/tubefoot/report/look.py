"""How figures look: colours that colour-blind readers tell apart, labels on the lines, sizes for print."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.records import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

FloatArray = NDArray[np.float64]

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9")
"""Okabe and Ito's palette without its yellows, which vanish in print."""
MARKERS = ("o", "s", "^", "D", "v", "P")
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.ymargin": 0.09,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "tubefoot",
    "figure.dpi": 100.0,
}
PRINT_DPI = 200
PNG_LEVEL = 4
"""Four percent larger than at zlib's usual level, in half the time."""
LABEL_POINTS = 8.5


@dataclass(frozen=True)
class Picture:
    """One figure of a report, as files.

    key : its anchor on the page; title, caption : what it shows, with the state and its units
    png : at `PRINT_DPI`; svg : None for pictures of fields
    """

    key: str
    title: str
    caption: str
    png: Path
    svg: Path | None = None


@contextmanager
def styled() -> Iterator[None]:
    """A context in which Matplotlib draws in the report's style, without a display."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import rc_context

    with rc_context(STYLE):
        yield


def line_of(number: int, count: int) -> dict[str, Any]:
    """Colour, marker and width of a run's line, as keywords of `Axes.plot`.

    number : place of the run in the report; count : how many runs share the figure. Later lines are
        thinner, so that one that coincides with an earlier one does not hide it.
    """
    over = number / max(count - 1, 1)
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[number % len(MARKERS)],
        "linewidth": 2.8 - 1.5 * over if count > 1 else 1.8,
        "markersize": 6.0 - 2.5 * over if count > 1 else 4.0,
    }


def figure_of(axes: Axes) -> Canvas:
    """The figure that axes belong to.

    axes : of any depth
    """
    canvas = axes.get_figure(root=True)
    assert canvas is not None, "the axes were taken off their figure"
    return canvas


def save(canvas: Canvas, directory: Path, key: str, vector: bool) -> tuple[Path, Path | None]:
    """The PNG and, where wanted, the SVG file of a drawn figure, which is closed.

    canvas : the figure; directory, key : files are named KEY.png and KEY.svg
    vector : whether an SVG makes sense
    """
    from matplotlib import pyplot

    files: list[Path] = []
    layout = canvas.get_layout_engine()
    if layout is not None:  # once, not again in each file's drawing
        layout.execute(canvas)
        canvas.set_layout_engine("none")
    for kind in ("png", "svg")[: 2 if vector else 1]:
        buffer = io.BytesIO()
        # No date: the same records give the same file.
        how: dict[str, Any] = (
            {"metadata": {"Date": None}} if kind == "svg" else {"pil_kwargs": {"compress_level": PNG_LEVEL}}
        )
        canvas.savefig(buffer, format=kind, dpi=PRINT_DPI, **how)
        files.append(write_whole(directory / f"{key}.{kind}", buffer.getvalue()))
    pyplot.close(canvas)
    return files[0], files[1] if vector else None


@dataclass(frozen=True)
class End:
    """Where a line ends, its name and colour; `lean` is -1 or 1 where the name must go below or above it."""

    x: float
    y: float
    name: str
    colour: str
    lean: int = 0

    @classmethod
    def of(cls, x: FloatArray, y: FloatArray, name: str, colour: str) -> End:
        """The end of a line; a line that runs to the left would be crossed by a name at its own height.

        x, y : (n,) points of the line; name, colour : of the line
        """
        leftwards = len(x) > 1 and x[-1] < x[0]
        lean = 0 if not leftwards else (-1 if y[-1] < y[0] else 1)
        return cls(float(x[-1]), float(y[-1]), name, colour, lean)


def label_ends(axes: Axes, ends: Sequence[End]) -> None:
    """Write each line's name beside its end, moved apart where names would overlap.

    axes : where the lines were drawn, with their final limits; ends : of the lines
    """
    from matplotlib.transforms import offset_copy

    canvas = figure_of(axes)
    box = axes.get_window_extent()
    per_point = canvas.dpi / 72.0
    wide, high = np.ptp(axes.get_xlim()) / box.width, np.ptp(axes.get_ylim()) / box.height
    letter, line = 0.62 * LABEL_POINTS * per_point * wide, 1.25 * LABEL_POINTS * per_point * high
    beside = offset_copy(axes.transData, canvas, x=6, units="points")
    paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6}
    for end, height in zip(ends, _apart(ends, letter, line), strict=True):
        look: dict[str, Any] = {
            "color": end.colour,
            "fontsize": LABEL_POINTS,
            "fontweight": "bold",
            "va": "center",
        }
        axes.text(end.x, height, end.name, transform=beside, bbox=paper, **look)


def _apart(ends: Sequence[End], letter: float, line: float) -> list[float]:
    """Heights of the names: those that would overlap are stacked, about the middle of where they belong.

    letter, line : width of a letter and height of a line, in the units of the axes
    """
    wanted = [end.y + end.lean * line for end in ends]
    places = list(wanted)
    for group in _columns(ends, letter):
        group.sort(key=lambda i: wanted[i])
        for below, i in pairwise(group):
            places[i] = max(wanted[i], places[below] + line)
        shift = float(np.mean([places[i] - wanted[i] for i in group]))
        for i in group:
            places[i] -= shift
    return places


def _columns(ends: Sequence[End], letter: float) -> list[list[int]]:
    """Numbers of the names, in groups that share columns of the figure."""
    groups: list[list[int]] = []
    reach = -np.inf
    for i in sorted(range(len(ends)), key=lambda i: ends[i].x):
        if not groups or ends[i].x > reach:
            groups.append([])
        groups[-1].append(i)
        reach = max(reach, ends[i].x + letter * len(ends[i].name))
    return groups
