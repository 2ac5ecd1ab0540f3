"""A command in a process of its own, with its wall time, CPU time and peak memory."""

import os
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Usage:
    """What a process took; memory is its largest resident set [MB]."""

    code: int
    wall_s: float
    cpu_s: float
    memory_mb: float


def run_measured(
    command: Sequence[str],
    log: Path,
    directory: Path | None = None,
    environment: Mapping[str, str] | None = None,
    limit_s: float = 3600.0,
) -> Usage:
    """Run a command to its end and measure it, children that it waited for included.

    log : takes its output; environment : added to ours; limit_s : the process is killed after this time
    """
    started = time.perf_counter()
    with log.open("wb") as output:
        process = subprocess.Popen(
            command, cwd=directory, env={**os.environ, **(environment or {})}, stdout=output, stderr=output
        )
        timer = threading.Timer(limit_s, process.kill)
        timer.start()
        _, status, used = os.wait4(process.pid, 0)
        timer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - started
    return Usage(process.returncode, wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)
