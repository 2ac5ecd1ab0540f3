"""A drawing sheet in millimetres of paper: views at scale, hatching and dimension lines, by matplotlib."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Arc, PathPatch
from matplotlib.path import Path as Trace

from tubefoot.design.surface import FloatArray
from tubefoot.records import write_whole

A3_MM = (420.0, 297.0)
SCALES = (20.0, 10.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.2, 0.1)
"""Scales that a drawing may have, paper over part."""
MM_PER_INCH = 25.4
THIN, THICK = 0.35, 0.9
TEXT_PT = 8.5


def fitting_scale(size: tuple[float, float], room: tuple[float, float]) -> float:
    """The largest standard scale at which a view fits.

    size : of the view [mm of part]
    room : on the paper [mm]
    """
    for scale in SCALES:
        if size[0] * scale <= room[0] and size[1] * scale <= room[1]:
            return scale
    return min(room[0] / size[0], room[1] / size[1])


def scale_text(scale: float) -> str:
    """A scale as it is written on a drawing, like 5:1.

    scale : paper over part
    """
    return f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:.3g}"


class Sheet:
    """A sheet of paper, coordinates in mm from its lower left corner."""

    def __init__(self, size: tuple[float, float] = A3_MM):
        """An empty sheet with its border.

        size : width and height [mm]
        """
        self.size = size
        self.figure = Figure(figsize=(size[0] / MM_PER_INCH, size[1] / MM_PER_INCH))
        self.axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set_xlim(0, size[0])
        self.axes.set_ylim(0, size[1])
        self.axes.set_axis_off()
        border = 8.0
        self.line(
            [
                (border, border),
                (size[0] - border, border),
                (size[0] - border, size[1] - border),
                (border, size[1] - border),
                (border, border),
            ],
            THICK,
        )

    def line(
        self, points: FloatArray | list[tuple[float, float]], width: float = THICK, style: str = "-"
    ) -> None:
        """A line through points.

        points : (n, 2) on the paper [mm]
        width : in points
        style : matplotlib line style
        """
        x, y = np.asarray(points, dtype=float).T
        self.axes.plot(x, y, color="black", linewidth=width, linestyle=style, solid_capstyle="butt")

    def area(
        self, outside: FloatArray, holes: list[FloatArray], colour: str = "#d9dee4", hatch: str = "////"
    ) -> None:
        """A cut face: outline, holes and hatching.

        outside : (n, 2) corners on the paper [mm]
        holes : outlines within
        colour : fill
        hatch : matplotlib hatch
        """
        vertices, codes = [], []
        for ring in (outside, *holes):
            vertices.append(np.vstack([ring, ring[:1]]))
            codes += [Trace.MOVETO] + [Trace.LINETO] * (len(ring) - 1) + [Trace.CLOSEPOLY]
        trace = Trace(_alternating(vertices), codes)
        with rc_context({"hatch.linewidth": 0.25}):
            patch = PathPatch(trace, facecolor=colour, edgecolor="black", linewidth=THICK, hatch=hatch)
        self.axes.add_patch(patch)

    def text(
        self, x: float, y: float, text: str, size: float = TEXT_PT, align: str = "center", turn: float = 0
    ) -> None:
        """Text centred vertically on a point.

        x, y : on the paper [mm]
        text : what to write
        size : in points
        align : left, center or right
        turn : rotation [deg]
        """
        self.axes.text(
            x,
            y,
            text,
            fontsize=size,
            ha=align,
            va="center",
            rotation=turn,
            rotation_mode="anchor",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )

    def dimension(
        self, start: tuple[float, float], end: tuple[float, float], text: str, away: float, along: str = "x"
    ) -> None:
        """A dimension with arrows, its line parallel to an axis and moved off the part.

        start, end : the two points measured, on the paper [mm]
        text : the dimension
        away : how far the line lies from the farther point [mm], its sign says to which side
        along : x or y, the direction measured
        """
        a, b = np.array(start), np.array(end)
        side = 1 if along == "x" else 0
        level = (max if away > 0 else min)(a[side], b[side]) + away
        feet = [a.copy(), b.copy()]
        for point, foot in zip((a, b), feet, strict=True):
            foot[side] = level
            over = point.copy()
            over[side] = level + np.sign(away) * 1.5
            self.line([tuple(point), tuple(over)], THIN)
        self._arrows(feet[0], feet[1], text, turn=0 if along == "x" else 90)

    def thickness(
        self, start: tuple[float, float], end: tuple[float, float], text: str, reach: float = 9.0
    ) -> None:
        """A wall's thickness: arrows from outside onto both faces, and the text beyond the second.

        start, end : the two faces, on the paper [mm]
        text : the dimension
        reach : how far the arrows stand out [mm]
        """
        a, b = np.array(start), np.array(end)
        way = (b - a) / np.linalg.norm(b - a)
        arrow = {
            "arrowstyle": "-|>",
            "linewidth": THIN,
            "color": "black",
            "mutation_scale": 7,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        self.line([tuple(a), tuple(b)], THIN)
        for face, tail in ((a, a - way * reach), (b, b + way * reach)):
            self.axes.annotate("", xy=tuple(face), xytext=tuple(tail), arrowprops=arrow)
        place = b + way * (reach + 1.0)
        self.text(place[0], place[1] + 2.2, text, align="left" if way[0] >= -0.1 else "right")

    def arc(self, corner: tuple[float, float], radius: float, start: float, end: float) -> None:
        """An angle's arc.

        corner : apex on the paper [mm]
        radius : of the arc [mm]
        start, end : directions of its legs [deg]
        """
        patch = Arc(corner, 2 * radius, 2 * radius, theta1=start, theta2=end, linewidth=THIN, color="black")
        self.axes.add_patch(patch)

    def save(self, path: Path) -> Path:
        """The path of the sheet as SVG, PDF or PNG, by the name's ending.

        path : file to write
        """
        kind = path.suffix.removeprefix(".")
        buffer = io.BytesIO()
        stamp = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
        with rc_context(
            {"svg.fonttype": "none", "pdf.fonttype": 42, "svg.hashsalt": "tubefoot", "hatch.linewidth": 0.25}
        ):
            self.figure.savefig(buffer, format=kind, metadata=stamp, dpi=110)
        return write_whole(path, buffer.getvalue())

    def _arrows(self, start: FloatArray, end: FloatArray, text: str, turn: float) -> None:
        length = float(np.linalg.norm(end - start))
        style = "<|-|>" if length > 8 else "|-|,widthA=0.15,widthB=0.15"
        arrow = {"arrowstyle": style, "linewidth": THIN, "color": "black", "shrinkA": 0, "shrinkB": 0}
        if length > 8:
            arrow["mutation_scale"] = 7
        self.axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow)
        middle = (start + end) / 2
        self.text(middle[0], middle[1], text, turn=turn)


@dataclass(frozen=True)
class View:
    """Where a view lies on the paper: origin [mm of paper], scale, and whether z runs to the right."""

    origin: tuple[float, float]
    scale: float
    z_to_the_right: bool = False

    def at(self, x: float, z: float) -> tuple[float, float]:
        """A point of the part on the paper [mm].

        x, z : on the part [mm]
        """
        across, up = (z, x) if self.z_to_the_right else (x, z)
        return self.origin[0] + self.scale * across, self.origin[1] + self.scale * up

    def points(self, outline: FloatArray) -> FloatArray:
        """An outline on the paper, (n, 2) [mm].

        outline : (n, 2) as (x, z) [mm]
        """
        ordered = outline[:, ::-1] if self.z_to_the_right else outline
        return np.asarray(self.origin) + self.scale * ordered


def _alternating(rings: list[FloatArray]) -> FloatArray:
    """Outside counter-clockwise, holes clockwise, so that they stay empty."""
    turned = []
    for number, ring in enumerate(rings):
        x, y = ring.T
        area = np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])
        turned.append(ring if (area > 0) == (number == 0) else ring[::-1])
    return np.concatenate(turned)
