"""`tubefoot fit ...`: parameters from measurements: of a material, and of a bench with its finger."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

if TYPE_CHECKING:
    from tubefoot.study.material_fit import MaterialFit

fit_app = App(name="fit", help="Parameters from recordings of a bench, or from tests of a material.")

Kind = Literal["uniaxial", "planar", "equibiaxial", "shear", "dma", "relaxation"]


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
            found.append(f"  mu_{k + 1} = {mu:9.5f} MPa   alpha_{k + 1} = {alpha:8.4f}{unused}")
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
