"""Our own recordings as raw series: pulses, rest, angles of camera or controller, files cut short."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import BenchSettings, FingerMake
from tubefoot.units import DEG, KPA
from tubefoot.validation.bench_mcap import read_bench_mcap

MAKE = BenchSettings(finger=FingerMake(law="still", creep=False, units=3))


def session(path, camera):
    """Two pulses; angles as the camera's topic, or only as decisions of a controller."""
    settings = RigSettings(name="mine")
    with VirtualBench(MAKE, board="native") as bench:
        recorder = Recorder(path, settings, bench.clock.now())
        rig = BoardRig(bench.port, settings, recorder)
        rig.connect()
        neutral = measure_neutral(rig, 0.5)
        for direction in (1, -1):
            rig.pulse(direction, 0.5, 0.1)
            for number in range(10):
                rig.wait(0.05)
                now = bench.clock.now()
                if camera:
                    values = {"bend_deg": 2.0 + number if number else float("nan"), "sigma_deg": 0.02}
                    recorder.angle(now - 0.05, now, values, "" if number else "covered")
                elif number % 5 == 0:
                    recorder.decision(now, "paper", {"bend_deg": 3.0 * direction, "note": "x"})
        recorder.close()
    return neutral


def test_pulses_rest_and_angles_of_the_camera(tmp_path):
    neutral = session(tmp_path / "a.mcap", camera=True)
    raw = read_bench_mcap(tmp_path / "a.mcap")
    assert raw.rest_pressures == pytest.approx(neutral.pressures)
    assert [pulse.direction for pulse in raw.pulses] == [1, -1]
    assert [pulse.end - pulse.start for pulse in raw.pulses] == pytest.approx([0.1, 0.1], abs=1e-6)
    assert raw.pulses[0].volume > 0 > raw.pulses[1].volume
    running = raw.time[raw.drive > 0]
    assert running.min() == pytest.approx(raw.pulses[0].start, abs=0.02)
    assert running.max() == pytest.approx(raw.pulses[0].end, abs=0.02)
    assert len(raw.angle) == 2 * 9
    assert raw.angle[:2] / DEG == pytest.approx([3.0, 4.0])
    assert raw.angle_sigma == pytest.approx(np.full(18, 0.02 * DEG))
    assert np.ptp(raw.pressures[:, 0]) > 2 * KPA
    assert raw.provenance["rig"] == "mine"


def test_decisions_of_a_controller_give_angles_where_no_camera_wrote_them(tmp_path):
    session(tmp_path / "b.mcap", camera=False)
    raw = read_bench_mcap(tmp_path / "b.mcap")
    assert raw.angle / DEG == pytest.approx([3.0, 3.0, -3.0, -3.0])


def test_a_recording_cut_short_is_read_and_says_so(tmp_path):
    session(tmp_path / "c.mcap", camera=True)
    whole = (tmp_path / "c.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(0.8 * len(whole))])
    raw = read_bench_mcap(tmp_path / "cut.mcap")
    assert raw.provenance["format"] == "mcap, cut short"
    assert len(raw.time) > 50


def test_a_recording_without_samples_is_refused(tmp_path):
    recorder = Recorder(tmp_path / "d.mcap", RigSettings(), 0.0)
    recorder.close()
    with pytest.raises(ConfigError, match="no samples in this recording"):
        read_bench_mcap(tmp_path / "d.mcap")
