"""`python -m benchmarks.fit_coverage [--count 100]`: do the 95 % intervals of fits hold hidden truths?

Each seed draws a bench, the whole virtual bench runs a short campaign on it, the lean model is fitted to
the recording, and only then the truth is looked at. Every seed is a file in build/fit_coverage: an
interrupted run goes on, and `--summary` only counts.
"""

import argparse
import json
import shutil
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tubefoot.errors import TubefootError
from tubefoot.records import write_json
from tubefoot.reduced.files import reference_file
from tubefoot.validation.attribution import values_of
from tubefoot.validation.bench_fit import fit_bench
from tubefoot.validation.bench_parameters import MAIN
from tubefoot.validation.campaign import Campaign, load_campaign
from tubefoot.validation.fit_problem import FitProblem
from tubefoot.validation.loading import load_recording
from tubefoot.validation.virtual_experiment import run_blind, unseal
from tubefoot.validation.windows import observe

RESULTS = Path("build/fit_coverage")
CAMPAIGNS = Path(__file__).parents[1] / "examples" / "campaigns"


def short_campaign(units: int) -> Campaign:
    """One round of the cyclic campaign: to the right, a hold, back, to the left, back."""
    return load_campaign(CAMPAIGNS / f"cyclic-{units}.toml").model_copy(update={"repeats": 1})


def trial(seed: int, units: int, directory: Path) -> dict[str, object]:
    """One blind experiment and its fit: for each unknown the truth, the value and the interval."""
    shutil.rmtree(directory, ignore_errors=True)
    started = time.process_time()
    recording, digest = run_blind(seed, units, short_campaign(units), directory)
    made = time.process_time() - started
    content = reference_file()
    problem = FitProblem(content.to_finger(), content.to_prony(), [observe(load_recording(recording))])
    fit = fit_bench(problem)
    spent = time.process_time() - started - made
    truth = values_of(unseal(directory, digest), problem.duty)
    shutil.rmtree(directory)
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
        "misfit": fit.misfit,
        "off": [fit.off[0] * 1e3, fit.off[1] * 1e3, np.degrees(fit.off[2])],
        "converged": fit.converged,
        "experiment_cpu_s": made,
        "fit_cpu_s": spent,
        "unknowns": rows,
    }


def inside(row: dict[str, float]) -> bool:
    """Whether the interval holds the truth."""
    return bool(row["low"] <= row["truth"] <= row["high"])


def summary(trials: Sequence[dict]) -> None:
    """One line for each unknown."""
    if not trials:
        return
    print(f"{len(trials)} blind experiments, {sum(t['converged'] for t in trials)} fits converged")
    off = np.median([t["off"] for t in trials], axis=0)
    print(f"RMS of residuals, median: {off[0]:.3f} and {off[1]:.3f} kPa, {off[2]:.3f} deg")
    print(f"{'unknown':24} {'in 95 %':>8} {'identified':>10} {'off, median':>12} {'off, 90 %':>10}")
    share = []
    for name in MAIN:
        rows = [t["unknowns"][name] for t in trials]
        covered = np.mean([inside(row) for row in rows])
        share.append(covered)
        off = [abs(row["value"] - row["truth"]) / max(abs(row["truth"]), 1e-9) for row in rows]
        known = np.mean([row["identified"] for row in rows])
        middle, far = np.quantile(off, [0.5, 0.9])
        print(f"{name:24} {100 * covered:7.0f}% {100 * known:9.0f}% {100 * middle:11.1f}% {100 * far:9.1f}%")
    print(f"{'all':24} {100 * np.mean(share):7.1f}%")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--units", type=int, default=3, choices=(3, 6))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--summary", action="store_true")
    given = parser.parse_args()
    trials = []
    for seed in range(given.first, given.first + given.count):
        path = RESULTS / f"{given.units}-units" / f"seed-{seed}.json"
        if not path.exists():
            if given.summary:
                continue
            try:
                result = trial(seed, given.units, RESULTS / f"{given.units}-units" / f"bench-{seed}")
            except TubefootError as error:
                result = {"seed": seed, "failed": str(error)}
            write_json(path, result)
            print(f"seed {seed}: {result.get('off', result.get('failed'))}", flush=True)
        trials.append(json.loads(path.read_text()))
    failed = [each for each in trials if "failed" in each]
    for each in failed:
        print(f"seed {each['seed']} failed: {each['failed']}")
    summary([each for each in trials if "failed" not in each])


if __name__ == "__main__":
    main()
