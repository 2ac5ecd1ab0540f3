"""Preloaded by local workers: they end with the program that started them, also when it is killed."""

from __future__ import annotations

from typing import Any


def dask_setup(worker: Any) -> None:
    """Called by Dask in each worker as it starts.

    worker : that was started
    """
    from tubefoot.study.crew import die_with_parent

    die_with_parent()
