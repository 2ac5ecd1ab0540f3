"""`python -m benchmarks.fit_coverage [--count 100]`: do the 95 % intervals of fits hold hidden truths?

Each seed draws a bench, the whole virtual bench runs a short campaign on it, the lean model is fitted to
the recording, and only then the truth is looked at. Everything is kept in build/fit_coverage, recording and
result of each seed: an interrupted run goes on; `--record` makes recordings only, `--again` fits those that
are there anew, `--summary` counts. The verdict is that of seeds 0 to 99 and goes into
benchmarks/data/coverage.csv; the fit was worked on with seeds from 1000 on.
"""

import argparse
import json
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

from tubefoot.errors import TubefootError
from tubefoot.records import write_json, write_table
from tubefoot.reduced.files import reference_file
from tubefoot.validation.attribution import values_of
from tubefoot.validation.bench_fit import GOALS, fit_bench
from tubefoot.validation.bench_parameters import MAIN
from tubefoot.validation.campaign import Campaign, load_campaign
from tubefoot.validation.fit_problem import FitProblem
from tubefoot.validation.loading import load_recording
from tubefoot.validation.virtual_experiment import run_blind, unseal
from tubefoot.validation.windows import observe

RESULTS = Path("build/fit_coverage")
TABLE = Path(__file__).parent / "data" / "coverage.csv"
CAMPAIGNS = Path(__file__).parents[1] / "examples" / "campaigns"
VERDICT = range(100)


def short_campaign(units: int) -> Campaign:
    """One round of the cyclic campaign: to the right, a hold, back, to the left, back."""
    return load_campaign(CAMPAIGNS / f"cyclic-{units}.toml").model_copy(update={"repeats": 1})


def recorded(seed: int, units: int, place: Path) -> dict[str, Any]:
    """Where the blind recording of a seed lies, the hash of its truth, and what it cost; made if need be."""
    note = place / "made.json"
    if not note.exists():
        shutil.rmtree(place, ignore_errors=True)  # what an interrupted run left
        started = time.process_time()
        recording, digest = run_blind(seed, units, short_campaign(units), place)
        made = {"recording": recording.name, "digest": digest, "cpu_s": time.process_time() - started}
        write_json(note, made)
    found: dict[str, Any] = json.loads(note.read_text())
    return found


def trial(seed: int, units: int, place: Path) -> dict[str, Any]:
    """One blind experiment and its fit: for each unknown the truth, the value and the interval."""
    made = recorded(seed, units, place)
    started, begun = time.process_time(), time.perf_counter()
    content = reference_file()
    seen = observe(load_recording(place / made["recording"]))
    problem = FitProblem(content.to_finger(), content.to_prony(), [seen])
    fit = fit_bench(problem)
    cpu, wall = time.process_time() - started, time.perf_counter() - begun
    truth = values_of(unseal(place, made["digest"]), problem.duty)
    rows = {
        name: {
            "truth": truth[name],
            "value": (each := fit.of(name)).value,
            "low": each.low,
            "high": each.high,
            "identified": each.identified,
            "relative_sigma": each.relative_sigma,
            "learnt": each.learnt,
        }
        for name in MAIN
    }
    return {
        "seed": seed,
        "units": units,
        "sizes": problem.sizes,
        "off": [fit.off[0] * 1e3, fit.off[1] * 1e3, np.degrees(fit.off[2])],
        "converged": fit.converged,
        "courses": fit.evaluations,
        "experiment_cpu_s": made["cpu_s"],
        "fit_cpu_s": cpu,
        "fit_wall_s": wall,
        "unknowns": rows,
    }


def inside(row: Mapping[str, Any]) -> bool:
    """Whether the interval holds the truth."""
    return bool(row["low"] <= row["truth"] <= row["high"])


def binomial_interval(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share, Clopper and Pearson's."""
    low = beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0
    return float(low), float(high)


def recovered(name: str, row: Mapping[str, Any]) -> bool:
    """Whether a value is within its goal of the truth."""
    return bool(abs(row["value"] - row["truth"]) <= GOALS.get(name, 0.2) * abs(row["truth"]))


def summary(trials: Sequence[Mapping[str, Any]]) -> None:
    """One line for each unknown."""
    if not trials:
        return
    print(f"{len(trials)} blind experiments, {sum(t['converged'] for t in trials)} fits converged")
    off = np.median([t["off"] for t in trials], axis=0)
    print(f"RMS of residuals, median: {off[0]:.3f} and {off[1]:.3f} kPa, {off[2]:.3f} deg")
    cost = [np.median([t[key] for t in trials]) for key in ("experiment_cpu_s", "fit_cpu_s", "courses")]
    print(f"median cost: recording {cost[0]:.1f} s, fit {cost[1]:.1f} s of CPU, {cost[2]:.0f} courses")
    print(
        f"{'unknown':24} {'in 95 %':>8} {'(binomial)':>12} {'bias':>7} {'off, median':>12} {'off, 90 %':>10}"
        f" {'identified':>10} {'of these in goal':>17} {'in goal or not identified':>26}"
    )
    for name in MAIN:
        rows = [t["unknowns"][name] for t in trials]
        hits = sum(map(inside, rows))
        low, high = binomial_interval(hits, len(rows))
        off = np.array([(row["value"] - row["truth"]) / max(abs(row["truth"]), 1e-9) for row in rows])
        known = [row for row in rows if row["identified"]]
        good = sum(recovered(name, row) for row in known)
        middle, far = np.quantile(np.abs(off), [0.5, 0.9])
        print(
            f"{name:24} {hits:4}/{len(rows):3} {100 * low:5.0f} to {100 * high:3.0f}"
            f" {100 * np.median(off):+6.1f}%"
            f" {100 * middle:11.1f}% {100 * far:9.1f}% {len(known):10} {good:17}"
            f" {good + len(rows) - len(known):26}"
        )
    every = [inside(row) for t in trials for row in t["unknowns"].values()]
    # Intervals of one fit are not independent: the share's uncertainty is that of means over fits.
    each = [np.mean([inside(row) for row in t["unknowns"].values()]) for t in trials]
    error = 1.96 * np.std(each) / np.sqrt(len(each))
    print(f"all {len(every)} intervals: {100 * np.mean(every):.1f} % +- {100 * error:.1f} %")


def table(trials: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of coverage.csv."""
    return [
        {"seed": each["seed"], "units": each["units"], "unknown": name}
        | {key: row[key] for key in ("truth", "value", "low", "high", "identified")}
        | {"inside": inside(row)}
        for each in trials
        for name, row in each["unknowns"].items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=len(VERDICT))
    parser.add_argument("--units", type=int, default=3, choices=(3, 6))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--record", action="store_true", help="recordings only")
    parser.add_argument("--again", action="store_true", help="fit anew what was fitted")
    parser.add_argument("--summary", action="store_true", help="only count what is there")
    given = parser.parse_args()
    trials, failed = [], []
    for seed in range(given.first, given.first + given.count):
        place = RESULTS / f"{given.units}-units" / f"seed-{seed}"
        path = place / "fit.json"
        if given.record:
            print(f"seed {seed}: {recorded(seed, given.units, place)['cpu_s']:.1f} s", flush=True)
            continue
        if given.again or not path.exists():
            if given.summary:
                continue
            try:
                result = trial(seed, given.units, place)
            except TubefootError as error:
                result = {"seed": seed, "failed": str(error)}
            write_json(path, result)
            print(f"seed {seed}: {result.get('off', result.get('failed'))}", flush=True)
        found = json.loads(path.read_text())
        (failed if "failed" in found else trials).append(found)
    for each in failed:
        print(f"seed {each['seed']} failed: {each['failed']}")
    summary(trials)
    if trials and given.first == VERDICT.start and given.units == 3:
        write_table(TABLE, table(trials))


if __name__ == "__main__":
    main()
