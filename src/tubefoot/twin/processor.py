"""What runs the firmware behind a simulated board: a simulated processor, or the firmware's native core.

Each request runs it for a number of cycles and tells the voltages at the pins; the answer tells what the
pump's pins did and what was sent (firmware/simulator/bridge.c has the layout). `PipedProcessor` runs the very
binary of the board, instruction by instruction; `NativeCore` runs its portable part compiled for this
computer, some hundred times faster, without the chip: no hang, no watchdog, no RAM to measure.
"""

from __future__ import annotations

import _ctypes
import contextlib
import ctypes
import os
import shutil
import struct
import subprocess
import tempfile
import weakref
from pathlib import Path
from typing import Protocol

from tubefoot.errors import LinkError
from tubefoot.twin.firmware import built

CYCLES_PER_S = 16_000_000
REQUEST = struct.Struct("<I4HHBBH")
"""cycles, four inputs [mV], supply [mV], operation, 0, bytes that follow"""
ANSWER = struct.Struct("<QIBBBBH")
"""cycle, cycles with the pump enabled, direction pins, enable pin, state, 0, bytes that follow"""
BYTES_AT_ONCE = 65_000


class Processor(Protocol):
    """Runs the firmware for as long as it is told."""

    def exchange(self, request: bytes, outgoing: bytes) -> tuple[bytes, bytes]:
        """The answer and the bytes sent.

        request : packed as REQUEST
        outgoing : bytes to the board's serial line, at most BYTES_AT_ONCE
        """

    def close(self) -> None:
        """Switch off; may be called twice."""


class PipedProcessor:
    """A simulator as a process of its own, by default simavr with the board's program."""

    def __init__(
        self, firmware: Path | None = None, bootloader: Path | None = None, simulator: list[str] | None = None
    ):
        """Start it.

        firmware : the program's .elf; the bench's if not given, none at all for an empty path
        bootloader : a boot loader's .hex to start in
        simulator : command line of the simulator; simavr's bridge if not given
        """
        command = simulator or [str(built("bridge"))]
        program = str(firmware or built("board.elf")) if firmware != Path() else ""
        process = subprocess.Popen(
            [*command, program, str(bootloader or "")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
        )
        if process.stdin is None or process.stdout is None:
            raise LinkError("the simulated board could not be started with pipes")
        self._process = process
        self._to, self._from = process.stdin.fileno(), process.stdout.fileno()
        self._cleanup = weakref.finalize(self, _end, process)

    def exchange(self, request: bytes, outgoing: bytes) -> tuple[bytes, bytes]:
        """The answer and the bytes sent.

        request : packed as REQUEST
        outgoing : bytes to the board
        """
        if not self._cleanup.alive:
            raise LinkError("the simulated board is switched off")
        try:
            os.write(self._to, request + outgoing)
            data = os.read(self._from, 65_536)
            while not _whole(data) and (more := os.read(self._from, 65_536)):
                data += more
        except OSError as error:
            raise LinkError(f"the simulated board has ended: {error}") from error
        if len(data) < ANSWER.size:
            raise LinkError(f"the simulated board has ended with exit code {self._process.wait()}")
        return data[: ANSWER.size], data[ANSWER.size :]

    def close(self) -> None:
        """End the process."""
        self._cleanup()


class NativeCore:
    """The firmware's portable part as a library in this process; each one is a board of its own."""

    def __init__(self) -> None:
        self._core = _load_alone(built("core.so"))
        self._answer = ctypes.create_string_buffer(ANSWER.size)
        self._buffer = bytearray(65_536)
        self._bytes = (ctypes.c_char * len(self._buffer)).from_buffer(self._buffer)
        self._step = self._core.core_step
        self._step.argtypes = [ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p]
        self._step.restype = ctypes.c_uint16
        self._core.core_power_up()
        self._on = True
        self._cleanup = weakref.finalize(self, _ctypes.dlclose, self._core._handle)

    def exchange(self, request: bytes, outgoing: bytes) -> tuple[bytes, bytes]:
        """The answer and the bytes sent.

        request : packed as REQUEST
        outgoing : bytes to the board
        """
        if not self._on:
            raise LinkError("the simulated board is switched off")
        if outgoing:
            self._buffer[: len(outgoing)] = outgoing
        count = self._step(request, self._answer, self._bytes)
        return self._answer.raw, bytes(self._buffer[:count]) if count else b""

    def close(self) -> None:
        """Unload it."""
        self._on = False
        self._cleanup()


def _load_alone(library: Path) -> ctypes.CDLL:
    """A library with variables of its own: the loader would share them between two loads of one file."""
    with tempfile.TemporaryDirectory(prefix="tubefoot-core-") as folder:
        return ctypes.CDLL(shutil.copy(library, folder))


def _whole(data: bytes) -> bool:
    """Whether an answer has come with all its bytes."""
    return len(data) >= ANSWER.size and len(data) >= ANSWER.size + ANSWER.unpack_from(data)[-1]


def _end(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    try:
        process.wait(timeout=5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
