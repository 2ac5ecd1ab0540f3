"""Figures of a grasp from its `grasp.csv`: angles over time as in the paper's Fig. 5, the plane of the two
angles, forces and pressures, and a strip of the pictures of its phases.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tubefoot.records import read_table
from tubefoot.report.bending import column
from tubefoot.report.look import COLOURS, Picture, save, styled
from tubefoot.report.runs import read_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIDES = ("right", "left")
LINES = {"right": "-", "left": "--"}
SHADES = {"close": "#eef4fa", "grip": "#fdeee3", "hold": "#e9f6ef", "lift": "#f6f6f6", "shake": "#f0eaf5"}
"""Background of the phases that are told apart."""
CURVED_SHARE = 0.25
"""theta2 over theta1 below minus which a contact counts as curved, as in `control/contact_type.py`."""
LEAST_REACH_DEG = 1.0
"""Of the plane either way, also where no angle was seen [deg]."""


def draw_grasp(directory: Path) -> list[Picture]:
    """The figures of a run in its directory: angles, plane, forces, and the strip where pictures were taken.

    directory : of a `grasp` run
    """
    rows = read_table(directory / "grasp.csv")
    summary = read_json(directory / "summary.json") or {}
    name = f"{summary.get('object', '')}, {summary.get('pose', '')}"
    found = [
        _angles(directory, rows, name),
        _plane(directory, rows, summary, name),
        _forces(directory, rows, summary, name),
    ]
    strip = _strip(directory, name)
    return ([strip] if strip else []) + found


def _angles(directory: Path, rows: list[dict[str, Any]], name: str) -> Picture:
    from matplotlib import pyplot

    with styled():
        canvas, axes = pyplot.subplots(figsize=(6.4, 3.2), layout="constrained")
        _shade(axes, rows)
        time = column(rows, "time_s")
        for colour, angle in zip(COLOURS, ("theta1", "theta2"), strict=False):
            for side in SIDES:
                label = f"{angle} {side}"
                axes.plot(time, column(rows, f"{angle}_{side}_deg"), LINES[side], color=colour, label=label)
        axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
        axes.set_xlabel("bench time [s]")
        axes.set_ylabel("angle, inward positive [deg]")
        axes.legend(frameon=False, ncols=2, loc="best")
        png, svg = save(canvas, directory, "angles", vector=True)
    caption = (
        f"{name}: turn of the centreline over the lower (theta1) and the upper half (theta2) of both "
        "fingers, in the phases of the grasp."
    )
    return Picture("grasp-angles", "Two angles during a grasp", caption, png, svg)


def _plane(directory: Path, rows: list[dict[str, Any]], summary: dict[str, Any], name: str) -> Picture:
    from matplotlib import pyplot

    with styled():
        canvas, axes = pyplot.subplots(figsize=(4.6, 4.2), layout="constrained")
        theta1 = np.mean([column(rows, f"theta1_{side}_deg") for side in SIDES], axis=0)
        theta2 = np.mean([column(rows, f"theta2_{side}_deg") for side in SIDES], axis=0)
        reach = 1.1 * float(np.nanmax(np.abs([theta1, theta2]), initial=LEAST_REACH_DEG))
        across = np.array([-reach, 0.0])
        axes.fill_between(across, -CURVED_SHARE * across, reach, color="#fdeee3", linewidth=0)
        axes.fill_between(-across, -reach, CURVED_SHARE * across, color="#fdeee3", linewidth=0)
        axes.text(-0.95 * reach, 0.9 * reach, "opposite signs: curved contact", fontsize=8)
        axes.text(-0.95 * reach, -0.92 * reach, "one sign: planar contact", fontsize=8)
        phases = np.array([row["phase"] for row in rows])
        for colour, phase in zip(COLOURS, ("open", "close", "grip", "hold"), strict=False):
            there = phases == phase
            axes.plot(theta1[there], theta2[there], ".", color=colour, markersize=3, label=phase)
        for key, mark in (("contact_deg", "s"), ("deg", "*")):
            one, two = summary.get(f"theta1_{key}"), summary.get(f"theta2_{key}")
            if one is not None and two is not None:
                axes.plot(one, two, mark, color="black", markersize=9 if mark == "*" else 6)
        axes.axhline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
        axes.axvline(0.0, color="#9a9a9a", linewidth=0.7, zorder=0.5)
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_xlabel("theta1, inward positive [deg]")
        axes.set_ylabel("theta2, inward positive [deg]")
        axes.legend(frameon=False, loc="lower right")
        png, svg = save(canvas, directory, "plane", vector=True)
    caption = (
        f"{name}: the path of (theta1, theta2), mean of both fingers; square: contact sure, star: end of "
        "the hold. theta2 grows with every pulse: the sign belongs to a grip level, not to the shape alone."
    )
    return Picture("grasp-plane", "Plane of the two angles", caption, png, svg)


def _forces(directory: Path, rows: list[dict[str, Any]], summary: dict[str, Any], name: str) -> Picture:
    from matplotlib import pyplot

    with styled():
        canvas, panels = pyplot.subplots(2, 1, figsize=(6.4, 4.6), sharex=True, layout="constrained")
        time = column(rows, "time_s")
        for panel in panels:
            _shade(panel, rows)
        for side in SIDES:
            if f"true_force_{side}_n" in rows[0]:
                force = column(rows, f"true_force_{side}_n")
                panels[0].plot(time, force, LINES[side], color=COLOURS[2], label=f"{side}, of the twin")
            force = column(rows, f"force_{side}_n")
            panels[0].plot(time, force, LINES[side], color=COLOURS[1], label=f"{side}, estimated")
            panels[1].plot(time, column(rows, f"pressure_in_{side}_kpa"), LINES[side], color=COLOURS[0])
            panels[1].plot(time, column(rows, f"pressure_out_{side}_kpa"), LINES[side], color=COLOURS[3])
        if summary.get("grip_force_goal_n") is not None:
            panels[0].axhline(summary["grip_force_goal_n"], color="#777777", linewidth=0.9, label="goal")
        panels[0].set_ylabel("normal force [N]")
        panels[0].legend(frameon=False, fontsize=7.5, loc="upper left")
        panels[1].set_ylabel("pressure [kPa]\n(blue inward chamber)")
        panels[1].set_xlabel("bench time [s]")
        png, svg = save(canvas, directory, "forces", vector=True)
    caption = (
        f"{name}: normal force of each finger, as the protocol estimates it from angles and pressures "
        "and, on the virtual gripper, as it is; gauge pressures of the branches."
    )
    return Picture("grasp-forces", "Forces and pressures of a grasp", caption, png, svg)


def _strip(directory: Path, name: str) -> Picture | None:
    """The pictures of the phases side by side; None where none were taken."""
    files = sorted((directory / "phases").glob("*.png"))
    if not files:
        return None
    from matplotlib import pyplot

    with styled():
        canvas, panels = pyplot.subplots(1, len(files), figsize=(1.9 * len(files), 2.35), squeeze=False)
        for panel, file in zip(panels[0], files, strict=True):
            picture = pyplot.imread(file)
            panel.imshow(picture[34:540, 90:550])
            panel.set_title(file.stem.split("-", 1)[1].replace("-", " "))
            panel.axis("off")
        canvas.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.88, wspace=0.03)
        png, _ = save(canvas, directory, "strip", vector=False)
    caption = f"{name}: the gripper at the beginning of each phase; red dots: contact."
    return Picture("grasp-strip", "A grasp in pictures", caption, png, None)


def _shade(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Colour the phases in the background."""
    start = 0
    for index in range(1, len(rows) + 1):
        if index == len(rows) or rows[index]["phase"] != rows[start]["phase"]:
            shade = SHADES.get(rows[start]["phase"])
            if shade:
                axes.axvspan(
                    rows[start]["time_s"], rows[index - 1]["time_s"], color=shade, linewidth=0, zorder=0
                )
            start = index
