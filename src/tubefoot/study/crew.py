"""The workers of a study: a Dask cluster of this machine, or one that runs elsewhere.

Jobs are handed over as workers ask for them, so that memory does not grow with the number of candidates. The
scheduler gives the jobs of a killed worker to another one, and gives up a job that has killed several.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import signal
import sys
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar

from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.errors import ConfigError

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

JobType = TypeVar("JobType")

QUEUE_PER_THREAD = 2
"""Jobs handed over for each thread of the cluster, so that none waits for the next."""
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
CONNECT_S = 30
PR_SET_PDEATHSIG = 1


class CrewSettings(Settings):
    """Who does the jobs."""

    scheduler: str | None = None
    """Address of a running scheduler, such as tcp://head:8786; a local cluster when neither is given."""
    scheduler_file: str | None = None
    """File that a running scheduler wrote."""
    workers: Annotated[int, Field(ge=1, le=1024)] | None = None
    """Local workers; as many as the processors allow when not given."""
    threads: Annotated[int, Field(ge=1, le=256)] = 1
    """Threads of one job."""

    @model_validator(mode="after")
    def _one_cluster(self) -> Self:
        remote = [name for name in ("scheduler", "scheduler_file") if getattr(self, name) is not None]
        if len(remote) == 2:
            raise ValueError("scheduler and scheduler_file both name a cluster; give one of them")
        if remote and self.workers is not None:
            raise ValueError(f"workers is for a local cluster; that of {remote[0]} has its own")
        return self


class Crew:
    """A cluster as a context: jobs in, outcomes out as they come."""

    def __init__(self, settings: CrewSettings, function: Callable[[Any], Any]):
        """Nothing runs yet.

        settings : which cluster; function : does one job, on a worker; its module is imported there
        """
        self.settings, self.function = settings, function
        self._jobs: dict[str, Any] = {}

    def __enter__(self) -> Self:
        """Start or join the cluster; ConfigError when it does not answer."""
        import dask
        from distributed import Client, as_completed

        dask.config.set({"distributed.worker.daemon": True, "distributed.admin.log-format": "%(message)s"})
        self._cluster = self._local_cluster() if self._is_local else None
        address: Any = self._cluster or self.settings.scheduler
        try:
            if self.settings.scheduler_file is not None:
                self._client: Client = Client(scheduler_file=self.settings.scheduler_file, timeout=CONNECT_S)
            else:
                self._client = Client(address, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            where = self.settings.scheduler or self.settings.scheduler_file
            raise ConfigError(
                f"no scheduler answers at {where}: {error}; start it, or leave it out"
            ) from None
        self._waiting: Any = as_completed([], with_results=True, raise_errors=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give back what is not done, and stop a cluster that was started here."""
        for future in list(self._waiting.futures):
            future.cancel()
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()

    @property
    def threads(self) -> int:
        """How many jobs run at a time, of the workers that are there now."""
        return max(1, sum(self._client.nthreads().values()))

    @property
    def under_way(self) -> int:
        """Jobs handed over and not returned."""
        return len(self._jobs)

    def submit(self, job: Any) -> None:
        """Hand over a job.

        job : what the crew's function takes
        """
        future: Future = self._client.submit(self.function, job, pure=False)
        self._jobs[str(future.key)] = job
        self._waiting.add(future)

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Each job with its result, or with the exception that ended it, as they come; until none is left."""
        while self._jobs:
            future, result = next(self._waiting)
            job = self._jobs.pop(str(future.key))
            yield job, _failure(result) if future.status == "error" else result

    def work_through(self, jobs: Iterator[JobType]) -> Iterator[tuple[JobType, Any]]:
        """Each job with its outcome, as they come; jobs are taken only as workers become free.

        jobs : any number; one that ran dry is asked again after each outcome, for jobs that follow from it
        """
        self._fill(jobs)
        for outcome in self.outcomes():
            yield outcome
            self._fill(jobs)

    def _fill(self, jobs: Iterator[JobType]) -> None:
        """Hand over as many jobs as the cluster should have at hand."""
        wanted = QUEUE_PER_THREAD * self.threads - self.under_way
        for job in itertools.islice(jobs, max(0, wanted)):
            self.submit(job)

    @property
    def _is_local(self) -> bool:
        return self.settings.scheduler is None and self.settings.scheduler_file is None

    def _local_cluster(self) -> LocalCluster:
        from distributed import LocalCluster

        threads = self.settings.threads
        number = self.settings.workers or max(1, len(os.sched_getaffinity(0)) // threads)
        environment = {name: str(threads) for name in THREAD_VARIABLES}
        os.environ.update(environment)
        return LocalCluster(
            n_workers=number,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",  # any free port: two studies may run on one machine
            memory_limit=0,
            env=environment,
            preload=["tubefoot.study.orphan"],
            silence_logs=50,
        )


def _failure(result: Any) -> BaseException:
    """The exception in what a failed future gives."""
    if isinstance(result, BaseException):
        return result
    return result[1] if isinstance(result, tuple) else RuntimeError(str(result))


def die_with_parent() -> None:
    """Have the kernel end this process when the one that started it is gone, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
