"""`tubefoot fit RECORDING...`: from recordings to fitted parameters, what is identified, and what explains
the offsets.

Writes fitted.toml, fit.json, windows.csv, held_out.csv, attribution.csv and .json, sobol.csv, decisive.csv.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tomli_w
from pydantic import Field, field_validator

from tubefoot.config import Settings
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.records import write_json, write_table, write_whole
from tubefoot.reduced.files import ReducedFile
from tubefoot.units import DEG, KPA
from tubefoot.validation.attribution import QUANTITIES, Attribution, attribute
from tubefoot.validation.bench_fit import (
    BenchFit,
    calibrate,
    fit_bench,
    identified_combinations,
    profile,
    root_mean_square,
)
from tubefoot.validation.bench_parameters import NAMES, unknown_named
from tubefoot.validation.decisive import decisive_rows
from tubefoot.validation.fit_problem import OWN, FitProblem
from tubefoot.validation.pulses import SMALL_DOUBT, pulse_doubt
from tubefoot.validation.recording import BenchRecord
from tubefoot.validation.sensitivity import sobol_rows
from tubefoot.validation.windows import observe

PAPER_SAYS = "seam"
"""The cause to which the paper mainly attributes the offset (claim C9)."""


class FitSettings(Settings):
    """How recordings are fitted."""

    top_kpa: Annotated[float, Field(gt=1, le=90)] = 30.0
    """pressure of the right branch at which offsets are attributed"""
    tilt_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """of the straight finger against the vertical: 0 stands, 180 hangs, 90 lies in a level bending plane"""
    sobol_samples: Annotated[int, Field(ge=0, le=4096)] = 64
    """base samples of the Sobol indices, a power of two; 0 leaves them out"""
    profile: tuple[str, ...] = ()
    """unknowns whose profile likelihood is computed as well"""
    seed: int = 0
    """of the Sobol samples"""

    @field_validator("profile")
    @classmethod
    def _are_fitted(cls, profile: tuple[str, ...]) -> tuple[str, ...]:
        for name in profile:
            if name not in NAMES:
                near = get_close_matches(name, NAMES, n=1, cutoff=0.4)
                hint = f"did you mean `{near[0]}`?" if near else f"there are: {', '.join(NAMES)}"
                raise ValueError(f"`{name}` is no unknown of the fit; {hint}")
        return profile


@dataclass(frozen=True)
class Prediction:
    """A recording that the fit did not see: root mean square differences at rest [MPa], [MPa], [rad].

    pulses : how many were predicted
    """

    name: str
    units: int
    right: float
    left: float
    angle: float
    pulses: int


@dataclass(frozen=True)
class FitResult:
    """What was found.

    fit, problem : of the recordings; attribution : of the first one's finger, None where it cannot be
        pumped so far
    predictions : of recordings that were held out; decisive : rows of decisive.csv
    """

    fit: BenchFit
    problem: FitProblem
    attribution: Attribution | None
    predictions: tuple[Prediction, ...]
    decisive: Sequence[dict[str, Any]]


def fit_recordings(
    records: Sequence[BenchRecord],
    held_out: Sequence[BenchRecord],
    model: ReducedFile,
    directory: Path,
    settings: FitSettings,
    say: Callable[[str], None] = lambda _: None,
) -> FitResult:
    """Fit recordings of one bench and write the results.

    records : to be fitted together, distinctly named; held_out : to be predicted only
    model : reduced finger of any length; directory : where files go; settings : of the fit
    say : told of each step

    Raises ConfigError for recordings that cannot be used, ConvergenceError when the lean bench finds no
    balance.
    """
    finger, relaxation = model.to_finger(), model.to_prony()
    observations = [observe(record) for record in records]
    for record in records:
        if (doubt := pulse_doubt(record)) > SMALL_DOUBT:
            say(
                f"{record.name}: only its samples tell the length of a pulse, to {100 * doubt:.0f} %, and so "
                "what was pumped: the fit may stay far off; log the drive faster"
            )
    tilt = settings.tilt_deg * DEG
    problem = FitProblem(finger, relaxation, observations, tilt=tilt)
    say(f"{sum(each.count for each in observations)} windows, {len(problem.columns)} unknowns")
    fit = fit_bench(problem, say)
    values = fit.values(observations[0].name)
    bench = problem.benches[0]
    predictions = tuple(predict(fit, problem, record) for record in held_out)
    attribution, decisive = None, []
    try:
        attribution = attribute(values, bench, relaxation, settings.top_kpa * KPA)
        decisive = decisive_rows(problem, fit, settings.top_kpa * KPA)
    except ConvergenceError as error:
        say(f"no attribution at {settings.top_kpa:g} kPa: {error}")
    profiles = {name: _profile(problem, fit, name, say) for name in settings.profile}
    write_whole(directory / "fitted.toml", fitted_text(fit))
    write_json(directory / "fit.json", _record(fit, problem, predictions, profiles))
    write_table(directory / "windows.csv", _window_rows(fit, problem))
    if predictions:
        write_table(directory / "held_out.csv", [_prediction_row(each) for each in predictions])
    if attribution is not None:
        write_attribution(attribution, directory)
        write_table(directory / "decisive.csv", decisive)
    if settings.sobol_samples:
        rows = sobol_rows(
            bench, relaxation, settings.sobol_samples, settings.seed, settings.top_kpa * KPA, say
        )
        write_table(directory / "sobol.csv", rows)
    return FitResult(fit, problem, attribution, predictions, decisive)


def predict(fit: BenchFit, problem: FitProblem, record: BenchRecord, calibrated: float = 1 / 3) -> Prediction:
    """How far the fit is off in another recording of this bench, of this or another finger, between pulses.

    fit, problem : of other recordings; record : held out; calibrated : share of its pulses from which its own
        unknowns (bubbles, zeros, where the rollers stood) are found; the others are predicted

    Everything that belongs to print and bench is that of the fit. Raises ConfigError when no pulse is left to
    be predicted.
    """
    seen = observe(record)
    last = max(2, int(calibrated * len(record.pulses)))
    if len(record.pulses) <= last:
        raise ConfigError(
            f"{record.name}: {len(record.pulses)} pulses; a recording that is held out needs {last} for its "
            "own unknowns and more to be predicted"
        )
    early = observe(record, until=record.pulses[last].start)
    known = {each.name: each.value for each in fit.estimates if each.name not in OWN}
    own = FitProblem(
        problem.finger, problem.relaxation, [early], {**problem.fixed, **known}, tilt=problem.tilt
    )
    own.duty = problem.duty
    x = calibrate(own)
    own.observations = [seen]
    model = own.measured(x, 0, own.course(x, 0))
    off = []
    for mean, windows in zip(model, (seen.right, seen.left, seen.angle), strict=True):
        ahead = windows.resting(seen) & (windows.pulse >= last)
        off.append(root_mean_square((mean - windows.values)[ahead]))
    return Prediction(seen.name, seen.units, off[0], off[1], off[2], len(record.pulses) - last)


def fitted_text(fit: BenchFit) -> str:
    """The TOML text of fitted.toml: for each unknown value, 95 % interval and whether it is identified.

    fit : the result
    """
    tables: dict[str, Any] = {}
    for each in fit.estimates:
        of = tables.setdefault(each.recording or "shared", {})
        of[each.name] = {
            "value": float(f"{each.value:.6g}"),
            "low_95": float(f"{each.low:.6g}"),
            "high_95": float(f"{each.high:.6g}"),
            "identified": each.identified,
            "meaning": unknown_named(each.name).meaning,
        }
    return "# Fitted by `tubefoot fit`; units are in the names.\n\n" + tomli_w.dumps(tables)


def write_attribution(found: Attribution, directory: Path) -> None:
    """Write attribution.csv and attribution.json.

    found : shares of the offsets; directory : of the run
    """
    write_table(directory / "attribution.csv", found.rows())
    write_json(directory / "attribution.json", _attribution_record(found))


def _profile(
    problem: FitProblem, fit: BenchFit, name: str, say: Callable[[str], None]
) -> list[dict[str, float]]:
    say(f"profile of {name}")
    unknown, each = unknown_named(name), fit.of(name)
    low, high = unknown.inner(each.low), unknown.inner(each.high)
    at = np.linspace(low - 0.5 * (high - low), high + 0.5 * (high - low), 9)
    values = [min(max(unknown.outer(float(x)), unknown.low), unknown.high) for x in at]
    found = profile(problem, fit, name, sorted(set(values)))
    return [{"value": value, "rise": rise} for value, rise in found]


def _record(
    fit: BenchFit,
    problem: FitProblem,
    predictions: Sequence[Prediction],
    profiles: dict[str, list[dict[str, float]]],
) -> dict[str, Any]:
    """What fit.json holds."""
    return {
        "recordings": [
            {"name": each.name, "units": each.units, "windows": each.count} for each in problem.observations
        ],
        "estimates": [asdict(each) for each in fit.estimates],
        "combinations": identified_combinations(fit, problem),
        "rms_right_kpa": fit.off[0] / KPA,
        "rms_left_kpa": fit.off[1] / KPA,
        "rms_bend_deg": fit.off[2] / DEG,
        "misfit": fit.misfit,
        "discrepancy": problem.sizes,
        "converged": fit.converged,
        "doubtful": fit.doubtful,
        "courses": fit.evaluations,
        "held_out": [_prediction_row(each) for each in predictions],
        "profiles": profiles,
        "covariance": fit.covariance,
    }


def _prediction_row(each: Prediction) -> dict[str, Any]:
    return {
        "recording": each.name,
        "units": each.units,
        "rms_right_kpa": each.right / KPA,
        "rms_left_kpa": each.left / KPA,
        "rms_bend_deg": each.angle / DEG,
        "pulses": each.pulses,
    }


def _window_rows(fit: BenchFit, problem: FitProblem) -> list[dict[str, Any]]:
    """Seen and modelled means, for the figure."""
    rows: list[dict[str, Any]] = []
    x = np.array(
        [unknown.inner(each.value) for (unknown, _), each in zip(problem.columns, fit.estimates, strict=True)]
    )
    for which, seen in enumerate(problem.observations):
        model = problem.measured(x, which, problem.course(x, which))
        for name, windows, mean, unit in zip(
            ("pressure_right_kpa", "pressure_left_kpa", "bend_deg"),
            (seen.right, seen.left, seen.angle),
            model,
            (KPA, KPA, DEG),
            strict=True,
        ):
            resting = windows.resting(seen)
            for k in np.flatnonzero(resting):
                rows.append(
                    {
                        "recording": seen.name,
                        "quantity": name,
                        "time_s": float(seen.grid[windows.steps[k, 1]]),
                        "measured": float(windows.values[k] / unit),
                        "fitted": float(mean[k] / unit),
                        "sigma": float(windows.sigma[k] / unit),
                    }
                )
    return rows


def _attribution_record(found: Attribution) -> dict[str, Any]:
    main = {quantity: found.main_cause(quantity) for quantity in QUANTITIES}
    return {
        "top_kpa": found.top / KPA,
        "ideal": dict(zip(QUANTITIES, found.ideal, strict=True)),
        "real": dict(zip(QUANTITIES, found.real, strict=True)),
        "offset": {quantity: found.offset(quantity) for quantity in QUANTITIES},
        "main_cause": main,
        "paper_says": PAPER_SAYS,
        "paper_holds": {quantity: cause == PAPER_SAYS for quantity, cause in main.items()},
        "shapley": found.shapley,
        "first": found.first,
        "last": found.last,
    }
