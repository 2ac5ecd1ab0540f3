"""The virtual bench: repeatable to the bit, honest cameras, one clock."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.sensing import measure_neutral
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import BenchSettings, CameraMake, FingerMake
from tubefoot.units import DEG, KPA
from tubefoot.vision.angles import TrackedAngles
from tubefoot.vision.camera import StaleFrameError
from tubefoot.vision.finger import FingerTracker

QUICK = FingerMake(law="still", creep=False)


def run(board, seed=0, settings=None, frames=False):
    """All that a host sees of a short session, and the truth at its end."""
    with VirtualBench(settings, seed, board) as bench:
        bench.rig.connect()
        measure_neutral(bench.rig, 0.2)
        bench.angles.open()
        bench.camera.open()
        seen = []
        for direction in (1, -1):
            bench.rig.pulse(direction, 0.7, 0.15)
            seen += [reading.pressures for reading in bench.rig.wait(0.3)]
            reading = bench.angles.read()
            seen.append((reading.time_s, reading.bend))
        if frames:
            seen.append(bench.camera.read().picture.tobytes())
        truth = bench.truth()
    return seen, (truth.time, truth.bend, truth.branch_pressures, truth.column_levels)


@pytest.mark.parametrize("board", ["native", "simavr"])
def test_the_same_seed_gives_the_same_run_to_the_bit(board):
    first, again = (run(board, 5, frames=True) for _ in "ab")
    assert first == again
    other = run(board, 6, frames=True)
    assert other[0] != first[0]
    assert other[1] != first[1]  # the rollers stand elsewhere


def test_looking_does_not_disturb():
    """Truth and cameras that nobody steers by leave the run as it is, but for the time they take."""
    ends = []
    for look in (False, True):
        with VirtualBench(board="native") as bench:
            bench.rig.connect()
            bench.rig.pulse(1, 0.8, 0.2)
            for _ in range(20):
                bench.rig.wait(0.02)
                if look:
                    bench.truth()
            ends.append(bench.truth().branch_pressures)
    assert ends[0] == ends[1]


def test_pumping_forward_bends_to_the_left_and_presses_right():
    with VirtualBench(board="native") as bench:
        bench.rig.connect()
        before = bench.truth()
        bench.rig.pulse(1, 0.9, 0.3)
        bench.rig.wait(1.0)
        truth = bench.truth()
    assert truth.bend > 2 * DEG
    assert truth.branch_pressures[0] > 5 * KPA > -5 * KPA > truth.branch_pressures[1]
    assert truth.column_levels[0] > before.column_levels[0] + 1
    assert truth.column_levels[1] < before.column_levels[1] - 1
    assert truth.chamber_volumes[0] > 0 > truth.chamber_volumes[1]


def test_frames_are_late_and_jitter_and_some_never_come():
    make = CameraMake(latency_ms=60.0, jitter_ms=6.0, drop_share=0.1, exposure_ms=8.0)
    with VirtualBench(BenchSettings(camera=make, finger=QUICK), board="native") as bench:
        bench.rig.connect()
        bench.angles.open()
        readings = []
        while bench.clock.now() < 40.0:
            reading = bench.angles.read()
            readings.append((reading.time_s, bench.clock.now() - reading.time_s))
    taken, age = np.array(readings).T
    gaps = np.rint(np.diff(taken) * 30).astype(int)
    assert np.all(np.diff(taken) > 0)
    np.testing.assert_allclose(np.diff(taken) * 30, gaps, atol=1e-6)
    assert np.mean(gaps - 1) == pytest.approx(0.1 / 0.9, abs=0.04)
    assert age.mean() == pytest.approx(0.0605, abs=2e-3)  # and half a step of the clock
    assert age.std() == pytest.approx(6e-3, rel=0.2)


def test_only_the_newest_frame_waits_for_a_busy_reader():
    with VirtualBench(board="native") as bench:
        bench.rig.connect()
        bench.angles.open()
        bench.angles.read()
        bench.rig.wait(1.0)
        now = bench.clock.now()
        reading = bench.angles.read()
        assert bench.clock.now() == now
        assert now - reading.time_s < 0.12
        assert bench.angles.read().time_s > reading.time_s


def test_pixels_and_the_fast_angles_both_tell_the_truth():
    make = BenchSettings(camera=CameraMake(drop_share=0.0), finger=QUICK)
    with VirtualBench(make, board="native") as bench:
        bench.rig.connect()
        tracked = TrackedAngles(bench.camera, FingerTracker(bench.calibration, bench.layout))
        tracked.open()
        bench.angles.open()
        bench.rig.pulse(1, 0.9, 0.3)
        bench.rig.wait(3.0)
        bend = bench.truth().bend / DEG
        assert bend > 10
        by_pixels = [tracked.read().bend / DEG - bend for _ in range(8)]
        fast = [bench.angles.read().bend / DEG - bend for _ in range(60)]
    assert np.abs(by_pixels).max() < 0.12
    assert np.mean(fast) == pytest.approx(0.008, abs=0.012)  # the zero error of the camera's settings
    assert np.std(fast) == pytest.approx(0.02, rel=0.3)


def test_a_moving_finger_is_seen_where_it_was():
    """In mid-stroke the reading is the angle at the frame's own time, not at its arrival."""
    with VirtualBench(BenchSettings(finger=QUICK), board="native") as bench:
        bench.rig.connect()
        bench.angles.open()
        times, bends, misses = [], [], []
        bench.rig.pulse(1, 1.0, 0.6)
        while bench.clock.now() < 1.0:
            bench.rig.wait(0.002)
            times.append(bench.clock.now())
            bends.append(bench.truth().bend)
            if len(times) % 15 == 0:
                reading = bench.angles.read()
                at_capture = np.interp(reading.time_s, times, bends)
                at_arrival = bench.truth().bend
                misses.append((abs(reading.bend - at_capture) / DEG, abs(reading.bend - at_arrival) / DEG))
    misses = np.array(misses)
    assert misses[:, 1].max() > 1.0
    assert np.median(misses[:, 0]) < 0.15


def test_wrong_use_is_told():
    with pytest.raises(ConfigError, match="simavr, native"):
        VirtualBench(board="arduino")
    with VirtualBench(board="native") as bench:
        with pytest.raises(LinkError, match="not open"):
            bench.camera.read()
        with pytest.raises(LinkError, match="not open"):
            bench.angles.read()


def test_a_frame_older_than_the_limit_is_refused():
    slow = BenchSettings(camera=CameraMake(latency_ms=400.0), finger=QUICK)
    with VirtualBench(slow, board="native") as bench, bench.camera as camera:
        bench.rig.connect()
        bench.rig.wait(1.0)
        with pytest.raises(StaleFrameError, match="limit is 250 ms"):
            camera.read()
