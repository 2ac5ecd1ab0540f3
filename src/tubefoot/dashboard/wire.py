"""The binary frames of the websocket: `TFD1`, then sections of kind, length, payload; little-endian.

A section is 8 bytes of head (u16 kind, u16 count, u32 bytes) and its payload, filled up with zeros to a
multiple of 8, so that the page looks at the numbers where they lie. Kinds: 1 samples, 2 angles (float64
rows), 3 picture (u32 width, u32 height, f64 time, JPEG), 4 marker outlines, 5 centreline [px], 6 shape
[mm, rad] (float32), 7 state (JSON, UTF-8), 8 why the tip is lost (UTF-8).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tubefoot.dashboard.feed import News, Sight

MAGIC = b"TFD1\0\0\0\0"
HEAD = struct.Struct("<HHI")
PICTURE = struct.Struct("<IId")
SAMPLES, ANGLES, PICTURE_KIND, OUTLINES, LINE, SHAPE, STATE, LOST = range(1, 9)


def packed(news: News) -> bytes:
    """One frame of the websocket.

    news : what goes into it
    """
    sections = [MAGIC]
    if news.samples:
        sections += _section(SAMPLES, len(news.samples), _doubles(news.samples))
    if news.angles:
        sections += _section(ANGLES, len(news.angles), _doubles(news.angles))
    if news.sight is not None:
        sections += _sight(news.sight)
    if news.status is not None:
        sections += _section(STATE, 1, json.dumps(_plain(news.status)).encode())
    return b"".join(sections)


def unpacked(data: bytes) -> dict[int, tuple[int, bytes]]:
    """Count and payload of each section by kind, for tests and other readers.

    data : one frame of the websocket

    Raises ValueError for anything else.
    """
    if not data.startswith(MAGIC):
        raise ValueError("not a frame of the dashboard")
    found, at = {}, len(MAGIC)
    while at < len(data):
        kind, count, length = HEAD.unpack_from(data, at)
        at += HEAD.size
        if at + length > len(data):
            raise ValueError(f"section {kind} is cut off")
        found[kind] = (count, data[at : at + length])
        at += length + -length % 8
    return found


def _sight(sight: Sight) -> list[bytes]:
    parts = []
    if sight.jpeg:
        parts += _section(PICTURE_KIND, 1, PICTURE.pack(*sight.size, sight.time) + sight.jpeg)
    parts += _section(OUTLINES, len(sight.outlines), _singles(sight.outlines))
    parts += _section(LINE, len(sight.line), _singles(sight.line))
    parts += _section(SHAPE, len(sight.shape), _singles(sight.shape))
    return parts + _section(LOST, 1, sight.fault.encode())


def _section(kind: int, count: int, payload: bytes) -> list[bytes]:
    return [HEAD.pack(kind, count, len(payload)), payload, bytes(-len(payload) % 8)]


def _doubles(rows: Sequence[Sequence[float]]) -> bytes:
    return np.asarray(rows, dtype="<f8").tobytes()


def _singles(values: Any) -> bytes:
    return np.asarray(values, dtype="<f4").tobytes()


def _plain(value: Any) -> Any:
    """The same value without what JSON does not know."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
