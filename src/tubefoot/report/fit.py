"""Figures of a fit of recordings: model against recording, what was learnt, what explains the offsets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, Picture, save, styled
from tubefoot.report.runs import read_json

LABELS = {
    "bend_deg": "bend angle [deg]",
    "pressure_left_kpa": "left pressure [kPa]",
    "pressure_right_kpa": "right pressure [kPa]",
}


def draw_fit(directory: Path) -> list[Picture]:
    """The figures of a directory that `tubefoot fit` wrote.

    directory : with fit.json and its tables; figures go into `figures/` below it
    """
    record = read_json(directory / "fit.json") or {}
    found = [_draw_courses(directory, record), _draw_learnt(directory, record["estimates"])]
    if (attribution := read_json(directory / "attribution.json")) is not None:
        found.append(draw_attribution(directory, attribution))
    return found


def _draw_courses(directory: Path, record: Mapping[str, Any]) -> Picture:
    from matplotlib import pyplot

    rows = read_table(directory / "windows.csv")
    first = record["recordings"][0]["name"]
    with styled():
        canvas, axes = pyplot.subplots(3, 1, figsize=(7.0, 6.4), sharex=True, layout="constrained")
        for place, quantity in zip(
            axes, ("pressure_right_kpa", "pressure_left_kpa", "bend_deg"), strict=True
        ):
            own = [row for row in rows if row["quantity"] == quantity and row["recording"] == first]
            at = [row["time_s"] for row in own]
            place.plot(at, [row["measured"] for row in own], ".", color=COLOURS[0], label="recording")
            place.plot(
                at, [row["fitted"] for row in own], color=COLOURS[1], linewidth=0.9, label="fitted model"
            )
            place.set_ylabel(LABELS[quantity])
        axes[0].legend(frameon=False, fontsize=8, ncols=2)
        axes[-1].set_xlabel("time [s]")
        png, svg = save(canvas, directory / "figures", "fit", vector=True)
    caption = (
        f"Means over the pauses of {first} and the fitted lean model. Root mean square differences "
        f"{record['rms_right_kpa']:.2g} and {record['rms_left_kpa']:.2g} kPa, "
        + ("no angles." if record["rms_bend_deg"] is None else f"{record['rms_bend_deg']:.2g} deg.")
    )
    return Picture("fit", "Recording and fitted model", caption, png, svg)


def _draw_learnt(directory: Path, estimates: Sequence[Mapping[str, Any]]) -> Picture:
    from matplotlib import pyplot

    shown = [each for each in estimates if not each["name"].startswith(("ripple", "zero", "angle", "gain"))]
    names = [f"{each['name']} {each['recording']}".strip() for each in shown]
    learnt = np.array([max(each["learnt"], 0.0) for each in shown])
    with styled():
        canvas, axes = pyplot.subplots(figsize=(7.2, 0.6 + 0.27 * len(shown)), layout="constrained")
        colours = [COLOURS[2] if each["identified"] else COLOURS[1] for each in shown]
        axes.barh(np.arange(len(shown)), learnt, color=colours, height=0.65)
        for k, each in enumerate(shown):
            text = f"{each['value']:.3g}  [{each['low']:.3g}, {each['high']:.3g}]"
            axes.text(1.02, k, text, va="center", fontsize=7.5)
        axes.set_yticks(np.arange(len(shown)), names)
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.62)
        axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0])
        axes.set_xlabel("share of the prior's variance that the recordings took away")
        axes.grid(axis="y", visible=False)
        png, svg = save(canvas, directory / "figures", "learnt", vector=True)
    caption = (
        "Green: identified to its goal (5 % scale, 15 % air, 20 % others); orange: not. Beside: value and "
        "95 % interval. Nothing learnt means that the prior is all that is known."
    )
    return Picture("learnt", "What the recordings say", caption, png, svg)


def draw_attribution(directory: Path, found: Mapping[str, Any]) -> Picture:
    """The figure of what explains the offsets, in `figures/` of a directory.

    directory : of the run; found : what its attribution.json holds
    """
    from matplotlib import pyplot

    with styled():
        canvas, axes = pyplot.subplots(1, 2, figsize=(8.6, 3.6), layout="constrained", sharey=True)
        for place, (quantity, shares) in zip(axes, found["shapley"].items(), strict=True):
            causes = list(shares)
            at = np.arange(len(causes))
            place.barh(
                at, list(shares.values()), height=0.6, color=COLOURS[0], label="mean over orders (Shapley)"
            )
            place.plot(list(found["first"][quantity].values()), at, "o", color=COLOURS[1], label="alone")
            place.plot(
                list(found["last"][quantity].values()),
                at,
                "D",
                color=COLOURS[2],
                markerfacecolor="white",
                label="taken away last",
            )
            place.axvline(0.0, color="#9a9a9a", linewidth=0.7)
            place.set_yticks(at, causes)
            place.set_xlabel(f"{LABELS[quantity]}, change; total {found['offset'][quantity]:+.1f}")
        axes[0].invert_yaxis()
        canvas.legend(
            *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
        )
        png, svg = save(canvas, directory / "figures", "attribution", vector=True)
    main = found["main_cause"]
    caption = (
        f"What each cause changes against the ideal finger at {found['top_kpa']:.0f} kPa on the right, "
        f"read half a second after each pulse. Main cause: {main['bend_deg']} (angle), "
        f"{main['pressure_left_kpa']} (suction). The paper says: {found['paper_says']}."
    )
    return Picture("attribution", "What explains the offsets", caption, png, svg)
