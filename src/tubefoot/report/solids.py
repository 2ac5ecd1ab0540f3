"""The stressed finger in space: its whole deformed shape, and the cut half under each stress component.

Views, colours and captions live here; `offscreen` draws, Matplotlib adds names, colour bar and length bar.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tubefoot.report.look import Picture, save, styled
from tubefoot.report.offscreen import Image, Shot, View, draw_solids
from tubefoot.report.runs import RunRecord
from tubefoot.report.scale import ColourScale, colour_bar, state_line
from tubefoot.report.sheet import sheet
from tubefoot.report.surface import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LENGTH_BAR_MM = 10.0

VON_MISES = "von Mises stress [kPa]"


@dataclass(frozen=True)
class Panel:
    """A figure of solids: what is shown, from where, whole or cut open."""

    key: str
    title: str
    caption: str
    field: str
    name: str
    view: View
    whole: bool
    signed: bool


OUTSIDE = View((0.55, -1.0, 0.35))
INSIDE = View((0.35, -1.0, 0.25))
"""The half y >= 0 seen from its cut face."""

PANELS = (
    Panel(
        "shape",
        "Stressed shape",
        "Deformed finger, last state of each run, coloured by von Mises stress; all at one scale of length.",
        "von_mises_kpa",
        VON_MISES,
        OUTSIDE,
        whole=True,
        signed=False,
    ),
    Panel(
        "stress-s13",
        "S13, shear across the mid-plane",
        "Shear stress between the bending direction (1) and the normal of the mid-plane (3), on the half "
        "y ≥ 0 cut open. By symmetry it vanishes on the cut of an ideal finger.",
        "s13_kpa",
        "S13 [kPa]",
        INSIDE,
        whole=False,
        signed=True,
    ),
    Panel(
        "stress-s23",
        "S23, shear along the fold walls",
        "Shear stress between the finger's axis (2) and the normal of the mid-plane (3), on the half y ≥ 0 "
        "cut open. By symmetry it vanishes on the cut of an ideal finger.",
        "s23_kpa",
        "S23 [kPa]",
        INSIDE,
        whole=False,
        signed=True,
    ),
    Panel(
        "stress-s33",
        "S33, across the bonded seam",
        "Normal stress across the mid-plane (3), on the half y ≥ 0 cut open: red pulls the bond apart, "
        "blue presses it together.",
        "s33_kpa",
        "S33 [kPa]",
        INSIDE,
        whole=False,
        signed=True,
    ),
)


def draw_panels(runs: Sequence[tuple[RunRecord, Surface]], directory: Path) -> list[Picture]:
    """The pictures of all panels, runs side by side.

    runs : runs and the surfaces of their last states; directory : where the files go

    Raises NoPicture where no OpenGL works without a display.
    """
    scales, shots = [], []
    for panel in PANELS:
        surfaces = [surface.whole().outside() if panel.whole else surface for _, surface in runs]
        scale = ColourScale.of(panel.field, panel.name, surfaces, panel.signed)
        scales.append(scale)
        shots += [Shot(surface, scale, panel.view) for surface in surfaces]
    images = draw_solids(shots)
    pictures = []
    for number, (panel, scale) in enumerate(zip(PANELS, scales, strict=True)):
        shown = images[number * len(runs) : (number + 1) * len(runs)]
        png = _compose(panel.key, [run for run, _ in runs], shown, scale, directory)
        pictures.append(Picture(panel.key, panel.title, panel.caption, png))
    return pictures


def _compose(
    key: str, runs: Sequence[RunRecord], images: Sequence[Image], scale: ColourScale, directory: Path
) -> Path:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    with styled():
        canvas, grid = sheet([image.extent for image in images])
        for axes, run, image in zip(grid, runs, images, strict=True):
            limits = axes.get_xlim(), axes.get_ylim()
            axes.imshow(image.pixels, extent=image.extent, interpolation="antialiased")
            axes.set(xlim=limits[0], ylim=limits[1])
            axes.set_axis_off()
            axes.set_title(state_line(run), fontsize=8.5)
        _length_bar(grid[0])
        ink = ScalarMappable(Normalize(scale.low, scale.high), scale.map_name)
        colour_bar(canvas, ink, grid, scale)
        return save(canvas, directory, key, vector=False)[0]


def _length_bar(axes: Axes) -> None:
    left, bottom = axes.get_xlim()[0], axes.get_ylim()[0]
    axes.plot([left, left + LENGTH_BAR_MM], [bottom] * 2, color="black", linewidth=2.5, clip_on=False)
    axes.text(left, bottom + 0.6, f"{LENGTH_BAR_MM:g} mm", fontsize=8, va="bottom")
