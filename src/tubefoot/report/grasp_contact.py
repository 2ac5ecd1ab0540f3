"""The grasp as solved by finite elements: both bodies cut at the mid-plane, the contact patch, the course."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, End, Picture, label_ends, save, styled
from tubefoot.report.scale import ColourScale, colour_bar
from tubefoot.report.surface import Surface, read_surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]
PRESSURE = "contact_pressure_kpa"
FACES_FINGER = 0.2
"""Component across the gripper from which a triangle's normal counts as facing the finger."""


def draw_grasp_pictures(directory: Path) -> list[Path]:
    """The PNG files of a solved grasp, drawn into `pictures/` of its directory.

    directory : of `tubefoot solve --grasp`
    """
    drawn = [draw_course(directory, directory / "pictures")]
    last = int(read_table(directory / "grasp.csv")[-1]["step"])
    if (directory / f"fields/object_{last:04d}.vtu").exists():
        drawn.insert(0, draw_grasp(directory, directory / "pictures"))
    return [picture.png for picture in drawn]


def draw_grasp(directory: Path, target: Path) -> Picture:
    """Both fingers with the object, cut at the mid-plane, and the pressure on the object's front.

    directory : of the grasp; target : where the file goes

    Raises ConfigError when no field of the last state was kept.
    """
    row = read_table(directory / "grasp.csv")[-1]
    summary = json.loads((directory / "summary.json").read_text())
    number, middle = int(row["step"]), float(summary["grasp_middle_x_mm"])
    paths = [directory / f"fields/{part}_{number:04d}.vtu" for part in ("state", "object")]
    if not all(path.exists() for path in paths):
        raise ConfigError(f"{directory}: no fields of the last state were kept; solve with --fields all")
    finger, thing = (read_surface(path) for path in paths)
    with styled():
        from matplotlib import pyplot

        canvas, (left, right) = pyplot.subplots(
            1, 2, figsize=(9.0, 5.6), width_ratios=(1.15, 1.0), layout="constrained"
        )
        scales = [
            ColourScale.of("von_mises_kpa", f"von Mises stress in the {name} [kPa]", [body.cut()], False)
            for name, body in (("finger", finger), ("object", thing))
        ]
        for body, scale in zip((finger, thing), scales, strict=True):
            colour_bar(canvas, _draw_cut(left, body.cut(), scale, middle), [left], scale)
        left.set(aspect="equal", xlabel="x [mm]", ylabel="z [mm]", title="Cut at the mid-plane")
        patch = ColourScale.of(PRESSURE, "contact pressure [kPa]", [thing], False)
        colour_bar(canvas, _draw_front(right, thing, patch), [right], patch)
        right.set(aspect="equal", xlabel="y [mm]", ylabel="z [mm]", title="Front of the object")
        for axes in (left, right):
            axes.grid(False)
        png, _ = save(canvas, target, "grasp-contact", vector=False)
    caption = (
        f"Grasp of {summary['object']} at {row['pumped_volume_ml']:.3g} ml: one finger presses with "
        f"{row['normal_force_n']:.3g} N, {row['pressure_mean_kpa']:.3g} kPa in the mean of the patch. "
        "The finger at the left is the mirror image. No friction, no weight."
    )
    return Picture("grasp-contact", "Contact of finger and object", caption, png)


def draw_course(directory: Path, target: Path) -> Picture:
    """Force and both angles over the pumped volume, from the opened finger to the grip.

    directory : of the grasp; target : where the file goes
    """
    rows = [row for row in read_table(directory / "grasp.csv") if row["placed"]]
    volume = np.array([row["pumped_volume_ml"] for row in rows])
    with styled():
        from matplotlib import pyplot

        canvas, (above, below) = pyplot.subplots(2, 1, figsize=(5.2, 5.2), sharex=True, layout="constrained")
        force = np.array([row["normal_force_n"] for row in rows])
        above.plot(volume, force, marker="o", color=COLOURS[0])
        above.set(ylabel="force of one finger [N]", title="Closing on the object")
        ends = []
        for number, name in enumerate(("theta1", "theta2")):
            values = np.array([row[f"{name}_deg"] for row in rows])
            below.plot(volume, values, marker="o", color=COLOURS[number])
            ends.append(End.of(volume, values, name, COLOURS[number]))
        below.set(xlabel="pumped volume per finger [mL]", ylabel="turn of each half [°]")
        below.margins(x=0.12)
        canvas.draw_without_rendering()
        label_ends(below, ends)
        png, svg = save(canvas, target, "grasp-course", vector=True)
    caption = "Normal force of one finger and turn of its lower and upper half, inward positive."
    return Picture("grasp-course", "Closing on the object", caption, png, svg)


def _draw_cut(axes: Axes, cut: Surface, scale: ColourScale, middle: float) -> Any:
    """The coloured cut with its mirror image at the grasp's middle plane, which becomes x = 0."""
    from matplotlib.tri import Triangulation

    painted = None
    for sign in (1.0, -1.0):
        x, z = sign * (cut.deformed[:, 0] - middle), cut.deformed[:, 2]
        painted = axes.tripcolor(
            Triangulation(x, z, cut.triangles),
            cut.value(scale.field),
            shading="gouraud",
            **scale.keywords,
        )
        for loop in cut.outlines():
            ring = np.r_[loop, loop[:1]]
            axes.plot(x[ring], z[ring], color="black", linewidth=0.6)
    return painted


def _draw_front(axes: Axes, thing: Surface, scale: ColourScale) -> Any:
    """Contact pressure on the side of the object that faces the finger, both halves."""
    from matplotlib.tri import Triangulation

    a, b, c = thing.deformed[thing.triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    front = normal[:, 0] > FACES_FINGER * np.linalg.norm(normal, axis=1)
    triangles, painted = thing.triangles[front], None
    for sign in (1.0, -1.0):
        grid = Triangulation(sign * thing.deformed[:, 1], thing.deformed[:, 2], triangles)
        painted = axes.tripcolor(grid, thing.value(PRESSURE), shading="gouraud", **scale.keywords)
    return painted
