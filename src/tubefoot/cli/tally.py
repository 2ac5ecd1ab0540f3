"""The live table of a long study: done, running, failed, time left."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from rich.table import Table

    from tubefoot.study.known import Tally

LINE_EVERY_S = 5.0
"""Time between lines where the output is no terminal."""
FAULTS = ("failed", "error")


class TallyPrinter:
    """Shows a study's tally: a table that is redrawn on a terminal, now and then a line elsewhere."""

    def __init__(self) -> None:
        """Nothing is shown yet."""
        from rich.console import Console
        from rich.live import Live

        self._console = Console()
        self._live = Live(console=self._console, refresh_per_second=4) if self._console.is_terminal else None
        self._stage = ""
        self._started, self._printed = 0.0, 0.0

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, tally: Tally, row: dict[str, Any]) -> None:
        """Show how far a stage is.

        tally : of the stage; row : the newest result
        """
        now = time.perf_counter()
        if tally.stage != self._stage:
            self._stage, self._started, self._printed = tally.stage, now, -LINE_EVERY_S
        left = self._time_left(tally, now)
        if self._live is not None:
            self._live.update(self._table(tally, row, left))
        elif now - self._printed >= LINE_EVERY_S or tally.done >= tally.total:
            self._printed = now
            print(
                f"{tally.stage}: {tally.done} of {tally.total} done, {tally.under_way} running, "
                f"{_faults(tally)} failed{left}",
                flush=True,
            )

    def _time_left(self, tally: Tally, now: float) -> str:
        solved = tally.done - tally.found
        if solved < 2 or tally.done >= tally.total:
            return ""
        seconds = (now - self._started) * (tally.total - tally.done) / solved
        return f", about {seconds:.0f} s left" if seconds < 100 else f", about {seconds / 60:.0f} min left"

    def _table(self, tally: Tally, row: dict[str, Any], left: str) -> Table:
        from rich.table import Table

        table = Table(
            "stage", "done", "of", "found", "running", "failed", "core-hours", "newest", "time left"
        )
        table.add_row(
            tally.stage,
            str(tally.done),
            str(tally.total),
            str(tally.found),
            str(tally.under_way),
            str(_faults(tally)),
            f"{tally.core_s / 3600:.3f}",
            f"{row.get('name', '')} {row.get('status', '')}",
            left.removeprefix(", about ").removesuffix(" left"),
        )
        return table


def _faults(tally: Tally) -> int:
    return sum(tally.counts[status] for status in FAULTS)
