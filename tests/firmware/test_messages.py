"""One table of messages: both generated sides are up to date and agree to the byte."""

from __future__ import annotations

import subprocess
import sys
import tomllib

import pytest

from tubefoot.lab import messages
from tubefoot.lab.codec import encode
from tubefoot.lab.messages import Status
from tubefoot.twin.firmware import FOLDER, built

with (FOLDER / "messages.toml").open("rb") as file:
    TABLE = tomllib.load(file)
COMMANDS = [entry for entry in TABLE["message"] if entry["to"] == "board" and entry["name"] != "TestHang"]
RANGED = [(entry["name"], field) for entry in COMMANDS for field in entry["fields"]]


def test_both_sides_are_generated_from_the_table_as_it_is():
    done = subprocess.run([sys.executable, FOLDER / "generate_messages.py", "--check"], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()


def test_ids_differ_and_tell_the_direction():
    ids = [entry["id"] for entry in TABLE["message"]]
    assert len(set(ids)) == len(ids)
    assert all((entry["id"] >= 0x80) == (entry["to"] == "host") for entry in TABLE["message"])


@pytest.mark.parametrize(("name", "field"), RANGED, ids=[f"{name}.{f['name']}" for name, f in RANGED])
def test_the_board_refuses_what_the_table_forbids(wire, name, field):
    """Sent past the host's own check: the board must judge by itself."""
    kind = getattr(messages, name)
    good = {f["name"]: max(f["min"], 1) if f.get("not_zero") else f["min"] for f in entry_of(name)["fields"]}
    if name == "LimitPressure":
        good["high_counts"] = good["low_counts"] + 1
    outside = [value for value in (field["min"] - 1, field["max"] + 1) if in_type(field["type"], value)]
    if field.get("not_zero"):
        outside.append(0)
    assert wire.ask(kind(**good)).status == Status.OK
    for value in outside:
        wire.obey(messages.Stop())
        bad = kind(**{**good, field["name"]: value})
        wire.sequence = (wire.sequence + 1) % 256
        kept, kind.RANGES = kind.RANGES, dict.fromkeys(kind.RANGES, (-(2**31), 2**32))
        try:
            frame = encode(bad, wire.sequence)
        finally:
            kind.RANGES = kept
        first = len(wire.frames)
        wire.board.send(frame)
        wire.run(0.02)
        answers = [f.message for f in wire.frames[first:] if isinstance(f.message, messages.Ack)]
        assert [Status(answer.status) for answer in answers] == [Status.OUT_OF_RANGE]


def entry_of(name):
    return next(entry for entry in COMMANDS if entry["name"] == name)


def in_type(kind, value):
    low, high = {"u8": (0, 255), "u16": (0, 65535), "i8": (-128, 127)}[kind]
    return low <= value <= high


def test_a_million_damaged_frames_and_none_wrongly_executed():
    done = subprocess.run([built("fuzz"), "1000000", "11"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    total = int(done.stdout.split()[-3])
    assert total > 990_000


def test_the_fuzz_sees_what_a_16_bit_check_lets_through():
    done = subprocess.run([built("fuzz_weak"), "1000000", "4"], capture_output=True, text=True)
    assert int(done.stdout.split()[-1]) > 0


def test_the_portable_part_stays_within_its_memory():
    subprocess.run(["make", "-s", "-C", FOLDER, "build/fuzz_sanitized"], check=True)
    done = subprocess.run([built("fuzz_sanitized"), "100000", "5"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
