"""Figures of a material fit: stress bands, what determines the exponents, moduli over frequency or time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tubefoot.records import read_table
from tubefoot.report.look import COLOURS, MARKERS, Picture, save, styled
from tubefoot.report.runs import read_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_material_fit(directory: Path) -> list[Picture]:
    """The figures of a directory that `tubefoot fit material` wrote; those that its tests allow.

    directory : with fit.json and its tables; figures go into `figures/` below it
    """
    record = read_json(directory / "fit.json") or {}
    found = []
    if "ogden" in record:
        found.append(_draw_curves(directory, record["ogden"]))
        found.append(_draw_profiles(directory, record["ogden"]["profiles"]))
    if "prony" in record:
        found.append(_draw_moduli(directory, record["prony"]))
    return found


def _draw_curves(directory: Path, ogden: dict[str, Any]) -> Picture:
    from matplotlib import pyplot

    rows = read_table(directory / "curves.csv")
    tests = list(dict.fromkeys((row["test"], row["kind"]) for row in rows))
    sheared = [kind == "shear" for _, kind in tests]
    with styled():
        places = 1 + (any(sheared) and not all(sheared))
        canvas, axes = pyplot.subplots(
            1, places, figsize=(4.6 * places, 3.8), layout="constrained", squeeze=False
        )
        for number, (test, kind) in enumerate(tests):
            place: Axes = axes[0, -1 if kind == "shear" else 0]
            own = [row for row in rows if row["test"] == test]
            _draw_test(place, own, f"{test} ({kind})" if test != kind else test, number)
            place.set_xlabel("amount of shear [-]" if kind == "shear" else "stretch [-]")
        axes[0, 0].set_ylabel("nominal stress [MPa]")
        for place in axes[0]:
            place.legend(frameon=False, fontsize=8)
        png, svg = save(canvas, directory / "figures", "ogden", vector=True)
    caption = (
        f"Measured stress (symbols) and the Ogden law of {len(ogden['mu_mpa'])} terms fitted to all tests at "
        "once, with its 95 % band. Bands tell what the data leave open within their range, not beyond it."
    )
    return Picture("ogden", "Ogden fit", caption, png, svg)


def _draw_test(axes: Axes, rows: Sequence[dict[str, Any]], label: str, number: int) -> None:
    colour = COLOURS[number % len(COLOURS)]
    data = [row for row in rows if row["measured_mpa"] != ""]
    line = [row for row in rows if row["measured_mpa"] == ""]
    at = [row["deformation"] for row in line]
    axes.plot(
        [row["deformation"] for row in data],
        [row["measured_mpa"] for row in data],
        MARKERS[number % len(MARKERS)],
        color=colour,
        markerfacecolor="white",
        label=label,
    )
    axes.plot(at, [row["fitted_mpa"] for row in line], color=colour)
    low, high = [row["low_mpa"] for row in line], [row["high_mpa"] for row in line]
    axes.fill_between(at, low, high, color=colour, alpha=0.25, linewidth=0)


def _draw_profiles(directory: Path, profiles: Sequence[dict[str, Any]]) -> Picture:
    from matplotlib import pyplot

    with styled():
        canvas, axes = pyplot.subplots(figsize=(4.8, 3.6), layout="constrained")
        for number, profile in enumerate(profiles):
            colour = COLOURS[number % len(COLOURS)]
            label = f"exponent {profile['exponent']}"
            axes.plot(profile["value"], profile["misfit_ratio"], color=colour, label=label)
        ratios = [value for profile in profiles for value in profile["misfit_ratio"]]
        axes.set_ylim(0.95, min(max(ratios), 6.0) + 0.1)
        axes.set_xlabel("exponent, held [-]")
        axes.set_ylabel("misfit over the least one [-]")
        axes.legend(frameon=False, fontsize=8)
        png, svg = save(canvas, directory / "figures", "profiles", vector=True)
    caption = (
        "How much the misfit grows when one exponent is held and all other parameters are fitted anew. A "
        "flat line means that the data do not determine this exponent: others make up for it."
    )
    return Picture("profiles", "What determines the exponents", caption, png, svg)


def _draw_moduli(directory: Path, prony: dict[str, Any]) -> Picture:
    from matplotlib import pyplot

    rows = read_table(directory / "moduli.csv")
    kinds = list(dict.fromkeys(row["modulus"] for row in rows))
    places = int("storage" in kinds) + int("relaxation" in kinds)
    with styled():
        canvas, axes = pyplot.subplots(
            1, places, figsize=(5.0 * places, 3.8), layout="constrained", squeeze=False
        )
        for number, kind in enumerate(kinds):
            place: Axes = axes[0, -1 if kind == "relaxation" else 0]
            own = sorted(
                (row for row in rows if row["modulus"] == kind), key=lambda row: row["frequency_hz_or_time_s"]
            )
            at, data, fit, sigma = (
                np.array([row[key] for row in own])
                for key in ("frequency_hz_or_time_s", "measured_mpa", "fitted_mpa", "sigma_mpa")
            )
            colour = COLOURS[number]
            place.loglog(at, data, MARKERS[number], color=colour, markerfacecolor="white", label=kind)
            place.loglog(at, fit, color=colour)
            low = np.maximum(fit - 1.96 * sigma, 1e-3 * fit)
            place.fill_between(at, low, fit + 1.96 * sigma, color=colour, alpha=0.25, linewidth=0)
            place.set_xlabel("time [s]" if kind == "relaxation" else "frequency [Hz]")
            place.legend(frameon=False, fontsize=8)
        axes[0, 0].set_ylabel("tensile modulus [MPa]")
        png, svg = save(canvas, directory / "figures", "prony", vector=True)
    used = sum(1 for modulus in prony["modulus_mpa"] if modulus > 0)
    caption = (
        f"Measured moduli (symbols) and {used} Prony terms with a long-term modulus of "
        f"{prony['long_term_mpa']:.3g} MPa; misfit {100 * prony['misfit']:.2g} %, band 95 %."
    )
    return Picture("prony", "Prony terms", caption, png, svg)
