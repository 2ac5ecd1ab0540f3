"""The bench: round trip, lost samples, speed of the simulated board, size of the firmware, damaged frames.

python -m benchmarks rig
"""

from __future__ import annotations

import re
import subprocess
import time

import numpy as np

from benchmarks.row import Row
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, Operation, SimulatedBoard
from tubefoot.twin.firmware import BUILD, built

STREAM_S = 600.0
FLASH_BYTES = 32_256
RAM_BYTES = 2048


def run() -> list[Row]:
    return [*_round_trips(), *_stream(), *_size(), *_fuzz()]


def _round_trips() -> list[Row]:
    """Ping to answer in virtual time, at a step of 0.1 ms, while 200 samples a second stream."""
    with SimulatedBoard(BenchPlant(), step_s=1e-4) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        trips = []
        for count in range(100):
            rig.wait(0.0137 + 1e-4 * (count % 50))
            trips.append(1e3 * rig.round_trip())
    wire = 1e3 * (9 + 17) * 10 / 115_200  # a ping and its answer, ten bits a byte
    note = f"median; worst {max(trips):.1f} ms, with 200 Hz streaming; virtual time, USB not included"
    return [
        Row(
            "round trip of a command",
            float(np.median(trips)),
            wire,
            "bytes on the wire alone",
            None,
            "ms",
            note,
        )
    ]


def _stream() -> list[Row]:
    """Ten minutes at 200 Hz: samples lost and damaged, and how fast that went."""
    with SimulatedBoard(BenchPlant()) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        wall, cpu, samples = time.perf_counter(), time.process_time(), 0
        for _ in range(round(STREAM_S)):
            if rig.last_pulse is not None or samples == 0:
                rig.pulse(1 if rig.read().gauge_pressures[0] <= 0 else -1, 0.6, 0.4)
            samples += len(rig.wait(1.0))
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    lost = rig.lost_samples
    note = (
        f"of {samples} in {STREAM_S:.0f} simulated s, {rig.damaged_frames} damaged, a 0.4 s pulse each second"
    )
    speed = (
        f"lock-step at 1 ms; host and bench plant take {cpu / STREAM_S * 1e3:.0f} ms CPU a simulated second"
    )
    return [
        Row("samples lost at 200 Hz", float(lost), 0.0, "target", None, "samples", note),
        Row(
            "simulated board against real time",
            STREAM_S / wall,
            1.0,
            "real time",
            STREAM_S / wall,
            "x",
            speed,
        ),
    ]


def _size() -> list[Row]:
    report = subprocess.run(
        ["avr-size", "-C", "--mcu=atmega328p", built("board.elf")], capture_output=True, text=True, check=True
    ).stdout
    flash, ram = (int(re.search(rf"{name}:\s+(\d+) bytes", report)[1]) for name in ("Program", "Data"))
    with SimulatedBoard(BenchPlant()) as board:
        board.step(Operation.PAINT_RAM)
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        rig.pulse(1, 0.6, 0.4)
        rig.wait(2.0)
        free = board.untouched_ram()
    return [
        Row("firmware in flash", float(flash), float(FLASH_BYTES), "Uno with boot loader", None, "byte"),
        Row("firmware's variables", float(ram), float(RAM_BYTES), "Uno", None, "byte"),
        Row("RAM never touched by the stack", float(free), float(RAM_BYTES), "Uno", None, "byte", "painted"),
    ]


def _fuzz() -> list[Row]:
    rows = []
    for name, count in (("fuzz", 20_000_000), ("fuzz_weak", 20_000_000)):
        start = time.perf_counter()
        text = subprocess.run([built(name), str(count), "42"], capture_output=True, text=True).stdout
        total, wrong = int(text.split()[-3]), int(text.split()[-1])
        check = "CRC-32" if name == "fuzz" else "16 bits of it, to compare"
        rate = f"{check}; {total} frames in {time.perf_counter() - start:.0f} s, {BUILD.name}/{name}"
        rows.append(Row("damaged frames executed wrongly", float(wrong), 0.0, "target", None, "frames", rate))
    return rows
