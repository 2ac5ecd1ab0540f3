"""`tubefoot validate`: recordings held against finite elements."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.validation.stage import Validated


def validate(
    *recording: Annotated[Path, Parameter(help="MCAP of a bench, or CSV of any laboratory")],
    against: Annotated[
        list[Path],
        Parameter(
            help="run directories of solves, one for each length of finger",
            consume_multiple=True,
            negative="",
        ),
    ],
    columns: Annotated[
        Path | None, Parameter(help="TOML: which column of a CSV is what, in which unit")
    ] = None,
    units: Annotated[
        int | None, Parameter(help="units of the recorded finger, where the file does not say")
    ] = None,
    fit: Annotated[
        Path | None, Parameter(help="run directory of `tubefoot fit`: its attribution is shown too")
    ] = None,
    settle_s: Annotated[float, Parameter(help="from a pulse's end to the state that is compared [s]")] = 0.5,
    drift: Annotated[
        Literal["none", "rest", "ends"],
        Parameter(
            help="drift line taken off the pressures: none, that of the first rest, first to last rest"
        ),
    ] = "none",
    synchronise: Annotated[bool, Parameter(help="take the estimated latency off the angles' times")] = True,
    seed: Annotated[int, Parameter(help="of the bootstrap")] = 0,
    out: Annotated[Path, Parameter(help="directory for the results")] = Path("out/validate"),
) -> None:
    """Compare recordings with solves: overlays, slopes, offsets with confidence, loops, claims C5, C6, C9.

    Writes states.csv, comparison.csv, bands.csv, loops.csv, validation.json, claims.json, validation.png and
    .svg, run.toml; with --fit the figure of its attribution.

    Example: tubefoot validate out/rig-record/bench.mcap --against out/reference-3
    """
    from tubefoot.errors import ConfigError
    from tubefoot.records import Run
    from tubefoot.report.fit import draw_attribution
    from tubefoot.report.validation import draw_validation
    from tubefoot.validation.column_map import load_column_map
    from tubefoot.validation.loading import distinct_names, load_recording
    from tubefoot.validation.prediction import load_prediction
    from tubefoot.validation.stage import validate_recordings, write_validation

    if not recording:
        raise ConfigError("no recording named; give the bench.mcap of `tubefoot rig record`, or a CSV")
    if not 0 <= settle_s <= 3600:
        raise ConfigError(f"--settle-s {settle_s:g}: allowed are 0 to 3600 s")
    causes = load_attribution(fit) if fit else None
    mapped = load_column_map(columns) if columns else None
    predictions = [load_prediction(path) for path in against]
    records = []
    for path, name in zip(recording, distinct_names(recording), strict=True):
        print(f"reading {path}", flush=True)
        records.append(load_recording(path, mapped, drift, units, synchronise, name))
    run = Run(
        out,
        "validate",
        {
            "recordings": [str(path) for path in recording],
            "against": [str(path) for path in against],
            "columns": mapped.model_dump(mode="json") if mapped else None,
            "units": units,
            "fit": str(fit) if fit else None,
            "settle_s": settle_s,
            "drift": drift,
            "synchronise": synchronise,
        },
        seed=seed,
    )
    found = validate_recordings(records, predictions, settle_s, seed, lambda text: print(text, flush=True))
    write_validation(found, run.directory)
    draw_validation(run.directory)
    if causes:
        draw_attribution(run.directory, causes)
    run.finish(**{claim.id: claim.verdict for claim in found.claims})
    tell(found)
    if causes:
        for quantity, cause in causes["main_cause"].items():
            share, whole = causes["shapley"][quantity][cause], causes["offset"][quantity]
            print(f"{quantity}: offset {whole:+.2f}, mainly by {cause} ({share:+.2f})")
    print(f"results: {run.directory}")


def load_attribution(directory: Path) -> dict[str, Any]:
    """What attribution.json of a fit holds.

    directory : of the run of `tubefoot fit`

    Raises ConfigError when there is none.
    """
    from tubefoot.errors import ConfigError

    path = directory / "attribution.json"
    if not path.exists():
        raise ConfigError(f"{path}: no such file; name the --out of a `tubefoot fit` that attributed offsets")
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def tell(found: Validated) -> None:
    """Print what was found, one table for all recordings and the verdicts.

    found : by `validate_recordings`
    """
    from tubefoot.validation.spread import LEAST_STROKES

    for record in found.records:
        late = record.latency
        text = (
            f"{1e3 * late.seconds:.0f} +- {1e3 * late.sigma:.0f} ms"
            if late.seconds == late.seconds
            else "unknown"
        )
        print(
            f"{record.name}: latency of the angles {text}{', taken off' if late.applied else ''}; "
            f"flagged {record.odd_samples} samples, {int(record.angle_outlier.sum())} angles"
        )
    for one in found.comparisons:
        print(f"{one.recording} against {one.run}: {one.states} states of {one.strokes} strokes")
        if not one.whole_strokes:
            print(f"  fewer than {LEAST_STROKES} strokes: the intervals are of single states and too narrow")
        for name, estimate in one.figures.items():
            print(f"  {name:<28} {estimate.value:9.3f}  ({estimate.low:.3f} to {estimate.high:.3f})")
        for name, value in found.steadiness[one.recording].items():
            unknown = "  unknown: needs a rest at neutral at the end" if "end_" in name else "  unknown"
            print(f"  {name:<28} {value:9.3f}" if value == value else f"  {name:<28}{unknown}")
        loops = found.loops[one.recording]
        if loops:
            widths = ", ".join(f"{loop.angle_width:.2f}" for loop in loops)
            print(f"  mean width of the angle's loops [deg]: {widths}")
    for claim in found.claims:
        print(f"{claim.id:>4} {claim.verdict}: {claim.statement}")
