"""Messages to bytes and back, without any I/O.

A frame is 0x00, COBS(id, sequence, payload, CRC-32), 0x00; see docs/rig.md. COBS: Cheshire and Baker,
"Consistent Overhead Byte Stuffing", 1999. CRC-32 as in IEEE 802.3, over id to payload.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from functools import cache

from tubefoot.errors import ConfigError
from tubefoot.lab.messages import FRAME_BYTES_MAX, MESSAGES, Message

_CHECKSUM = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Frame:
    """A message with the sequence number (0 to 255) it came under."""

    sequence: int
    message: Message


def encode(message: Message, sequence: int) -> bytes:
    """The bytes of a frame.

    message : what to send
    sequence : its number, 0 to 255

    Raises ConfigError when a field is outside its range.
    """
    numbers: list[int] = []
    for field, value in _field_values(message):
        low, high = message.RANGES[field]
        values = value if isinstance(value, tuple) else (value,)
        if any(not low <= number <= high for number in values):
            raise ConfigError(
                f"{type(message).__name__}.{field} = {value} is outside {low} to {high}, the range that "
                "firmware/messages.toml allows"
            )
        numbers += values
    body = bytes((message.ID, sequence)) + message.LAYOUT.pack(*numbers)
    return b"\0" + _stuff(body + _CHECKSUM.pack(zlib.crc32(body))) + b"\0"


class FrameDecoder:
    """Collects bytes into frames; `damaged` counts those that failed a check."""

    def __init__(self) -> None:
        self.damaged = 0
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that these bytes complete, in order.

        data : bytes as they came, cut anywhere
        """
        self._pending += data
        if 0 not in data and len(self._pending) <= FRAME_BYTES_MAX:
            return []
        *pieces, self._pending = self._pending.split(b"\0")
        if len(self._pending) > FRAME_BYTES_MAX:  # noise without a delimiter
            self._pending.clear()
            self.damaged += 1
        found = []
        for piece in filter(None, pieces):
            frame = _decode(bytes(piece))
            if frame is None:
                self.damaged += 1
            else:
                found.append(frame)
        return found

    def reset(self) -> None:
        """Forget a frame half received."""
        self._pending.clear()


def _decode(stuffed: bytes) -> Frame | None:
    """The frame in the bytes between two delimiters, None when a check fails."""
    raw = _unstuff(stuffed)
    if raw is None or len(raw) < 6:
        return None
    body, checksum = raw[:-4], raw[-4:]
    kind = MESSAGES.get(body[0])
    if _CHECKSUM.pack(zlib.crc32(body)) != checksum or kind is None or kind.LAYOUT.size != len(body) - 2:
        return None
    return Frame(body[1], _from_numbers(kind, kind.LAYOUT.unpack(body[2:])))


def _from_numbers(kind: type[Message], numbers: tuple[int, ...]) -> Message:
    """The message whose fields these numbers fill, in the order of the table."""
    places = _places(kind)  # type: ignore[arg-type]
    return kind(*[numbers[at] if end is None else numbers[at:end] for at, end in places])


@cache
def _places(kind: type[Message]) -> tuple[tuple[int, int | None], ...]:
    """Where each field's number, or the start and end of its array, stands among the unpacked numbers."""
    places: list[tuple[int, int | None]] = []
    at = 0
    for name in kind.RANGES:
        count = kind.ARRAYS.get(name)
        places.append((at, None if count is None else at + count))
        at += count or 1
    return tuple(places)


def _field_values(message: Message) -> list[tuple[str, int | tuple[int, ...]]]:
    return [(name, getattr(message, name)) for name in message.RANGES]


def _stuff(data: bytes) -> bytes:
    """COBS: the data without zeros, each replaced by the distance to the next one."""
    return b"".join(bytes((len(piece) + 1,)) + piece for piece in data.split(b"\0"))


def _unstuff(data: bytes) -> bytes | None:
    """The data before stuffing, None when a distance points past the end."""
    out, at = bytearray(data), 0
    while at < len(data):
        distance, out[at] = out[at], 0
        at += distance
    return bytes(out[1:]) if at == len(data) else None
