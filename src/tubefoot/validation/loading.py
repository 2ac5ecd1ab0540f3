"""From a file to a recording that can be judged: baseline, pulses, outliers, latency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tubefoot.errors import ConfigError
from tubefoot.validation.baseline import DriftLine, rest_of
from tubefoot.validation.bench_mcap import read_bench_mcap
from tubefoot.validation.column_map import ColumnMap
from tubefoot.validation.foreign_csv import read_foreign_csv
from tubefoot.validation.latency import LEAST_CORRELATION, LEAST_SIGMAS, estimate_latency
from tubefoot.validation.outliers import angle_outliers, pressure_outliers
from tubefoot.validation.plausible import demand_plausible, demand_units_of_series
from tubefoot.validation.pulses import blind_stretches, found_pulses
from tubefoot.validation.recording import NO_LATENCY, BenchRecord, RawSeries


def load_recording(
    path: Path | str,
    columns: ColumnMap | None = None,
    drift: DriftLine = "none",
    units: int | None = None,
    synchronise: bool = True,
    name: str | None = None,
) -> BenchRecord:
    """A recording, pressures since rest, angles on the pressures' clock.

    path : `.mcap` of our own, or a table of any laboratory
    columns : how to read a table
    drift : which line is subtracted beside the rest: none, that of the rest before the first pulse, or from
        the first rest to the last
    units : of the finger, where the file does not say or is wrong
    synchronise : whether the estimated latency is taken off the angles' times
    name : what it is called; the file's name without its ending if not given

    Raises ConfigError when the file cannot be read, has too short a rest, or no pulse.
    """
    path = Path(path)
    if path.suffix == ".mcap":
        raw = read_bench_mcap(path)
    elif columns is not None:
        raw = read_foreign_csv(path, columns)
    elif path.exists():
        raise ConfigError(
            f"{path}: a table needs a column map; write one (examples/recordings/foreign-lab.toml shows "
            "how) and give it with --columns"
        )
    else:
        raise ConfigError(f"{path}: no such recording")
    record = prepared(raw, name or path.stem, drift, synchronise)
    return record if units is None else replace(record, units=units)


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """A short name for each file: its stem; with the directory where stems repeat.

    paths : of the files

    >>> distinct_names((Path("a/bench.mcap"), Path("b/bench.mcap"), Path("old.csv")))
    ['a', 'b', 'old']
    """
    stems = [path.stem for path in paths]
    if len(set(stems)) == len(stems):
        return stems
    names = [path.resolve().parent.name if stems.count(path.stem) > 1 else path.stem for path in paths]
    if len(set(names)) == len(names):
        return names
    return [f"{name}-{number}" for number, name in enumerate(names, start=1)]


def prepared(raw: RawSeries, name: str, drift: DriftLine = "none", synchronise: bool = True) -> BenchRecord:
    """A recording made of raw series.

    raw : as the source has it
    name : what it is called
    drift : see `load_recording`
    synchronise : whether the estimated latency is taken off

    Raises ConfigError, with the name, when there is too short a rest or no pulse, or when no bench can have
    measured it (`plausible.py`).
    """
    try:
        demand_units_of_series(raw)
        record = _record_of(raw, name, drift)
        demand_plausible(record)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from error
    latency = estimate_latency(record)
    sure = abs(latency.seconds) >= LEAST_SIGMAS * latency.sigma
    apply = synchronise and sure and latency.correlation >= LEAST_CORRELATION
    shift = latency.seconds if apply else 0.0
    return replace(record, latency=replace(latency, applied=apply), angle_time=record.angle_time - shift)


def _record_of(raw: RawSeries, name: str, drift: DriftLine) -> BenchRecord:
    """The recording with its baseline taken off and outliers flagged, the angles' latency not yet known."""
    start = float(raw.time[0])
    time, angle_time = raw.time - start, raw.angle_time - start
    listed = tuple(replace(pulse, start=pulse.start - start, end=pulse.end - start) for pulse in raw.pulses)
    wild = pressure_outliers(time, raw.pressures)
    pulses = listed or found_pulses(time, raw.pressures, raw.drive, wild)
    if not pulses:
        raise ConfigError(
            f"no pulse of the pump in {time[-1]:.3g} s, neither listed nor in drive or pressures; "
            "nothing can be compared"
        )
    rest, line = rest_of(raw, pulses, wild, drift)
    odd = angle_outliers(angle_time, raw.angle)
    return BenchRecord(
        name=name,
        units=raw.units,
        time=time,
        pressures=raw.pressures - line,
        drive=raw.drive,
        angle_time=angle_time,
        angle=raw.angle - rest.angle,
        angle_sigma=raw.angle_sigma,
        pressure_outlier=wild,
        angle_outlier=odd,
        pulses=pulses,
        rest=rest,
        latency=NO_LATENCY,
        blind=() if listed else blind_stretches(time),
        provenance=raw.provenance,
    )
