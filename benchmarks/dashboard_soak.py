"""Half an hour of a running dashboard: does memory grow, in the program or in the page?

python -m benchmarks.dashboard_soak --minutes 30

The virtual bench with rendered pictures runs as fast as it goes, not at the wall clock's pace; a page in
headless Chromium watches all the time and orders bends, pulses and recordings. Every simulated minute a line:
resident memory of the program after a garbage collection, heap of the page after one, motions done. Growth is
from the third to seventh minute (rings and caches are full then) to the last five, by their medians, since
the page's heap scatters by a tenth from one minute to the next.
"""

from __future__ import annotations

import argparse
import gc
import resource
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

from tests.browsing import browser
from tests.dashboard_bench import OpenBench, served, until

from tubefoot.dashboard.helm import Helm

MB = 1e6
SETTLED_MIN, SPAN_MIN = 3, 5
ORDER_S = 1800.0
"""An order takes two minutes of the bench at most, which a busy computer may stretch [s]."""
PROGRAM = (
    {"do": "bend", "target_deg": 20, "controller": "paper"},
    {"do": "bend", "target_deg": -15, "controller": "paper"},
    {"do": "follow", "amplitude_deg": 10, "period_s": 10, "cycles": 1},
    {"do": "pulse", "direction": 1, "duty": 0.5, "duration_s": 0.1},
    {"do": "bend", "target_deg": 0, "controller": "paper"},
    {"do": "zero"},
)


def resident_mb() -> float:
    """Memory of this process [MB], garbage collected."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / MB


def page_heap_mb(page: Any) -> float:
    """Heap of a page's scripts [MB], garbage collected."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"]
    session.detach()
    return float(used) / MB


def soak(minutes: int, pixels: bool = True, out: Path | None = None) -> list[dict[str, float]]:
    """One row a simulated minute: minute, program_mb, page_mb, orders, pictures, cpu_s.

    minutes : simulated
    pixels : rendered pictures, tracked and sent
    out : where recordings go, a temporary directory if not given
    """
    rows: list[dict[str, float]] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        served(out or Path(folder), pixels=pixels, live=False, helm=Helm(60.0)) as (bench, dashboard),
        browser() as chromium,
    ):
        page = chromium.new_page()
        page.goto(dashboard.address)
        page.click("#take")
        holder = until(lambda: bench.helm.holder)
        orders = 0
        for minute in range(1, minutes + 1):
            orders = _minute(bench, holder, minute, orders)
            rows.append(
                {
                    "minute": minute,
                    "program_mb": resident_mb(),
                    "page_mb": page_heap_mb(page),
                    "orders": orders,
                    "pictures": page.evaluate("tubefoot.seen.frames"),
                    "cpu_s": time.process_time(),
                }
            )
            print("  ".join(f"{key} {value:.1f}" for key, value in rows[-1].items()), flush=True)
    return rows


def _minute(bench: OpenBench, holder: str, minute: int, orders: int) -> int:
    """Orders one after the other until the bench's minute is over; how many there were in all."""
    until(lambda: not bench.session.busy, ORDER_S)
    recording = minute % 5 == 1
    if recording:
        bench.desk.do(holder, {"do": "record", "pictures": False})
    while bench.virtual.clock.now() < 60.0 * minute:
        bench.desk.do(holder, {**PROGRAM[orders % len(PROGRAM)], "goes_on": True})
        orders += 1
        until(lambda: not bench.session.busy, ORDER_S)
    if recording:
        bench.desk.do(holder, {"do": "end_record"})
    return orders


def growth(rows: list[dict[str, float]], key: str) -> float:
    """Growth of a column from the settled begin to the end, as a share; nan for a run too short to tell.

    rows : from `soak`
    key : of the column
    """
    column = [row[key] for row in rows[SETTLED_MIN - 1 :]]
    if len(column) < 2 * SPAN_MIN:
        return float("nan")
    return median(column[-SPAN_MIN:]) / median(column[:SPAN_MIN]) - 1.0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=int, default=30)
    parser.add_argument("--no-pictures", action="store_true")
    given = parser.parse_args()
    table = soak(given.minutes, not given.no_pictures)
    for name in ("program_mb", "page_mb"):
        print(f"growth of {name}: {100 * growth(table, name):+.1f} %")
