"""Real Dask workers: order, errors, laziness; workers and studies that are killed with SIGKILL."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tubefoot.config import parse_settings
from tubefoot.errors import ConfigError
from tubefoot.records import read_table
from tubefoot.study.crew import QUEUE_PER_THREAD, Crew, CrewSettings

STUDY = """
name = "tiny"
[fix]
units = 1
valley_outside_mm = 6.0
[vary]
fold_run_mm = [5.0, 4.0, 3.0]
partition_mm = [2.0, 2.5]
[solve]
element_size_mm = 6.0
states = 3
fields = "none"
[rank]
angle_deg = 3.0
"""
MEASURED = ("core_s",)
"""Columns that differ from run to run."""
DEADLINE_S = 300.0


def half(number: int) -> float:
    if number == 5:
        raise ValueError("five")
    return number / 2


def dies_once(marker: str) -> str:
    """Kills its own worker the first time."""
    if not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done by another worker"


def test_jobs_are_taken_as_workers_are_free_and_errors_come_back() -> None:
    taken: list[int] = []

    def jobs() -> Iterator[int]:
        for number in range(12):
            taken.append(number)
            yield number

    ahead = []
    outcomes: dict[int, Any] = {}
    with Crew(CrewSettings(workers=1), half) as crew:
        for job, outcome in crew.work_through(jobs()):
            outcomes[job] = outcome
            ahead.append(len(taken) - len(outcomes))
    assert isinstance(outcomes.pop(5), ValueError)
    assert outcomes == {number: number / 2 for number in range(12) if number != 5}
    assert max(ahead) < QUEUE_PER_THREAD


def test_a_cluster_is_named_once() -> None:
    with pytest.raises(ConfigError, match="both name a cluster"):
        parse_settings({"scheduler": "tcp://a:1", "scheduler_file": "b"}, CrewSettings)
    with pytest.raises(ConfigError, match="has its own"):
        parse_settings({"scheduler": "tcp://a:1", "workers": 2}, CrewSettings)


@pytest.mark.slow
def test_the_job_of_a_killed_worker_is_done_by_another(tmp_path: Path) -> None:
    with Crew(CrewSettings(workers=1), dies_once) as crew:
        crew.submit(str(tmp_path / "marker"))
        assert [outcome for _, outcome in crew.outcomes()] == ["done by another worker"]
    assert (tmp_path / "marker").exists()


def command(study: Path, out: Path, workers: int) -> list[str]:
    program = "from tubefoot.cli.main import main\nif __name__ == '__main__':\n    main()\n"
    script = study.with_name("run.py")
    script.write_text(program)
    flags = ["--workers", str(workers), "--no-pictures"]
    return [sys.executable, str(script), "screen", str(study), "--out", str(out), *flags]


def table_without_times(out: Path) -> list[dict[str, Any]]:
    rows = read_table(out / "candidates.csv")
    return [{key: cell for key, cell in row.items() if key not in MEASURED} for row in rows]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.toml"
    path.write_text(STUDY)
    return path


@pytest.mark.slow
def test_one_and_two_workers_give_the_same_table(study: Path, tmp_path: Path) -> None:
    for workers in (1, 2):
        subprocess.run(command(study, tmp_path / str(workers), workers), check=True, capture_output=True)
    one, two = (table_without_times(tmp_path / str(workers)) for workers in (1, 2))
    assert [row["status"] for row in one] == ["solved"] * 7
    assert one == two


@pytest.mark.slow
def test_a_killed_study_leaves_no_worker_and_repeats_nothing(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen(
        command(study, out, 2), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    wait_for(lambda: len(list(out.glob("designs/*/*/candidate.json"))) >= 2)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    wait_for(lambda: not members_of(process.pid))
    written = {path: path.stat().st_mtime_ns for path in out.glob("designs/*/*/candidate.json")}
    assert 2 <= len(written) < 7
    subprocess.run(command(study, out, 1), check=True, capture_output=True)
    assert {path: path.stat().st_mtime_ns for path in written} == written
    assert [row["status"] for row in table_without_times(out)] == ["solved"] * 7
    assert not list(out.glob("designs/*/*.part"))
    subprocess.run(command(study, tmp_path / "whole", 1), check=True, capture_output=True)
    assert table_without_times(out) == table_without_times(tmp_path / "whole")


def wait_for(condition: Any) -> None:
    started = time.monotonic()
    while not condition():
        assert time.monotonic() - started < DEADLINE_S, "waited in vain"
        time.sleep(0.1)


def members_of(session: int) -> list[int]:
    """Living processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


@pytest.mark.slow
def test_a_running_scheduler_is_joined_by_its_file(tmp_path: Path) -> None:
    file = tmp_path / "scheduler.json"
    program = [sys.executable, "-m"]
    options = ["--scheduler-file", str(file)]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [*program, "distributed.cli.dask_scheduler", "--port", "0", "--dashboard-address", ":0"]
    worker = [*program, "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    running = [subprocess.Popen([*scheduler, *options], **quiet)]
    try:
        wait_for(file.exists)
        # Workers of a cluster import the program, not its tests: `abs` stands for a job.
        running.append(subprocess.Popen([*worker, *options], **quiet))
        with Crew(CrewSettings(scheduler_file=str(file)), abs) as crew:
            assert dict(crew.work_through(iter([-1, -2, 3]))) == {-1: 1, -2: 2, 3: 3}
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait()


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tubefoot.study.crew.CONNECT_S", 0.5)
    with (
        pytest.raises(ConfigError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9"),
        Crew(CrewSettings(scheduler="tcp://127.0.0.1:9"), abs),
    ):
        pass
