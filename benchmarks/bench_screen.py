"""Screening: the scheduler's cost of a job, and one worker against two on real solves.

python -m benchmarks screen
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.row import Row
from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.candidates import make_candidate
from tubefoot.study.crew import Crew, CrewSettings
from tubefoot.study.evaluation import Job, evaluate

EMPTY_JOBS = 10_000
SOLVES = 24
SOLVE = {"element_size_mm": 5.0, "states": 3, "fields": "none"}


def run() -> list[Row]:
    per_job, cpu_per_job = empty_jobs(EMPTY_JOBS)
    walls, cores = zip(*(solves(workers) for workers in (1, 2)), strict=True)
    return [
        Row("empty job, wall", per_job, None, "", None, "ms", f"{EMPTY_JOBS} jobs, one worker"),
        Row("empty job, CPU of scheduler and client", cpu_per_job, None, "", None, "ms", "bounds jobs/s"),
        Row(f"{SOLVES} looks, one worker", walls[0], None, "", None, "s", f"{cores[0]:.1f} core-s"),
        Row(
            f"{SOLVES} looks, two workers",
            walls[1],
            walls[0],
            "one worker",
            walls[0] / walls[1],
            "s",
            f"efficiency {walls[0] / walls[1] / 2:.2f}, {cores[1]:.1f} core-s; load {os.getloadavg()[0]:.1f} "
            f"on {os.cpu_count()} processors",
        ),
    ]


def empty_jobs(number: int) -> tuple[float, float]:
    """Wall time and this process's CPU time of a job that does nothing [ms]."""
    with Crew(CrewSettings(workers=1), abs) as crew:
        crew.submit(0)
        list(crew.outcomes())
        wall, cpu = time.perf_counter(), time.process_time()
        done = sum(1 for _ in crew.work_through(iter(range(number))))
        spent = time.perf_counter() - wall, time.process_time() - cpu
    assert done == number
    return 1e3 * spent[0] / number, 1e3 * spent[1] / number


def solves(workers: int) -> tuple[float, float]:
    """Wall time of some looks, workers warm, and their core seconds."""
    with tempfile.TemporaryDirectory() as root, Crew(CrewSettings(workers=workers), evaluate) as crew:
        for job in jobs(root, 0, 2 * workers):
            crew.submit(job)
        list(crew.outcomes())
        started = time.perf_counter()
        records = [record for _, record in crew.work_through(jobs(root, 2 * workers, SOLVES))]
        return time.perf_counter() - started, sum(record["core_s"] for record in records)


def jobs(root: str, start: int, number: int) -> Iterator[Job]:
    """Two units each, all different, nearly the same work."""
    solve = parse_settings(SOLVE, SolveSettings)
    base = FingerDesign().with_bellows(units=2)
    for k in range(start, start + number):
        one = make_candidate(base, str(k), {"bellows.fold_run_mm": 4.5 + 0.01 * k})
        tables = solve.model_dump(mode="json")
        yield Job(one.name, one.key(solve), str(Path(root)), one.tables, tables, 6.0, 5.0, True, False)
