"""The demo's stages side by side, in worker processes that share the processors between them.

A worker makes the list of stages anew and takes the one that is named: stages hold functions, which do not
travel. Stages that need others wait for them; of the rest the longest begins first.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import TYPE_CHECKING

from tubefoot.errors import ConvergenceError, TubefootError

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage

News = tuple[str, float, str]
"""Name of a stage, share of it that is done, a line of text."""
MOST_WORKERS = 4
"""Each takes about half a gigabyte."""
LISTEN_S = 0.2

_news: SimpleQueue[News] | None = None
"""In a worker: the way to the program that started it."""


def usual_workers() -> int:
    """How many stages go on at once when nothing else was asked for."""
    return min(os.cpu_count() or 1, MOST_WORKERS)


def run_side_by_side(
    planned: Sequence[Stage],
    quick: bool,
    root: Path,
    workers: int,
    tell: Callable[[Stage, float, str], None],
    ended: Callable[[Stage], None],
) -> None:
    """Run all stages; raises what one of them raised, after stopping the others.

    planned : in the order of the report; quick : as they were made; root : directory of the runs
    workers : how many at once; tell : hears how far a stage is; ended : hears of its end
    """
    context = multiprocessing.get_context("spawn")
    news: SimpleQueue[News] = context.SimpleQueue()
    stages = {stage.name: stage for stage in planned}

    def listen() -> None:
        while not news.empty():
            name, share, line = news.get()
            tell(stages[name], share, line)

    with _threads_each(workers), ProcessPoolExecutor(workers, context, _begin, (news,)) as pool:
        try:
            running: dict[Future[None], Stage] = {}
            waiting, done = list(planned), set[str]()
            while waiting or running:
                for stage in _next(waiting, done, workers - len(running)):
                    waiting.remove(stage)
                    running[pool.submit(_work, quick, stage.name, root / stage.name)] = stage
                over, _ = wait(running, LISTEN_S, FIRST_COMPLETED)
                listen()
                for future in over:
                    stage = running.pop(future)
                    _result(future, stage)
                    done.add(stage.name)
                    ended(stage)
        except BaseException:
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def _next(waiting: Sequence[Stage], done: set[str], free: int) -> list[Stage]:
    """The stages that begin now, one for each free worker: the longest of those that wait for nothing."""
    ready = [stage for stage in waiting if done.issuperset(stage.after)]
    return sorted(ready, key=lambda stage: -stage.cost)[:free]


def _result(future: Future[None], stage: Stage) -> None:
    try:
        future.result()
    except BrokenProcessPool:
        raise TubefootError(
            f"the process that ran {stage.name}, or one beside it, was ended from outside (memory?); "
            "the same command goes on from here, with --workers 1 in less memory"
        ) from None


@contextmanager
def _threads_each(workers: int) -> Iterator[None]:
    """Processes that start meanwhile use their share of the processors; what the user set is kept."""
    from tubefoot.study.crew import THREAD_VARIABLES

    share = str(max(1, (os.cpu_count() or 1) // workers))
    added = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(added, share))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


def _begin(news: SimpleQueue[News]) -> None:
    """In a worker, at its start: it ends with Ctrl-C, and with the program that started it."""
    from tubefoot.study.crew import die_with_parent

    global _news
    _news = news
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    die_with_parent()


def _work(quick: bool, name: str, directory: Path) -> None:
    """In a worker: run a stage."""
    from tubefoot.cli.demo_stages import stages

    assert _news is not None
    put = _news.put
    (stage,) = (stage for stage in stages(quick) if stage.name == name)
    try:
        stage.run(directory, lambda share, line: put((name, share, line)))
    except ConvergenceError as error:
        raise ConvergenceError(f"{name}: {error}") from None  # its last state is too much for the way back
    except TubefootError as error:
        error.args = (f"{name}: {error}",)
        raise
