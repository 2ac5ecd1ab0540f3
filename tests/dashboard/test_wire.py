"""Rings, cursors and the binary frames."""

import json
import struct

import numpy as np
import pytest

from tubefoot.dashboard.feed import Cursor, Feed, Ring, Sight
from tubefoot.dashboard.wire import (
    ANGLES,
    LINE,
    OUTLINES,
    PICTURE_KIND,
    SAMPLES,
    SHAPE,
    STATE,
    packed,
    unpacked,
)


def sight(jpeg=b"\xff\xd8 thirteen", fault="") -> Sight:
    outlines = np.arange(16, dtype=np.float32).reshape(2, 4, 2)
    line, shape = np.ones((3, 2), dtype=np.float32), np.full((5, 3), 2.5, dtype=np.float32)
    return Sight(12.5, jpeg, (640, 480), outlines, line, shape, fault)


def test_a_frame_comes_back_as_it_went_and_its_sections_lie_on_eights():
    feed, cursor = Feed(), Cursor()
    feed.sample((1.0, 2.0, 3.0, 4.0, 1.0, 5.0, 0.0))
    feed.angle((1.0, 20.0, float("nan"), 0.1, 9.0, 11.0))
    feed.sight(sight())
    feed.tell(phase="idle", far=float("inf"))
    data = packed(feed.after(cursor))
    found = unpacked(data)
    assert len(data) % 8 == 0
    count, rows = found[SAMPLES]
    np.testing.assert_array_equal(np.frombuffer(rows).reshape(count, 7), [[1, 2, 3, 4, 1, 5, 0]])
    assert np.isnan(np.frombuffer(found[ANGLES][1])[2])
    assert struct.unpack_from("<IId", found[PICTURE_KIND][1]) == (640, 480, 12.5)
    assert found[PICTURE_KIND][1][16:] == b"\xff\xd8 thirteen"
    np.testing.assert_array_equal(np.frombuffer(found[OUTLINES][1], "<f4"), np.arange(16))
    assert found[LINE][0], found[SHAPE][0] == (3, 5)
    assert json.loads(found[STATE][1]) == {"phase": "idle", "far": None}
    assert not feed.after(cursor)


def test_damaged_frames_are_refused():
    feed = Feed()
    feed.tell(phase="idle")
    data = packed(feed.after(Cursor()))
    for bad in (data[:-8], b"JUNK" + data[4:], b""):
        with pytest.raises(ValueError, match=r"cut off|not a frame"):
            unpacked(bad)


def test_each_reader_gets_every_row_once_and_a_late_one_what_is_kept():
    ring, got = Ring(10), []
    for number in range(25):
        ring.add((number,))
        if number % 3 == 0:
            got += ring.after(len(got))
    assert [row[0] for row in got] == list(range(25))
    assert [row[0] for row in ring.after(0)] == list(range(15, 25))
    assert ring.after(25) == []


def test_samples_are_thinned_but_no_change_of_the_pump_is_missed():
    feed, cursor = Feed(), Cursor()
    for number in range(200):  # one second at 200 Hz, the pump runs for a single sample
        feed.sample((number / 200, 0.0, 0.0, 0.0, float(number == 101), 5.0, 0.0))
    rows = feed.after(cursor).samples
    assert 45 <= len(rows) <= 55
    assert any(row[4] == 1.0 for row in rows)
    assert np.diff([row[0] for row in rows]).max() <= 0.021


def test_the_same_state_is_not_told_twice():
    feed, cursor = Feed(), Cursor()
    feed.tell(phase="idle", notes=[1])
    assert feed.after(cursor).status == {"phase": "idle", "notes": [1]}
    feed.tell(phase="idle")
    assert feed.after(cursor).status is None
    feed.tell(phase="running")
    assert feed.after(cursor).status == {"phase": "running", "notes": [1]}
