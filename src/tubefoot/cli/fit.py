"""`tubefoot fit ...`: parameters from measurements: of a material, and of a bench with its finger."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

if TYPE_CHECKING:
    from tubefoot.study.material_fit import MaterialFit
    from tubefoot.validation.fit_stage import FitResult

fit_app = App(name="fit", help="Parameters from recordings of a bench, or from tests of a material.")

Kind = Literal["uniaxial", "planar", "equibiaxial", "shear", "dma", "relaxation"]


@fit_app.default
def recordings(
    *recording: Path,
    model: Annotated[
        Path | None,
        Parameter(help="reduced finger of any length (`tubefoot reduce`); the reference if not given"),
    ] = None,
    held_out: Annotated[
        tuple[Path, ...], Parameter(help="recording that is only predicted; may be given again", negative="")
    ] = (),
    columns: Annotated[Path | None, Parameter(help="column map of recordings that are tables (TOML)")] = None,
    units: Annotated[
        int | None, Parameter(help="units of the finger where the recording does not say")
    ] = None,
    tilt_deg: Annotated[
        float, Parameter(help="straight finger against the vertical: 0 stands, 180 hangs")
    ] = 0.0,
    top_kpa: Annotated[float, Parameter(help="right pressure at which offsets are attributed")] = 30.0,
    sobol_samples: Annotated[
        int, Parameter(help="base samples of Sobol indices, a power of two; 0: none")
    ] = 64,
    profile: Annotated[
        tuple[str, ...], Parameter(help="unknown whose profile likelihood is wanted", negative="")
    ] = (),
    seed: Annotated[int, Parameter(help="of the Sobol samples")] = 0,
    out: Annotated[Path, Parameter(help="directory for the results")] = Path("out/fit"),
) -> None:
    """Fit bench and finger to recordings: fitted.toml with uncertainty, fit.json, attribution, figures.

    Material scale, seam, trapped air, bubbles, tube, pump and relaxation by a lean model with priors and
    bounds. What the recordings do not tell apart is named. Several recordings are fitted together: one print,
    one bench.

    Example: tubefoot fit out/rig-record/bench.mcap --out out/fit

    Parameters
    ----------
    recording
        Recordings (.mcap, or tables with --columns).
    """
    from tubefoot.config import parse_settings
    from tubefoot.errors import ConfigError
    from tubefoot.records import Run
    from tubefoot.reduced.files import read_reduced, reference_file
    from tubefoot.report.fit import draw_fit
    from tubefoot.validation.column_map import load_column_map
    from tubefoot.validation.fit_stage import FitSettings, fit_recordings
    from tubefoot.validation.loading import distinct_names, load_recording

    if not recording:
        raise ConfigError("no recording given; name .mcap files, or tables with --columns; see --help")
    table = {
        "top_kpa": top_kpa,
        "tilt_deg": tilt_deg,
        "sobol_samples": sobol_samples,
        "profile": profile,
        "seed": seed,
    }
    settings = parse_settings(table, FitSettings, source="fit")
    mapping = load_column_map(columns) if columns else None
    content = read_reduced(model) if model else reference_file()
    paths = [*recording, *held_out]
    records = [
        load_recording(path, mapping, units=units, name=name)
        for path, name in zip(paths, distinct_names(paths), strict=True)
    ]
    asked = {"recordings": [str(path) for path in recording], "held_out": [str(path) for path in held_out]}
    run = Run(out, "fit", {**settings.model_dump(), **asked, "model": content.name}, seed)
    count = len(recording)
    result = fit_recordings(
        records[:count],
        records[count:],
        content,
        out,
        settings,
        say=lambda step: print(f"  {step}", flush=True),
    )
    for sentence in _about_bench(result):
        print(sentence)
    pictures = draw_fit(out)
    run.finish()
    print(f"results: {out}; parameters: {out / 'fitted.toml'}; figures: {len(pictures)} in {out / 'figures'}")


def _about_bench(result: FitResult) -> list[str]:
    """The result in sentences."""
    from tubefoot.units import DEG, KPA
    from tubefoot.validation.bench_parameters import MAIN

    found = []
    for each in result.fit.estimates:
        if each.name not in MAIN:
            continue
        verdict = "" if each.identified else "  not identified"
        if not each.identified and each.mixed_with:
            verdict += f": not told apart from {next(iter(each.mixed_with))}"
        elif not each.identified and each.low <= 0.0:
            verdict += f": below {each.high:.3g}"
        label = f"{each.name} ({each.recording})" if each.recording else each.name
        found.append(f"  {label:28s} {each.value:9.4g}  95 % {each.low:.4g} to {each.high:.4g}{verdict}")
    right, left, angle = result.fit.off
    bend = f"{angle / DEG:.3f} deg" if angle == angle else "no angles recorded"
    found.append(f"model against recording: {right / KPA:.3f} and {left / KPA:.3f} kPa RMS, {bend}")
    if not result.fit.converged:
        found.append("the search did not end by itself: take the values with care")
    if result.fit.doubtful:
        found.append(
            "the model stays far off the recording: its values and intervals are not to be trusted; "
            "look at the figure for pulses or sensors that went wrong"
        )
    for other in result.predictions:
        found.append(
            f"held out: {other.name} ({other.units} units) predicted within {other.right / KPA:.2f} and "
            f"{other.left / KPA:.2f} kPa, {other.angle / DEG:.2f} deg RMS"
        )
    if (attribution := result.attribution) is not None:
        for quantity in attribution.shapley:
            shares = attribution.shapley[quantity]
            parts = ", ".join(f"{cause} {share:+.2f}" for cause, share in shares.items())
            found.append(f"offset of {quantity} {attribution.offset(quantity):+.2f}: {parts}")
            verdict = "confirmed" if attribution.main_cause(quantity) == "seam" else "refuted"
            found.append(f"  main cause: {attribution.main_cause(quantity)}; seam as main cause: {verdict}")
        best = min(result.decisive[1:], key=lambda row: row["seam_sigma"])
        found.append(
            f"to decide about the seam (now +-{result.decisive[0]['seam_sigma']:.3g}): {best['measurement']} "
            f"(+-{best['seam_sigma']:.3g})"
        )
    return found


@fit_app.command
def material(
    *data: Path,
    terms: Annotated[int, Parameter(help="terms of the Ogden law")] = 3,
    signs: Annotated[
        Literal["stable", "any"],
        Parameter(help="stable: all moduli >= 0; any: the closest fit, checked only"),
    ] = "stable",
    kind: Annotated[Kind | None, Parameter(help="of tables that do not say which test they are")] = None,
    name: Annotated[str, Parameter(help="of the material")] = "fitted",
    stretch_low: Annotated[float, Parameter(help="least stretch of the stability check")] = 0.5,
    stretch_high: Annotated[float, Parameter(help="largest stretch of the stability check")] = 3.0,
    shortest_s: Annotated[float, Parameter(help="shortest relaxation time kept for solves [s]")] = 0.1,
    seed: Annotated[int, Parameter(help="of the starting exponents")] = 0,
    out: Annotated[Path, Parameter(help="directory for the results")] = Path("out/fit-material"),
) -> None:
    """Fit an Ogden law and Prony terms to tests of a material: material.toml, fit.json, tables, figures.

    DATA are CSV tables with a unit in each header (`stretch`, `strain_percent`, `stress_kpa`, `frequency_hz`,
    `storage_modulus_mpa`, `loss_modulus_mpa`, `time_s`, `modulus_mpa`) or TOML descriptions of tables of
    any other making. A design uses the result by `material_file = "material.toml"` in its [body].

    Example: tubefoot fit material examples/materials/agilus30_dma_20C.csv --out out/agilus30

    Parameters
    ----------
    data
        Tables (CSV) or descriptions of tables (TOML).
    """
    from tubefoot.config import parse_settings
    from tubefoot.records import Run
    from tubefoot.report.material import draw_material_fit
    from tubefoot.study.material_fit import MaterialFitSettings, fit_material
    from tubefoot.study.material_tests import load_material_tests

    table = {"name": name, "terms": terms, "signs": signs, "stretch_low": stretch_low}
    table |= {"stretch_high": stretch_high, "shortest_s": shortest_s, "seed": seed}
    settings = parse_settings(table, MaterialFitSettings, source="fit material")
    tests = load_material_tests(data, kind)
    run = Run(out, "fit material", {**settings.model_dump(), "data": [str(path) for path in data]}, seed)
    result = fit_material(tests, out, settings, say=lambda step: print(f"  {step}", flush=True))
    for sentence in _about_material(result):
        print(sentence)
    pictures = draw_material_fit(out)
    run.finish()
    print(f"results: {out}; material: {result.path}; figures: {len(pictures)} in {out / 'figures'}")


def _about_material(result: MaterialFit) -> list[str]:
    """The result in sentences."""
    found = []
    if (ogden := result.ogden) is not None:
        for k, (mu, alpha) in enumerate(zip(ogden.mu, ogden.alpha, strict=True)):
            unused = "  (not needed: left out)" if mu == 0 else ""
            found.append(f"  mu_{k + 1} = {mu:.5g} MPa   alpha_{k + 1} = {alpha:.5g}{unused}")
        found.append(
            f"Ogden: initial shear modulus {ogden.shear_modulus:.4f} MPa, misfit {ogden.misfit:.3g} of the "
            f"uncertainty given to {ogden.points} stresses"
        )
        best = min(result.by_terms, key=lambda row: row["criterion"])
        found.append(f"by the information criterion {best['terms']:.0f} of {len(ogden.mu)} terms suffice")
        for lost in ogden.undetermined:
            names = ", ".join(name for name, weight in lost.items() if abs(weight) > 0.3)
            found.append(f"not determined by these tests: {names}")
        if ogden.others:
            found.append(f"{len(ogden.others)} other sets of parameters fit as well: see fit.json")
    else:
        found.append("no stress curves: the Ogden law is the default one, only its relaxation was fitted")
    for each in result.stability:
        verdict = (
            f"stable from {each.low:.3g} to {each.high:.3g}"
            if each.stable
            else f"UNSTABLE (Drucker) beyond {each.stable_low:.3g} to {each.stable_high:.3g}"
        )
        found.append(f"  {each.kind:12s} {verdict}")
    if (prony := result.prony) is not None:
        found.append(
            f"Prony: long-term tensile modulus {prony.long_term:.4g} MPa, {int((prony.moduli > 0).sum())} "
            f"terms, misfit {100 * prony.misfit:.2g} %, {prony.undetermined} combinations "
            "of terms not determined"
        )
    return found
