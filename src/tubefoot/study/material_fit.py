"""From material tests to a material that a design can use: `tubefoot fit material`.

Stress curves give the Ogden law, dynamic moduli and relaxation the Prony terms. What no test says is kept
from the default material. Written: material.toml (a `[body]` table), fit.json, curves.csv, moduli.csv.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from numpy.typing import NDArray
from pydantic import Field

from tubefoot.config import Settings, parse_settings
from tubefoot.design.material import OgdenMaterial
from tubefoot.records import write_json, write_table, write_whole
from tubefoot.study.material_tests import DynamicTest, MaterialTest, RelaxationTest, StressTest
from tubefoot.study.ogden_conventions import CONVENTIONS, over_instantaneous, to_convention
from tubefoot.study.ogden_curves import LATERAL, Stability, driven_stretch, drucker_stability
from tubefoot.study.ogden_fit import OgdenFit, Weighting, fit_ogden, profile_exponent
from tubefoot.study.prony import PronyFit, fit_prony, times_for

FloatArray = NDArray[np.float64]

TWO_SIDED_95 = 1.96
CURVE_POINTS = 60
PROFILE_WIDTH, PROFILE_POINTS = 3.0, 13


class MaterialFitSettings(Settings):
    """How material tests are fitted."""

    name: str = "fitted"
    """of the material"""
    terms: Annotated[int, Field(ge=1, le=6)] = 3
    """of the Ogden law"""
    signs: Literal["stable", "any"] = "stable"
    """stable: all moduli >= 0, stable at every stretch; any: the closest fit, stability is only checked"""
    stretch_low: Annotated[float, Field(gt=0.05, lt=1)] = 0.5
    """end in compression of the range in which stability is checked"""
    stretch_high: Annotated[float, Field(gt=1, le=10)] = 3.0
    """its end in tension"""
    shortest_s: Annotated[float, Field(gt=0)] = 0.1
    """shortest relaxation time that goes into material.toml [s]; faster ones would need shorter time steps"""
    stress_share: Annotated[float, Field(gt=0, le=1)] = 0.02
    """uncertainty of a stress, share of itself"""
    stress_floor: Annotated[float, Field(gt=0, le=1)] = 0.01
    """uncertainty of a stress, share of the largest in its test"""
    seed: int = 0
    """of the starting exponents"""


@dataclass(frozen=True)
class MaterialFit:
    """What was fitted.

    material : for a design; ogden : None without stress curves; prony : None without moduli over time
    stability : of the law in each kind of test; by_terms : misfit and criterion by number of terms
    path : of material.toml
    """

    material: OgdenMaterial
    ogden: OgdenFit | None
    prony: PronyFit | None
    stability: tuple[Stability, ...]
    by_terms: tuple[dict[str, float], ...]
    path: Path


def fit_material(
    tests: Sequence[MaterialTest],
    directory: Path,
    settings: MaterialFitSettings,
    say: Callable[[str], None] = lambda _: None,
) -> MaterialFit:
    """Fit tests and write the results.

    tests : of one material; directory : where files go; settings : of the fit; say : told of each step

    Raises ConfigError when the tests do not suffice.
    """
    curves = [test for test in tests if isinstance(test, StressTest)]
    timed = [test for test in tests if not isinstance(test, StressTest)]
    stable, weighting = settings.signs == "stable", Weighting(settings.stress_share, settings.stress_floor)
    ogden, by_terms = None, []
    if curves:
        for terms in range(1, settings.terms + 1):
            say(f"Ogden law of {terms} term{'s' if terms > 1 else ''}")
            ogden = fit_ogden(curves, terms, stable, weighting, seed=settings.seed)
            by_terms.append(
                {"terms": terms, "misfit": ogden.misfit, "criterion": ogden.information_criterion}
            )
    prony = _prony(timed, say) if timed else None
    material = _material(settings, ogden, prony)
    stability = _stability(material, settings)
    profiles = _profiles(curves, ogden, stable, weighting, say) if ogden else []
    _write_tables(directory, curves, timed, ogden, prony)
    fit = MaterialFit(material, ogden, prony, stability, tuple(by_terms), directory / "material.toml")
    write_whole(fit.path, material_text(material))
    write_json(directory / "fit.json", _record(fit, profiles, settings))
    return fit


def material_text(material: OgdenMaterial) -> str:
    """The TOML text of a material, as a design's `[body]` table.

    material : to be written
    """
    head = (
        '# Material of the soft body. A design uses it by `[body]` with `material_file = "material.toml"`,\n'
        "# or by this table in its place. W = sum 2 mu_i / alpha_i^2 (sum l_k^alpha_i - 3).\n\n"
    )
    table = {key: list(v) if isinstance(v, tuple) else v for key, v in material.model_dump().items()}
    return head + tomli_w.dumps({"body": table})


def _prony(timed: Sequence[DynamicTest | RelaxationTest], say: Callable[[str], None]) -> PronyFit:
    dynamic = [test for test in timed if isinstance(test, DynamicTest)]
    relaxed = [test for test in timed if isinstance(test, RelaxationTest)]
    frequency, storage, loss = (
        np.concatenate([getattr(test, key) for test in dynamic] or [np.zeros(0)])
        for key in ("frequency", "storage", "loss")
    )
    time, modulus = (
        np.concatenate([getattr(test, key) for test in relaxed] or [np.zeros(0)])
        for key in ("time", "modulus")
    )
    times = times_for(frequency, time)
    say(f"Prony terms at {len(times)} times from {times[0]:.3g} to {times[-1]:.3g} s")
    return fit_prony(frequency, storage, loss, times, (time, modulus))


def _material(settings: MaterialFitSettings, ogden: OgdenFit | None, prony: PronyFit | None) -> OgdenMaterial:
    """The material for a design: fitted where there were tests, the default elsewhere."""
    table: dict[str, Any] = {"name": settings.name}
    if ogden is not None:
        used = ogden.mu != 0.0
        table["mu_mpa"] = [float(f"{value:.6g}") for value in ogden.mu[used]]
        table["alpha"] = [float(f"{value:.6g}") for value in ogden.alpha[used]]
        table["bulk_modulus_mpa"] = max(OgdenMaterial().bulk_modulus_mpa, 200.0 * ogden.shear_modulus)
    if prony is not None and prony.long_term > 0:
        slow = (prony.times >= 0.999 * settings.shortest_s) & (prony.moduli > 0)
        table["relaxation_time_s"] = [float(f"{value:.6g}") for value in prony.times[slow]]
        table["relaxation_share"] = [float(f"{value:.6g}") for value in prony.moduli[slow] / prony.long_term]
    return parse_settings(table, OgdenMaterial, source="the fitted material")


def _stability(material: OgdenMaterial, settings: MaterialFitSettings) -> tuple[Stability, ...]:
    low, high = settings.stretch_low, settings.stretch_high
    shear = high - 1.0 / high
    return tuple(
        drucker_stability(
            kind, *((-shear, shear) if kind == "shear" else (low, high)), material.mu_mpa, material.alpha
        )
        for kind in LATERAL
    )


def _profiles(
    curves: Sequence[StressTest],
    ogden: OgdenFit,
    stable: bool,
    weighting: Weighting,
    say: Callable[[str], None],
) -> list[dict[str, Any]]:
    found = []
    for which, alpha in enumerate(ogden.alpha):
        say(f"profile of exponent {which + 1}")
        values = alpha + np.linspace(-PROFILE_WIDTH, PROFILE_WIDTH, PROFILE_POINTS)
        values = np.where(np.abs(values) < 0.05, 0.05, values)
        misfit = profile_exponent(curves, ogden, which, values, stable, weighting)
        # Profile likelihood: n ln(misfit^2) may rise by the 95 % quantile of chi squared.
        kept = values[ogden.points * np.log(np.maximum(misfit, 1.0) ** 2) <= TWO_SIDED_95**2]
        found.append(
            {
                "exponent": which + 1,
                "value": list(values),
                "misfit_ratio": list(misfit),
                "low": float(kept.min()) if kept.size and kept.min() > values[0] else None,
                "high": float(kept.max()) if kept.size and kept.max() < values[-1] else None,
            }
        )
    return found


def _write_tables(
    directory: Path,
    curves: Sequence[StressTest],
    timed: Sequence[DynamicTest | RelaxationTest],
    ogden: OgdenFit | None,
    prony: PronyFit | None,
) -> None:
    """Data, fit and 95 % band: curves.csv for stress, moduli.csv for moduli over frequency and time."""
    rows: list[dict[str, Any]] = []
    for test in curves if ogden is not None else ():
        assert ogden is not None
        dense = np.linspace(test.deformation.min(), test.deformation.max(), CURVE_POINTS)
        for at, measured in ((test.deformation, test.stress), (dense, None)):
            stress, sigma = ogden.stress(test.kind, at), ogden.stress_sigma(test.kind, at)
            for k, deformation in enumerate(at):
                rows.append(
                    {
                        "test": test.name,
                        "kind": test.kind,
                        "deformation": float(deformation),
                        "stretch": float(driven_stretch(test.kind, deformation)),
                        "measured_mpa": "" if measured is None else float(measured[k]),
                        "fitted_mpa": float(stress[k]),
                        "low_mpa": float(stress[k] - TWO_SIDED_95 * sigma[k]),
                        "high_mpa": float(stress[k] + TWO_SIDED_95 * sigma[k]),
                    }
                )
    if rows:
        write_table(directory / "curves.csv", rows)
    if prony is None:
        return
    moduli: list[dict[str, Any]] = []
    for each in timed:
        if isinstance(each, DynamicTest):
            fitted = prony.dynamic_moduli(each.frequency)
            for what, data, fit in zip(("storage", "loss"), (each.storage, each.loss), fitted, strict=True):
                moduli += _modulus_rows(each.name, what, each.frequency, data, fit, prony)
        else:
            fit = prony.relaxation_modulus(each.time)
            moduli += _modulus_rows(each.name, "relaxation", each.time, each.modulus, fit, prony)
    write_table(directory / "moduli.csv", moduli)


def _modulus_rows(
    name: str, what: str, at: FloatArray, data: FloatArray, fit: FloatArray, prony: PronyFit
) -> list[dict[str, Any]]:
    sigma = prony.sigma(what, at)
    keys = ("frequency_hz_or_time_s", "measured_mpa", "fitted_mpa", "sigma_mpa")
    return [
        {"test": name, "modulus": what, **dict(zip(keys, map(float, values), strict=True))}
        for values in zip(at, data, fit, sigma, strict=True)
    ]


def _record(
    fit: MaterialFit, profiles: list[dict[str, Any]], settings: MaterialFitSettings
) -> dict[str, Any]:
    """What `fit.json` holds."""
    material = fit.material
    record: dict[str, Any] = {
        "material": material.model_dump(),
        "conventions": {name: to_convention(material.mu_mpa, material.alpha, name) for name in CONVENTIONS},
        "relaxation_over_instantaneous": over_instantaneous(material.relaxation_share),
        "stability": [{**vars(each), "stable": each.stable} for each in fit.stability],
    }
    if (ogden := fit.ogden) is not None:
        sigma, n = np.sqrt(np.diag(ogden.covariance)), len(ogden.mu)
        record["ogden"] = {
            "mu_mpa": ogden.mu,
            "mu_sigma_mpa": sigma[:n],
            "alpha": ogden.alpha,
            "alpha_sigma": sigma[n:],
            "shear_modulus_mpa": ogden.shear_modulus,
            "shear_modulus_sigma_mpa": float(np.sqrt(ogden.covariance[:n, :n].sum())),
            "misfit": ogden.misfit,
            "points": ogden.points,
            "by_terms": fit.by_terms,
            "singular_values": ogden.singular_values,
            "undetermined": ogden.undetermined,
            "other_solutions": [{"mu_mpa": mu, "alpha": alpha} for mu, alpha in ogden.others],
            "profiles": profiles,
            "signs": settings.signs,
            "covariance": ogden.covariance,
        }
    if (prony := fit.prony) is not None:
        sigma = np.sqrt(np.diag(prony.covariance))
        record["prony"] = {
            "time_s": prony.times,
            "modulus_mpa": prony.moduli,
            "modulus_sigma_mpa": sigma[:-1],
            "long_term_mpa": prony.long_term,
            "long_term_sigma_mpa": float(sigma[-1]),
            "misfit": prony.misfit,
            "undetermined": prony.undetermined,
            "shortest_s": settings.shortest_s,
        }
    return record
