"""Reading a recording, also one whose writer was killed.

In one line, as a pandas table: `Recording("out/rig-record/bench.mcap").samples`.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.records import Channel, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader
from mcap.writer import CompressionType, Writer

from tubefoot.config import parse_settings
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.settings import RigSettings
from tubefoot.lab.topics import TOPICS
from tubefoot.records import write_whole

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, slots=True)
class RecordedFrame:
    """A camera frame.

    time : when it was captured [s]
    encoded : a JPEG or PNG file
    width, height : [pixel]
    """

    time: float
    encoded: bytes
    width: int
    height: int


class Recording:
    """What a recorder wrote.

    complete : whether it was closed properly; if not, the end since the last whole chunk is missing
    settings : of the rig that was recorded
    """

    def __init__(self, path: Path | str):
        """Read a recording.

        path : the `.mcap` file

        Raises ConfigError when there is no such file, LinkError when it is not a recording.
        """
        self.path = Path(path)
        self.complete = False
        self._rows: dict[str, list[dict[str, Any]]] = {topic: [] for topic in TOPICS}
        about: dict[str, str] | None = None
        topics: dict[int, str] = {}
        for record in _records(self.path):
            match record:
                case Channel():
                    topics[record.id] = record.topic.removeprefix("/")
                case Message() if topics.get(record.channel_id) in TOPICS:
                    self._rows[topics[record.channel_id]].append(json.loads(record.data))
                case Metadata(name="tubefoot"):
                    about = record.metadata
                case Footer():
                    self.complete = True
        if about is None:
            raise LinkError(f"{self.path}: an MCAP file, but not a recording of a Tubefoot bench")
        self.settings = parse_settings(json.loads(about["rig"]), RigSettings, source=f"{self.path} (rig)")
        for rows in self._rows.values():
            rows.sort(key=lambda row: row["time_s"])

    def rows(self, topic: str) -> list[dict[str, Any]]:
        """The entries of a topic in the order of their time, as dictionaries.

        topic : one of `tubefoot.lab.topics.TOPICS`
        """
        if topic not in TOPICS:
            raise ConfigError(f"no topic {topic!r} in a recording; there are {', '.join(TOPICS)}")
        return self._rows[topic]

    def table(self, topic: str) -> pd.DataFrame:
        """The entries of a topic as a data frame, units in the headers.

        topic : one of `tubefoot.lab.topics.TOPICS`
        """
        import pandas as pd

        rows = self.rows(topic)
        return pd.DataFrame(rows, columns=None if rows else list(TOPICS[topic]))

    @cached_property
    def samples(self) -> pd.DataFrame:
        """The samples as a data frame; `.set_index("time_s").to_xarray()` makes an xarray dataset of it."""
        return self.table("samples")

    def frames(self) -> Iterator[RecordedFrame]:
        """The camera frames, in order."""
        for row in self._rows["frames"]:
            yield RecordedFrame(row["time_s"], base64.b64decode(row["data"]), row["width"], row["height"])


def repair_recording(path: Path | str) -> bool:
    """Whether a recording had to be repaired: its end since the last whole chunk dropped, an index written.

    path : the `.mcap` file, replaced in one step; do not use it while the recording still runs
    """
    path = Path(path)
    records = list(_records(path))
    if any(isinstance(record, Footer) for record in records):
        return False
    beside = path.with_name(f".{path.name}.repair")
    writer = Writer(str(beside), compression=CompressionType.ZSTD)
    writer.start("", "tubefoot repair")
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for record in records:
        match record:
            case Schema() if record.id not in schemas:
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in channels:
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
                )
            case Message():
                writer.add_message(
                    channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            case Metadata():
                writer.add_metadata(record.name, record.metadata)
    writer.finish()  # type: ignore[no-untyped-call]
    whole = beside.read_bytes()
    beside.unlink()
    write_whole(path, whole)
    return True


def _records(path: Path) -> Iterator[McapRecord]:
    """The records of a file up to its end or to the first that is not whole."""
    try:
        file = path.open("rb")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    with file:
        records = iter(StreamReader(file, validate_crcs=True).records)
        try:
            yield from _whole_records(records)
        except InvalidMagic:
            raise LinkError(f"{path}: not an MCAP recording") from None


def _whole_records(records: Iterator[McapRecord]) -> Iterator[McapRecord]:
    while True:
        try:
            record = next(records)
        except (StopIteration, EndOfFile, CRCValidationError, struct.error, EOFError):
            return
        except InvalidMagic:
            raise
        except (McapError, ValueError, RuntimeError):  # a damaged chunk
            return
        yield record
