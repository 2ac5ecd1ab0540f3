"""A progress bar where somebody watches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")


def with_progress(items: Iterable[Item], what: str, total: int | None) -> Iterator[Item]:
    """The items, with a progress bar on a terminal.

    items : to pass on; what : they are, in a word; total : how many, None if that is not known
    """
    import sys

    from rich.console import Console
    from rich.progress import track

    if not sys.stderr.isatty():
        yield from items
        return
    yield from track(items, what, total=total, console=Console(stderr=True), transient=True)
