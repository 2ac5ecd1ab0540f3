"""The dashboard: pictures and samples that reach a page, the emergency stop's delay, CPU.

python -m benchmarks dashboard

The bench runs at the wall clock's pace, so rates on the wall clock need an idle computer. Memory over half an
hour: python -m benchmarks.dashboard_soak
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from tests.browsing import browser
from tests.dashboard_bench import TOKEN, served, until
from websockets.sync.client import ClientConnection, connect

from benchmarks.row import Row
from tubefoot.dashboard.wire import ANGLES, PICTURE_KIND, SAMPLES, unpacked

WATCH_S = 20.0
CLICKS = 20
FRAMES_WANTED, SAMPLES_WANTED, STOP_WANTED_MS = 25.0, 20.0, 200.0


def run() -> list[Row]:
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as (bench, dashboard):
        rows = _rates(bench, dashboard)
        with browser() as chromium:
            rows += _page(chromium, bench, dashboard)
            rows += _stops(chromium, bench, dashboard)
    return rows


def _rates(bench: Any, dashboard: Any) -> list[Row]:
    """What one websocket gets in twenty seconds, without a browser on this computer."""
    address = f"{dashboard.origin.replace('http', 'ws')}/live?token={TOKEN}&page=bench"
    with connect(address, max_size=2**22) as socket:
        _counted(socket, 1.0)
        wall, own, before = time.perf_counter(), time.process_time(), bench.virtual.clock.now()
        counts = _counted(socket, WATCH_S)
        passed, cpu = time.perf_counter() - wall, time.process_time() - own
        bench_s = bench.virtual.clock.now() - before
    pace = bench_s / passed
    note = f"bench at {pace:.2f} of the wall clock; {cpu / bench_s:.2f} s CPU a bench second, bench included"
    return [
        _rate("pictures a second", counts["pictures"] / passed, FRAMES_WANTED, note),
        _rate("pictures a bench second", counts["pictures"] / passed / pace, FRAMES_WANTED, note),
        _rate("angles a bench second", counts["angles"] / passed / pace, SAMPLES_WANTED, note),
        _rate("pressures a bench second", counts["samples"] / passed / pace, SAMPLES_WANTED, note),
        Row("websocket", counts["bytes"] / passed / 1e6, None, "", None, "MB/s"),
    ]


def _counted(socket: ClientConnection, seconds: float) -> dict[str, int]:
    counts = dict.fromkeys(("pictures", "angles", "samples", "bytes"), 0)
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        data = socket.recv()
        assert isinstance(data, bytes)
        found = unpacked(data)
        counts["pictures"] += PICTURE_KIND in found
        counts["angles"] += found.get(ANGLES, (0, b""))[0]
        counts["samples"] += found.get(SAMPLES, (0, b""))[0]
        counts["bytes"] += len(data)
    return counts


def _page(chromium: Any, bench: Any, dashboard: Any) -> list[Row]:
    """Pictures that Chromium draws, with software OpenGL on the same computer."""
    page = chromium.new_page()
    page.goto(dashboard.address)
    until(lambda: page.evaluate("tubefoot.seen.frames") > 10)
    first, wall, before = (
        page.evaluate("tubefoot.seen.frames"),
        time.perf_counter(),
        bench.virtual.clock.now(),
    )
    time.sleep(WATCH_S)
    drawn = page.evaluate("tubefoot.seen.frames") - first
    passed, bench_s = time.perf_counter() - wall, bench.virtual.clock.now() - before
    page.close()
    note = f"{drawn / bench_s:.1f} a bench second; bench at {bench_s / passed:.2f} of the wall clock"
    return [_rate("pictures drawn by Chromium", drawn / passed, FRAMES_WANTED, note)]


def _stops(chromium: Any, bench: Any, dashboard: Any) -> list[Row]:
    """From the click's own time stamp to the firmware's pin, in the bench's time."""
    page = chromium.new_page()
    page.goto(dashboard.address)
    page.click("#take")
    page.evaluate(
        "document.getElementById('stop').addEventListener('click', event => {"
        " window.clicked = performance.timeOrigin + event.timeStamp; }, {capture: true})"
    )
    page.fill("#duty", "0.3")
    page.fill("#duration", "5")
    delays, walls = [], []
    for click in range(CLICKS):
        page.wait_for_selector("#forward:enabled")
        page.click("#reverse" if click % 2 else "#forward")
        until(lambda: bench.pumping)
        page.click("#stop")
        until(lambda: not bench.pumping)
        clicked = page.evaluate("clicked") / 1e3
        walls.append(1e3 * (bench.pins[-1][0] - clicked))
        delays.append(1e3 * (bench.pins[-1][1] - bench.bench_time_at(clicked)))
        page.click("#release")
    page.close()
    note = (
        f"bench time: median {np.median(delays):.0f} ms of {CLICKS} clicks; wall clock: median "
        f"{np.median(walls):.0f}, worst {max(walls):.0f} ms"
    )
    return [
        Row(
            "emergency stop, click to pin, worst",
            float(max(delays)),
            STOP_WANTED_MS,
            "wanted at most",
            STOP_WANTED_MS / float(max(delays)),
            "ms",
            note,
        )
    ]


def _rate(name: str, ours: float, wanted: float, note: str) -> Row:
    return Row(name, ours, wanted, "wanted at least", ours / wanted, "1/s", note)
