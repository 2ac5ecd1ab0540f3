"""A session with the board over a port: numbered commands, acknowledgements, retries, signs of life."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tubefoot.errors import LinkError
from tubefoot.lab.codec import Frame, FrameDecoder, encode
from tubefoot.lab.messages import PROTOCOL_VERSION, Ack, Hello, Identity, Message, Ping, Status, Stop
from tubefoot.lab.port import Port

ANSWER_TIMEOUT_S = 0.1
ATTEMPTS = 4
CONNECT_TIMEOUT_S = 4.0
"""An Uno restarts when its port is opened and spends up to 2 s in its boot loader."""


@dataclass(frozen=True, slots=True)
class Sent:
    """A command on its way out, for the record."""

    time: float
    sequence: int
    message: Message
    attempt: int


class Link:
    """One host talking to one board; one command is under way at a time.

    on_frame : called with (time, frame) for every good frame, in order
    on_sent : called with every command sent, retries included
    """

    def __init__(self, port: Port):
        """Wrap a port; nothing is opened yet.

        port : where the board is
        """
        self.port = port
        self.clock = port.clock
        self.on_frame: Callable[[float, Frame], None] = lambda time, frame: None
        self.on_sent: Callable[[Sent], None] = lambda sent: None
        self.last_sent = float("-inf")
        self._decoder = FrameDecoder()
        self._sequence = 0
        self._ping_sequence = 0
        self._answers: list[tuple[int, Ack]] = []
        self._identity: Identity | None = None

    @property
    def next_sequence(self) -> int:
        """The number under which the next command will go."""
        return (self._sequence + 1) % 256

    @property
    def damaged_frames(self) -> int:
        """Frames from the board that failed a check."""
        return self._decoder.damaged

    def connect(self, timeout: float = CONNECT_TIMEOUT_S) -> Identity:
        """Who answers, after opening the port and beginning a session.

        timeout : how long to keep asking [s]

        Raises LinkError when nothing answers, or something that is not a Tubefoot board.
        """
        self.port.open()
        self._decoder.reset()
        self._identity = None
        deadline = self.clock.now() + timeout
        while self.clock.now() < deadline:
            self._sequence = self.next_sequence
            answer = self._attempt(Hello(PROTOCOL_VERSION), self._sequence, attempt=1)
            if answer is None:
                continue
            if answer.status != Status.OK:
                raise LinkError(
                    f"{self.port.name}: the board speaks another protocol than {PROTOCOL_VERSION}; "
                    "flash it with `tubefoot rig flash`"
                )
            patience = self.clock.now() + ANSWER_TIMEOUT_S
            while self._identity is None and self.clock.now() < patience:
                self.service(0.02)
            if self._identity is not None:
                return self._identity
        raise LinkError(
            f"{self.port.name}: no answer within {timeout:g} s; is it the right port, and does the board "
            "run the Tubefoot firmware? `tubefoot rig flash` installs it"
        )

    def command(self, message: Message) -> Ack:
        """The board's answer to a command; it is run once, however often it had to be sent.

        message : the command

        Raises LinkError when no answer comes after four attempts.
        """
        self._sequence = self.next_sequence
        for attempt in range(1, ATTEMPTS + 1):
            answer = self._attempt(message, self._sequence, attempt)
            if answer is not None:
                return answer
        raise LinkError(
            f"{self.port.name}: no answer to {type(message).__name__} after {ATTEMPTS} attempts of "
            f"{ANSWER_TIMEOUT_S:g} s; check the cable. A running pump stops by itself."
        )

    def stop(self) -> Ack:
        """The board's answer to Stop."""
        return self.command(Stop())

    def ping(self) -> None:
        """Send a sign of life, without waiting for its answer."""
        self._ping_sequence = (self._ping_sequence + 1) % 256
        self._send(Ping(), self._ping_sequence, attempt=1)

    def round_trip(self) -> float:
        """Time from sending a sign of life to having its answer [s]."""
        start = self.clock.now()
        self._ping_sequence = (self._ping_sequence + 1) % 256
        if self._attempt(Ping(), self._ping_sequence, attempt=1) is None:
            raise LinkError(f"{self.port.name}: no answer to a ping within {ANSWER_TIMEOUT_S:g} s")
        return self.clock.now() - start

    def service(self, timeout: float) -> None:
        """Take in what has come.

        timeout : longest wait for it [s]
        """
        received = self.port.read(timeout)
        for frame in self._decoder.feed(received.data):
            if isinstance(frame.message, Ack):
                self._answers.append((frame.sequence, frame.message))
            elif isinstance(frame.message, Identity):
                self._identity = frame.message
            self.on_frame(received.time, frame)

    def close(self) -> None:
        """Close the port."""
        self.port.close()

    def _attempt(self, message: Message, sequence: int, attempt: int) -> Ack | None:
        """Send once and wait for the answer, None when it does not come in time."""
        self._answers.clear()
        self._send(message, sequence, attempt)
        deadline = self.clock.now() + ANSWER_TIMEOUT_S
        while (left := deadline - self.clock.now()) > 0:
            self.service(left)
            for number, answer in self._answers:
                if number == sequence and answer.command == message.ID:
                    return answer
        return None

    def _send(self, message: Message, sequence: int, attempt: int) -> None:
        self.port.write(encode(message, sequence))
        self.last_sent = self.clock.now()
        self.on_sent(Sent(self.last_sent, sequence, message, attempt))
