"""The map of the two angles over grip level, size and place, from `map.csv`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, MARKERS, Picture, save, styled

POSES = ("front", "side")


def draw_map(directory: Path) -> Picture:
    """The figure of a map in its directory: both angles over the grip force, and the plane of the angles.

    directory : of a `grasp --map` run
    """
    from matplotlib import pyplot

    rows = read_table(directory / "map.csv")
    cases = sorted({(row["size"], row["height_mm"]) for row in rows})
    with styled():
        canvas, panels = pyplot.subplots(1, 3, figsize=(10.0, 3.4), layout="constrained")
        for number, case in enumerate(cases):
            for pose, line in zip(POSES, ("-", "--"), strict=True):
                course = [
                    row for row in rows if (row["size"], row["height_mm"], row["pose"]) == (*case, pose)
                ]
                _draw_course(
                    panels, course, COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)], line
                )
        for number, (size, height) in enumerate(cases):
            colour, mark = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
            panels[2].plot([], [], mark, color=colour, label=f"size {size:g}, height {height:g} mm")
        panels[2].legend(frameon=False, fontsize=7, loc="best")
        for panel, name in zip(panels[:2], ("theta1", "theta2"), strict=True):
            panel.axhline(0.0, color="#9a9a9a", linewidth=0.7)
            panel.set_xlabel("normal force of a finger [N]")
            panel.set_ylabel(f"{name}, inward positive [deg]")
        panels[2].axhline(0.0, color="#9a9a9a", linewidth=0.7)
        panels[2].set_xlabel("theta1 [deg]")
        panels[2].set_ylabel("theta2 [deg]")
        png, svg = save(canvas, directory, "map", vector=True)
    name = rows[0]["object"]
    caption = (
        f"{name}: both angles of grips at rest over the normal force, front (full) and side (dashed), for "
        "sizes and heights of the object. theta1 says how wide the object is, theta2 how firm the grip; its "
        "sign changes."
    )
    return Picture("grasp-map", "Two angles over grip level, size and place", caption, png, svg)


def _draw_course(panels: Any, course: list[dict[str, Any]], colour: str, mark: str, line: str) -> None:
    touched = [row for row in course if row["normal_force_n"] > 1e-3]
    force = [row["normal_force_n"] for row in touched]
    one, two = ([row[key] for row in touched] for key in ("theta1_deg", "theta2_deg"))
    style = {"color": colour, "linestyle": line, "marker": mark, "markersize": 3.0, "linewidth": 1.1}
    panels[0].plot(force, one, **style)
    panels[1].plot(force, two, **style)
    panels[2].plot(one, two, **style)
