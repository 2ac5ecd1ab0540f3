"""The real firmware on a simulated board, in lock-step with a plant, in virtual time.

The firmware runs in a processor (`processor.py`); each step it is told the voltages at the pins
and tells what the pump's pins did. Nothing happens between steps, so a run is repeatable to the bit and takes
as long as the computation, not as long as the time it simulates. `LockstepPort` gives the host's link the
same interface as a serial port: waiting for bytes is what makes virtual time pass.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from enum import IntEnum
from types import TracebackType

from tubefoot.errors import LinkError
from tubefoot.lab.port import Received
from tubefoot.twin.plant import Plant, PumpDrive
from tubefoot.twin.processor import ANSWER, BYTES_AT_ONCE, CYCLES_PER_S, REQUEST, PipedProcessor, Processor

_DIRECTIONS = {1: 1, 2: -1}
STANDING = PumpDrive(0, 0.0)
HOLD_UP_S = 0.1
"""A board at the wall clock's pace that was held up for longer goes on from where it was, without a rush."""


class Operation(IntEnum):
    """What to do to the board before a step."""

    RUN = 0
    RESET = 1
    PAINT_RAM = 2
    MEASURE_RAM = 3
    POWER_CYCLE = 4


class SimulatedBoard:
    """A board whose time stands still between calls of `step`. Close it, or use it as a context manager.

    plant : what the pins are wired to
    drive : what the pump got in the last step
    reset_due : whether the reset button is pressed before the next step
    time : virtual time since power-up [s]
    to_host, to_board : filters on the bytes in either direction, for fault injection
    """

    def __init__(self, plant: Plant, processor: Processor | None = None, step_s: float = 1e-3):
        """Power the board up.

        plant : what the pins are wired to
        processor : what runs the firmware; the real binary in simavr if not given
        step_s : length of a step [s]
        """
        self.plant = plant
        self.step_s = step_s
        self.drive = STANDING
        self.to_host: Callable[[bytes], bytes] = lambda data: data
        self.to_board: Callable[[bytes], bytes] = lambda data: data
        self.time = 0.0
        self._cycle = self._steps = 0
        self._outgoing = b""
        self._wire = threading.Lock()
        self.reset_due = False
        self._processor = processor or PipedProcessor()

    def __enter__(self) -> SimulatedBoard:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def pump_on(self) -> bool:
        """Whether the pump had current in the last step."""
        return self.drive.direction != 0 and self.drive.duty > 0

    def send(self, data: bytes) -> None:
        """Put bytes on the wire to the board, from any thread; they go with the next steps.

        data : bytes
        """
        with self._wire:
            self._outgoing += self.to_board(data)

    def step(self, operation: Operation = Operation.RUN) -> bytes:
        """The bytes that the board sent in one step of virtual time.

        operation : what to do to the board first
        """
        if self.reset_due:
            operation, self.reset_due = Operation.RESET, False
        out, _ = self._exchange(operation)
        self._pass_step()
        self.plant.step(self.step_s, self.drive)
        return self.to_host(out) if out else out

    def untouched_ram(self) -> int:
        """Bytes between variables and stack that were never written since `Operation.PAINT_RAM`."""
        _, count = self._exchange(Operation.MEASURE_RAM)
        self._pass_step()
        return count

    def close(self) -> None:
        """Switch the board off."""
        self._processor.close()

    def _pass_step(self) -> None:
        self._steps += 1
        self.time = self._steps * self.step_s

    def _exchange(self, operation: Operation) -> tuple[bytes, int]:
        """Run the processor to the end of the next step; what it sent, and the answer's count."""
        target = round((self._steps + 1) * self.step_s * CYCLES_PER_S)
        cycles = max(1, target - self._cycle)  # steps end within one instruction of a fixed grid
        volts = self.plant.sensor_volts()
        outgoing = b""
        if self._outgoing:
            with self._wire:
                outgoing, self._outgoing = self._outgoing[:BYTES_AT_ONCE], self._outgoing[BYTES_AT_ONCE:]
        request = REQUEST.pack(
            cycles,
            int(1e3 * volts[0] + 0.5),
            int(1e3 * volts[1] + 0.5),
            int(1e3 * volts[2] + 0.5),
            int(1e3 * volts[3] + 0.5),
            int(1e3 * self.plant.supply_volts() + 0.5),
            operation,
            0,
            len(outgoing),
        )
        head, incoming = self._processor.exchange(request, outgoing)
        cycle, high, pins, _, _, _, _ = ANSWER.unpack(head)
        passed, self._cycle = cycle - self._cycle, cycle
        if operation != Operation.MEASURE_RAM:
            direction = _DIRECTIONS.get(pins, 0)
            if not direction and high:  # the pins are off now; during the step they were on
                direction = self.drive.direction
            self.drive = PumpDrive(direction, min(1.0, high / max(1, passed))) if direction else STANDING
        return incoming, high


class LockstepPort:
    """A port, and a clock, on a simulated board: waiting makes virtual time pass.

    on_step : called with the time after each step
    turn : held during each step; a lock, where more than one thread lets time pass
    """

    def __init__(self, board: SimulatedBoard, name: str = "simulated board", real_time: bool = False):
        """Wire a host to a board.

        board : which steps as the host waits
        name : for messages
        real_time : never run ahead of the wall clock, for people to watch
        """
        self._ahead_of = time.monotonic() - board.time if real_time else None
        self.board = board
        self.name = name
        self.clock = LockstepClock(self)
        self._inbox: list[bytes] = []
        self._open = False
        self.unplugged = False
        self.on_step: Callable[[float], None] = lambda time: None
        self.turn: AbstractContextManager[object] = nullcontext()

    def open(self) -> None:
        """Open the line; unlike an Uno's, this does not restart the board."""
        if self.unplugged:
            raise LinkError(f"{self.name}: the cable is unplugged")
        self._open = True

    def close(self) -> None:
        """Close the line; the board goes on."""
        self._open = False
        self._inbox.clear()

    def write(self, data: bytes) -> None:
        """Send.

        data : bytes
        """
        self._demand_line()
        self.board.send(data)

    def read(self, timeout: float) -> Received:
        """What has come, after letting time pass until something comes.

        timeout : longest wait [s]
        """
        self._demand_line()
        deadline = self.board.time + timeout - 1e-9
        while timeout > 0 and not self._inbox:
            come = self.advance()
            while _frame_open(come) and self.board.time < deadline:
                come = self.advance()
            if self.board.time >= deadline:
                break
        data = b"".join(self._inbox)
        self._inbox.clear()
        return Received(self.board.time, data)

    def advance(self) -> bytes:
        """What the board sent in one step, which is kept for `read` while the line is open."""
        if self._ahead_of is not None:
            self._keep_pace(self._ahead_of)
        with self.turn:
            out = self.board.step()
            if out and self._open and not self.unplugged:
                self._inbox.append(out)
            self.on_step(self.board.time)
        return out

    def _keep_pace(self, ahead_of: float) -> None:
        """Wait for the wall clock, `ahead_of` that of the board's start, or let go of what is lost."""
        lead = self.board.time - (time.monotonic() - ahead_of)
        if lead > 0:
            time.sleep(lead)
        elif lead < -HOLD_UP_S:
            self._ahead_of = ahead_of - lead

    def press_reset(self) -> None:
        """Press the board's reset button."""
        self.board.reset_due = True

    def unplug(self, out: bool) -> None:
        """Pull the cable out of the host, or put it back; the board goes on unheard.

        out : whether it is pulled
        """
        self.unplugged = out
        if out:
            self.close()

    def _demand_line(self) -> None:
        if not self._open or self.unplugged:
            raise LinkError(f"{self.name}: the line is {'unplugged' if self.unplugged else 'closed'}")


def _frame_open(come: bytes) -> bool:
    """Whether the last bytes lead up to a frame's end that is still to come."""
    return bool(come) and come.find(0, 1) < 0


class LockstepClock:
    """The board's virtual time; sleeping steps the board."""

    def __init__(self, port: LockstepPort):
        """Take the time from a board.

        port : where it is
        """
        self._port = port

    def now(self) -> float:
        """The time now [s]."""
        return self._port.board.time

    def sleep(self, seconds: float) -> None:
        """Step the board.

        seconds : how long [s]
        """
        deadline = self.now() + seconds - 1e-9
        while self.now() < deadline:
            self._port.advance()
