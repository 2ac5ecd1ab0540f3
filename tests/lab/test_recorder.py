"""Recordings: nothing lost but the last second, whatever happens; standard readers read them."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys

import pytest
from mcap.reader import make_reader

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.recording import Recording, repair_recording
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, SimulatedBoard

PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4

KILLED_WRITER = """
import os, signal, sys
from pathlib import Path
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.board import LockstepPort, SimulatedBoard
board = SimulatedBoard(BenchPlant())
port = LockstepPort(board)
rig = BoardRig(port, RigSettings(), Recorder(Path(sys.argv[1]), RigSettings(), 0.0))
rig.connect()
rig.pulse(1, 0.5, 5.0)
rig.wait(float(sys.argv[2]))
print(rig.clock.now(), flush=True)
board.close()
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def recorded(tmp_path):
    """A whole recording of half a second with one of everything."""
    path = tmp_path / "bench.mcap"
    with SimulatedBoard(BenchPlant()) as board:
        port = LockstepPort(board)
        recorder = Recorder(path, RigSettings(name="mine"), port.clock.now())
        rig = BoardRig(port, RigSettings(name="mine"), recorder)
        rig.connect()
        measure_neutral(rig, 0.2)
        rig.pulse(1, 0.5, 0.1)
        rig.wait(0.2)
        recorder.decision(port.clock.now(), "proportional", {"target_deg": 30.0, "angle_deg": 12.5})
        recorder.frame(port.clock.now(), PNG, 640, 480)
        board.plant.overrides[0] = 5.0
        rig.wait(0.1)
        rig.close()
        recorder.close()
    return path


def test_everything_comes_back(recorded):
    recording = Recording(recorded)
    assert recording.complete
    assert recording.settings.name == "mine"
    samples = recording.samples
    assert samples["time_s"].is_monotonic_increasing
    assert {"pressure_right_kpa", "gauge_left_kpa", "supply_v", "pumped_volume_ml"} <= set(samples.columns)
    assert recording.table("pulses")["duration_s"].tolist() == [0.1]
    assert recording.table("pulse_ends")["reason"].tolist() == ["completed"]
    commands = recording.table("commands")
    answers = recording.table("acknowledgements")
    assert set(zip(commands["sequence"], commands["command"] == "Pulse", strict=True)) >= {
        (row["sequence"], True) for _, row in answers[answers["command_id"] == 3].iterrows()
    }
    assert recording.rows("decisions")[0]["values"] == {"target_deg": 30.0, "angle_deg": 12.5}
    assert "sensor_high" in recording.table("faults")["names"].iloc[-1]
    [frame] = recording.frames()
    assert (frame.encoded, frame.width, frame.height) == (PNG, 640, 480)


def test_pandas_and_xarray_take_it_in_a_line(recorded):
    dataset = Recording(recorded).samples.set_index("time_s").to_xarray()
    assert dataset["pressure_right_kpa"].dims == ("time_s",)


def test_the_standard_reader_reads_it(recorded):
    with recorded.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
        topics = {channel.topic for _, channel, _ in reader.iter_messages()}
    assert {"/samples", "/commands", "/frames", "/faults"} <= topics


def test_a_recording_is_never_overwritten(recorded):
    with pytest.raises(ConfigError, match="never overwritten"):
        Recorder(recorded, RigSettings(), 0.0)


@pytest.mark.parametrize("seconds", [1.3, 3.0])
def test_kill_9_loses_less_than_the_last_second(tmp_path, seconds):
    path = tmp_path / "bench.mcap"
    done = subprocess.run(
        [sys.executable, "-c", KILLED_WRITER, path, str(seconds)], capture_output=True, text=True
    )
    assert done.returncode == -signal.SIGKILL
    killed_at = float(done.stdout)
    recording = Recording(path)
    assert not recording.complete
    last = recording.samples["time_s"].iloc[-1]
    assert 0 <= killed_at - last < 1.0
    assert len(recording.samples) == pytest.approx(200 * last, abs=40)
    before = recording.rows("samples")
    assert repair_recording(path)
    assert not repair_recording(path)
    with path.open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count > 0
    assert Recording(path).complete
    assert Recording(path).rows("samples") == before


@pytest.mark.parametrize("lost", [1, 30, 400, 2000])
def test_a_file_cut_anywhere_still_reads(recorded, lost):
    whole = len(Recording(recorded).samples)
    data = recorded.read_bytes()
    recorded.write_bytes(data[: len(data) - lost])
    assert 0 < len(Recording(recorded).samples) <= whole


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"this is no recording at all")
    with pytest.raises(LinkError, match="not an MCAP recording"):
        Recording(path)
    with pytest.raises(ConfigError, match="No such file"):
        Recording(tmp_path / "none.mcap")


class FullDisk:
    """A file on a disk that fills up."""

    def __init__(self, file, room):
        self._file, self._room = file, room

    def write(self, data):
        if len(data) > self._room:
            taken, self._room = self._room, 0
            if taken == 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return self._file.write(data[:taken])
        self._room -= len(data)
        return self._file.write(data)

    def __getattr__(self, name):
        return getattr(self._file, name)


def test_a_full_disk_stops_the_pump_and_leaves_a_readable_file(tmp_path):
    path = tmp_path / "bench.mcap"
    with SimulatedBoard(BenchPlant()) as board:
        port = LockstepPort(board)
        recorder = Recorder(path, RigSettings(), 0.0)
        rig = BoardRig(port, RigSettings(), recorder)
        rig.connect()
        rig.wait(1.0)
        recorder._whole._file = FullDisk(recorder._whole._file, 6000)
        rig.pulse(1, 0.5, 5.0)
        with pytest.raises(LinkError, match="No space left"):
            rig.wait(4.0)
        rig.wait(0.05)
        assert rig.read().direction == 0
        assert not board.pump_on
        recorder.close()
        full_at = port.clock.now()
    recording = Recording(path)
    assert not recording.complete
    assert 0 < full_at - recording.samples["time_s"].iloc[-1] < 1.0
