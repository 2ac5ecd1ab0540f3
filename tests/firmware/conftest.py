"""The real firmware on the simulated board, driven frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from tubefoot.lab import messages
from tubefoot.lab.codec import Frame, FrameDecoder, encode
from tubefoot.lab.messages import Fault, Status
from tubefoot.twin.board import Operation, SimulatedBoard
from tubefoot.twin.firmware import built
from tubefoot.twin.plant import PumpDrive
from tubefoot.twin.processor import PipedProcessor


class SetVolts:
    """A plant whose sensors show what the test sets."""

    def __init__(self) -> None:
        self.volts = [2.5, 2.5, 0.0, 0.0]
        self.supply = 5.0

    def step(self, duration: float, drive: PumpDrive) -> None:
        pass

    def sensor_volts(self) -> tuple[float, float, float, float]:
        return tuple(self.volts)  # type: ignore[return-value]

    def supply_volts(self) -> float:
        return self.supply


class WireTap:
    """A board with its wire in the hand of the test; a step is 0.1 ms, so that stops are timed finely."""

    def __init__(self, step_s: float = 1e-4) -> None:
        self.plant = SetVolts()
        self.board = SimulatedBoard(self.plant, PipedProcessor(built("board_test.elf")), step_s)
        self.frames: list[Frame] = []
        self.sequence = 0
        self._decoder = FrameDecoder()
        self.run(0.02)

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        for _ in range(round(seconds / self.board.step_s)):
            self.frames += self._decoder.feed(self.board.step())
            if until():
                return True
        return False

    def press(self, operation: Operation) -> None:
        self.frames += self._decoder.feed(self.board.step(operation))

    def ask(self, message: messages.Message, sequence: int | None = None) -> messages.Ack | None:
        """Send once; the answer, None when none comes in 30 ms."""
        if sequence is None:
            self.sequence = sequence = (self.sequence + 1) % 256
        first = len(self.frames)
        self.board.send(encode(message, sequence))

        def answer() -> messages.Ack | None:
            for frame in self.frames[first:]:
                found = frame.message
                if isinstance(found, messages.Ack) and (frame.sequence, found.command) == (
                    sequence,
                    message.ID,
                ):
                    return found
            return None

        self.run(0.03, until=lambda: answer() is not None)
        return answer()

    def obey(self, message: messages.Message) -> messages.Ack:
        answer = self.ask(message)
        assert answer is not None
        assert answer.status == Status.OK, Status(answer.status)
        return answer

    def begin(self) -> None:
        self.obey(messages.Hello(messages.PROTOCOL_VERSION))

    def pump(self, direction: int = 1, duty: int = 200, duration_ms: int = 5000) -> None:
        self.obey(messages.Pulse(direction, duty, duration_ms))
        assert self.run(0.005, until=lambda: self.board.pump_on)

    def time_to_stop(self, longest: float) -> float | None:
        """Time until the pump has no current for 3 ms (a PWM period is 1 ms) [s], None if it goes on."""
        start = self.board.time
        last_on = start

        def stands() -> bool:
            nonlocal last_on
            if self.board.drive.direction != 0 and self.board.drive.duty > 0:
                last_on = self.board.time
            return self.board.time - last_on > 0.003

        return last_on - start if self.run(longest, until=stands) else None

    def faults(self) -> Fault:
        answer = self.ask(messages.Ping())
        assert answer is not None
        return Fault(answer.faults)

    def last(self, kind: type[messages.Message]) -> messages.Message:
        return next(frame.message for frame in reversed(self.frames) if isinstance(frame.message, kind))


@pytest.fixture
def make_wire() -> Iterator[Callable[..., WireTap]]:
    made: list[WireTap] = []

    def make(step_s: float = 1e-4) -> WireTap:
        made.append(WireTap(step_s))
        return made[-1]

    yield make
    for wire in made:
        wire.board.close()


@pytest.fixture
def wire(make_wire: Callable[..., WireTap]) -> WireTap:
    tap = make_wire()
    tap.begin()
    return tap
