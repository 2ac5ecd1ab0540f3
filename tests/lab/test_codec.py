"""Frames: round trips, damage, and a peer implementation of COBS and CRC."""

from __future__ import annotations

import binascii

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tubefoot.errors import ConfigError
from tubefoot.lab import messages
from tubefoot.lab.codec import Frame, FrameDecoder, encode

PULSE = messages.Pulse(direction=-1, duty=200, duration_ms=256)


@st.composite
def any_message(draw):
    kind = draw(st.sampled_from(list(messages.MESSAGES.values())))
    values = {}
    for name, (low, high) in kind.RANGES.items():
        number = st.integers(low, high)
        count = kind.ARRAYS.get(name)
        values[name] = draw(number if count is None else st.tuples(*[number] * count))
    return kind(**values)


@given(any_message(), st.integers(0, 255))
def test_what_is_encoded_comes_back(message, sequence):
    data = encode(message, sequence)
    assert data[0] == data[-1] == 0
    assert 0 not in data[1:-1]
    assert len(data) <= messages.FRAME_BYTES_MAX
    assert FrameDecoder().feed(data) == [Frame(sequence, message)]


@settings(max_examples=30)
@given(st.lists(st.tuples(any_message(), st.integers(0, 255)), max_size=5), st.data())
def test_it_does_not_matter_where_the_bytes_are_cut(frames, data):
    stream = b"".join(encode(message, sequence) for message, sequence in frames)
    decoder, found, rest = FrameDecoder(), [], stream
    while rest:
        cut = data.draw(st.integers(1, len(rest)))
        found += decoder.feed(rest[:cut])
        rest = rest[cut:]
    assert found == [Frame(sequence, message) for message, sequence in frames]
    assert decoder.damaged == 0


@given(any_message(), st.integers(0, 255), st.data())
def test_any_flipped_bit_is_seen(message, sequence, data):
    stream = bytearray(encode(message, sequence))
    at = data.draw(st.integers(0, 8 * len(stream) - 1))
    stream[at // 8] ^= 1 << at % 8
    whole = encode(messages.Ping(), 9)
    decoder = FrameDecoder()
    found = decoder.feed(bytes(stream) + whole)
    assert found[-1] == Frame(9, messages.Ping())
    assert found[:-1] in ([], [Frame(sequence, message)])  # the outer delimiters may be damaged without harm
    if found[:-1]:
        assert at // 8 in (0, len(stream) - 1)


def test_the_layout_is_that_of_the_documents():
    """By hand: id 3, sequence 7, direction -1, duty 200, duration 256, then zlib's CRC-32, little-endian."""
    body = bytes([3, 7, 0xFF, 200, 0x00, 0x01])
    crc = binascii.crc32(body).to_bytes(4, "little")
    assert encode(PULSE, 7) == b"\0" + bytes([5, 3, 7, 0xFF, 200, 6, 0x01]) + crc + b"\0"


def test_noise_without_delimiters_does_not_pile_up():
    decoder = FrameDecoder()
    assert decoder.feed(b"\xaa" * 10_000) == []
    assert decoder.feed(b"\0" + encode(PULSE, 1)) == [Frame(1, PULSE)]
    assert decoder.damaged >= 1


def test_a_field_out_of_range_is_refused_by_name():
    with pytest.raises(ConfigError, match=r"Pulse.duration_ms = 20000 is outside 1 to 10000"):
        encode(messages.Pulse(1, 100, 20_000), 1)
