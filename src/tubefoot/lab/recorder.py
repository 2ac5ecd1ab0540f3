"""Everything that happens on the bench, appended to one MCAP file.

MCAP (mcap.dev) is the open container of robotics recordings; Foxglove and other viewers open it. Each topic
holds JSON with a schema; camera frames are `foxglove.CompressedImage`. A chunk is closed and handed to the
operating system every 0.5 s, so that a killed program loses less than the last second (`recording.py` reads
such a file).
"""

from __future__ import annotations

import base64
import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from tubefoot import __version__
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.link import Sent
from tubefoot.lab.messages import Ack, EndReason, Fault, Sample, Status
from tubefoot.lab.rig import EndedPulse, Neutral, Reading, SentPulse, fault_names
from tubefoot.lab.settings import BRANCHES, RigSettings
from tubefoot.lab.topics import FRAME_SCHEMA, TOPICS, schema_of
from tubefoot.units import KPA, ML

CHUNK_S = 0.5
CHUNK_BYTES = 4 * 2**20
NS = 1_000_000_000


class Recorder:
    """Appends to one file; times are those of one clock, in seconds.

    Every method raises LinkError once the file cannot be written (disk full), and the file stays readable.
    """

    def __init__(self, path: Path, settings: RigSettings, start_time: float):
        """Begin a file.

        path : where; an existing file is not overwritten
        settings : of the rig, stored with the recording
        start_time : the clock's time now [s]; shown by viewers as the present date
        """
        self.path = path
        self._epoch_ns = time.time_ns() - round(start_time * NS)
        self._chunk_opened = start_time
        self._failed: OSError | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._file = path.open("xb", buffering=0)
        except FileExistsError:
            raise ConfigError(
                f"{path} exists; a recording is never overwritten, name another --out"
            ) from None
        self._whole = _WholeWrites(self._file)
        self._writer = Writer(self._whole, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        self._attempt(self._begin, settings)

    def sample(self, reading: Reading, sample: Sample) -> None:
        """Record a sample.

        reading : what the rig made of it
        sample : as the board sent it
        """
        row: dict[str, Any] = {"time_s": reading.time}
        for branch, corrected, gauge in zip(
            BRANCHES, reading.pressures, reading.gauge_pressures, strict=False
        ):
            row[f"pressure_{branch}_kpa"] = _digits(corrected / KPA)
            row[f"gauge_{branch}_kpa"] = _digits(gauge / KPA)
        row |= {
            "supply_v": _digits(reading.supply),
            "direction": sample.direction,
            "duty": _digits(sample.duty / 255),
            "pumped_volume_ml": _digits(reading.pumped_volume / ML),
            "faults": sample.faults,
            "board_time_ms": sample.time_ms,
            "received_s": _digits(reading.time + reading.age),
        }
        self._add("samples", reading.time, row)

    def command(self, sent: Sent) -> None:
        """Record a command on its way out.

        sent : the command; retries come again with a higher attempt
        """
        row = {
            "time_s": sent.time,
            "sequence": sent.sequence,
            "attempt": sent.attempt,
            "command": type(sent.message).__name__,
            "fields": asdict(sent.message) if sent.message.RANGES else {},  # type: ignore[call-overload]
        }
        self._add("commands", sent.time, row)

    def acknowledgement(self, time_s: float, sequence: int, ack: Ack) -> None:
        """Record the board's answer.

        time_s : when it came [s]
        sequence : number of the command
        ack : the answer
        """
        row = {
            "time_s": time_s,
            "sequence": sequence,
            "command_id": ack.command,
            "status": Status(ack.status).name.lower(),
            "faults": ack.faults,
            "board_time_ms": ack.time_ms,
        }
        self._add("acknowledgements", time_s, row)

    def pulse(self, sent: SentPulse) -> None:
        """Record a pulse that the board accepted.

        sent : as it was sent
        """
        row = {
            "time_s": sent.time,
            "direction": sent.direction,
            "duty": sent.duty,
            "duration_s": sent.duration,
            "volume_ml": sent.volume / ML,
            "volume_sigma_ml": sent.volume_sigma / ML,
            "clipped": sent.clipped,
        }
        self._add("pulses", sent.time, row)

    def pulse_ended(self, ended: EndedPulse) -> None:
        """Record the end of a pulse.

        ended : how it ended
        """
        row = {
            "time_s": ended.time,
            "duration_s": ended.duration,
            "volume_ml": ended.volume / ML,
            "reason": EndReason(ended.reason).name.lower(),
        }
        self._add("pulse_ends", ended.time, row)

    def fault(self, time_s: float, faults: Fault, channels: int) -> None:
        """Record a change of the latched faults.

        time_s : when it came [s]
        faults : those latched now
        channels : bit i set where input i is to blame
        """
        row = {"time_s": time_s, "faults": int(faults), "names": fault_names(faults), "channels": channels}
        self._add("faults", time_s, row)

    def neutral(self, time_s: float, neutral: Neutral) -> None:
        """Record the reading that counts as zero.

        time_s : when it was taken [s]
        neutral : the reading
        """
        row: dict[str, Any] = {"time_s": time_s, "samples": neutral.samples}
        for branch, pressure, scatter in zip(BRANCHES, neutral.pressures, neutral.scatter, strict=False):
            row[f"gauge_{branch}_kpa"] = pressure / KPA
            row[f"scatter_{branch}_kpa"] = scatter / KPA
        self._add("neutral", time_s, row)

    def angle(self, time_s: float, received_s: float, values: Mapping[str, float], fault: str = "") -> None:
        """Record what the camera's pictures say of the finger.

        time_s : when the picture was taken, as the camera says [s]
        received_s : when its angle was known [s]
        values : bend_deg, sigma_deg, theta1_deg, theta2_deg, quality; what is not a number becomes null
        fault : why the angle is not known, empty when it is
        """
        row: dict[str, Any] = {"time_s": time_s, "received_s": received_s}
        row |= {key: _digits(float(value)) for key, value in values.items()}
        self._add("angles", time_s, {**row, "fault": fault})

    def decision(self, time_s: float, controller: str, values: Mapping[str, Any]) -> None:
        """Record what a controller saw and decided.

        time_s : when [s]
        controller : its name
        values : numbers and text, units in the keys
        """
        self._add("decisions", time_s, {"time_s": time_s, "controller": controller, "values": dict(values)})

    def event(self, time_s: float, name: str, **detail: str) -> None:
        """Record anything else.

        time_s : when [s]
        name : what happened
        detail : further text
        """
        self._add("events", time_s, {"time_s": time_s, "name": name, "detail": detail})

    def frame(self, time_s: float, encoded: bytes, width: int, height: int) -> None:
        """Record a camera frame.

        time_s : when it was captured [s]
        encoded : a JPEG or PNG file
        width : [pixel]
        height : [pixel]
        """
        kind = "png" if encoded.startswith(b"\x89PNG") else "jpeg"
        stamp = self._nanoseconds(time_s)
        row = {
            "timestamp": {"sec": stamp // NS, "nsec": stamp % NS},
            "frame_id": "camera",
            "format": kind,
            "data": base64.b64encode(encoded).decode(),
            "time_s": time_s,
            "width": width,
            "height": height,
        }
        self._add("frames", time_s, row)

    def flush_if_due(self, now: float) -> None:
        """Close the chunk when it is half a second old.

        now : the clock's time [s]
        """
        if now - self._chunk_opened >= CHUNK_S:
            self._chunk_opened = now
            self._attempt(self._close_chunk)

    def close(self) -> None:
        """Write the index and close the file; an already failed one is only closed."""
        if self._file.closed:
            return
        try:
            if self._failed is None:
                self._attempt(self._writer.finish)
        finally:
            self._file.close()

    def _begin(self, settings: RigSettings) -> None:
        self._writer.start("", f"tubefoot {__version__}")
        self._channels = {}
        for topic, columns in TOPICS.items():
            name, schema = FRAME_SCHEMA if topic == "frames" else (f"tubefoot.{topic}", schema_of(columns))
            schema_id = self._writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
            self._channels[topic] = self._writer.register_channel(f"/{topic}", "json", schema_id)
        about = {
            "version": __version__,
            "rig": settings.model_dump_json(),
            "clock_epoch_ns": str(self._epoch_ns),
        }
        self._writer.add_metadata("tubefoot", about)
        self._close_chunk()

    def _add(self, topic: str, time_s: float, row: Mapping[str, Any]) -> None:
        stamp = self._nanoseconds(time_s)
        data = json.dumps(row, allow_nan=False, separators=(",", ":")).encode()
        self._attempt(self._writer.add_message, self._channels[topic], stamp, data, stamp)
        self.flush_if_due(time_s)

    def _nanoseconds(self, time_s: float) -> int:
        return self._epoch_ns + round(time_s * NS)

    def _close_chunk(self) -> None:
        # The library closes a chunk by size only; its own method for it is private, hence the odd name.
        self._writer._Writer__finalize_chunk()  # type: ignore[attr-defined]

    def _attempt(self, action: Any, *arguments: Any) -> None:
        """Run an action that writes; after a failure cut the file back to its last whole part and refuse."""
        if self._failed is None:
            try:
                action(*arguments)
                self._whole.mark()
                return
            except OSError as error:
                self._failed = error
                self._whole.cut_back()
        raise LinkError(
            f"{self.path}: recording stopped: {self._failed.strerror or self._failed}; what was recorded "
            "before is readable. Free some space, or record to another disk"
        ) from self._failed


class _WholeWrites:
    """An unbuffered file that can be cut back to what was marked as whole."""

    def __init__(self, file: Any):
        self._file = file
        self._length = self._marked = 0

    def write(self, data: bytes) -> int:
        view = memoryview(data)
        while view:
            view = view[self._file.write(view) :]
        self._length += len(data)
        return len(data)

    def tell(self) -> int:
        return self._length

    def flush(self) -> None:
        """Nothing is held back."""

    def mark(self) -> None:
        self._marked = self._length

    def cut_back(self) -> None:
        self._file.truncate(self._marked)


def _digits(value: float) -> float | None:
    """Seven significant digits, None for what is not a number."""
    return None if value != value else float(f"{value:.7g}")
