"""Each fault of the schedule does to the bench what it would do to a real one, and ends when it should."""

from __future__ import annotations

import pytest

from tubefoot.config import parse_settings
from tubefoot.errors import ConfigError, LinkError, SafetyStop
from tubefoot.lab.messages import Fault
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import BenchSettings, FingerMake
from tubefoot.twin.faults import BenchFault
from tubefoot.units import KPA
from tubefoot.vision.camera import StaleFrameError

STIFF = BenchSettings(finger=FingerMake(law="still", creep=False, bubble_right_ml=0.5))


def bench_with(**fault):
    bench = VirtualBench(STIFF, board="native", faults=[BenchFault(**fault)])
    bench.rig.connect()
    bench.angles.open()
    bench.camera.open()
    return bench


def test_a_lost_camera_is_an_error_and_comes_back():
    with bench_with(kind="camera_lost", at_s=1.0, lasts_s=1.0) as bench:
        while bench.clock.now() < 0.95:
            bench.angles.read()
        while bench.clock.now() < 1.08:
            bench.rig.wait(0.01)
        bench.angles.read()  # the last one that was under way
        began = bench.clock.now()
        with pytest.raises(LinkError, match=r"no frame for 0\.3 s"):
            bench.angles.read()
        assert bench.clock.now() - began == pytest.approx(0.3, abs=0.002)
        with pytest.raises(StaleFrameError, match="old"):
            bench.camera.read()  # what lay in its buffer all the time
        with pytest.raises(LinkError, match="no frame for"):
            bench.camera.read()
        bench.rig.wait(2.3 - bench.clock.now())
        assert not bench.angles.read().lost
        assert bench.camera.read().time_s > 2.0


def test_a_hidden_marker_is_a_reading_that_says_so():
    with bench_with(kind="marker_hidden", at_s=0.5, lasts_s=0.5) as bench:
        lost = []
        while bench.clock.now() < 1.4:
            reading = bench.angles.read()
            assert reading.lost == (0.5 <= reading.time_s < 1.0)
            lost.append(reading.lost)
        assert 12 < sum(lost) < 18


@pytest.mark.parametrize(
    ("kind", "amount", "fault"),
    [("sensor_open", 1.0, Fault.SENSOR_LOW), ("sensor_shorted", 1.0, Fault.SENSOR_HIGH)],
)
def test_a_broken_sensor_stops_the_pump(kind, amount, fault):
    with bench_with(kind=kind, at_s=0.5, side="left", amount=amount, lasts_s=0.5) as bench:
        bench.rig.pulse(1, 0.3, 2.0)
        bench.rig.wait(0.6)
        assert bench.rig.faults == fault
        assert bench.rig.read().direction == 0
        with pytest.raises(SafetyStop):
            bench.rig.clear_faults()
        bench.rig.wait(0.6)
        bench.rig.clear_faults()
        bench.rig.wait(0.05)
        assert bench.rig.faults == Fault(0)


def test_a_stuck_sensor_shows_what_it_showed():
    with bench_with(kind="sensor_stuck", at_s=0.3, side="right", amount=2.6) as bench:
        bench.rig.wait(0.5)
        before = bench.rig.read().gauge_pressures
        bench.rig.pulse(1, 0.8, 0.2)
        bench.rig.wait(0.4)
        after = bench.rig.read().gauge_pressures
        assert after[0] == pytest.approx(before[0], abs=0.3 * KPA)
        assert after[1] < before[1] - 3 * KPA


def test_a_reset_stops_the_pump_and_ends_the_session():
    with bench_with(kind="board_reset", at_s=0.6) as bench:
        bench.rig.pulse(1, 0.5, 2.0)
        bench.rig.wait(1.0)
        assert bench.rig.faults == Fault.RESET_WHILE_PUMPING
        with pytest.raises((LinkError, SafetyStop)):
            bench.rig.pulse(1, 0.5, 0.1)
        bench.rig.connect()
        bench.rig.clear_faults()
        assert bench.rig.pulse(1, 0.5, 0.1).duration == 0.1


def test_a_pulled_cable_is_an_error_and_the_pump_stops_by_itself():
    with bench_with(kind="line_lost", at_s=0.6, lasts_s=1.0) as bench:
        bench.rig.pulse(1, 0.5, 3.0)
        with pytest.raises(LinkError, match=r"closed|unplugged"):
            bench.rig.wait(1.0)
        bench.clock.sleep(0.6)
        assert abs(bench.truth().pump_flow) < 1.0
        bench.clock.sleep(1.0)
        bench.rig.connect()
        bench.rig.wait(0.1)
        assert bench.rig.faults == Fault.SILENCE


def settled(bench, until):
    bench.rig.pulse(1, 0.8, 0.3)
    bench.rig.wait(until - bench.clock.now())
    return bench.truth()


def test_a_burst_bubble_moves_air_into_the_column():
    with bench_with(kind="bubble_burst", at_s=1.0, side="right") as bench:
        before = settled(bench, 0.99)
        bubble, air = bench.plant.hydraulics.sides[0].bubble, bench.plant.hydraulics.sides[0].air
        bench.rig.wait(0.3)
        after = bench.truth()
        assert bench.plant.hydraulics.sides[0].air == pytest.approx(air + bubble - 1.0)
        # The column's air now holds the bubble's volume at that pressure: its level falls by as much.
        fall = before.column_levels[0] - after.column_levels[0]
        absolute = 1 + after.branch_pressures[0] / 0.101325
        assert fall == pytest.approx(500 / absolute / (3.14159 * 4), rel=0.02)


def test_a_leak_lets_the_finger_sink_until_it_is_mended():
    with bench_with(kind="leak", at_s=1.0, lasts_s=1.0, side="right", amount=20.0) as bench:
        before = settled(bench, 0.99)
        bench.rig.wait(1.02)
        leaking = bench.truth()
        bench.rig.wait(1.0)
        mended = bench.truth()
    assert leaking.bend < 0.9 * before.bend
    assert mended.bend == pytest.approx(leaking.bend, rel=0.03)


def test_a_blocked_tube_keeps_the_finger_still():
    with bench_with(kind="tube_blocked", at_s=0.0, side="right") as bench:
        blocked = settled(bench, 1.0).bend
    with VirtualBench(STIFF, board="native") as bench:
        bench.rig.connect()
        free = settled(bench, 1.0).bend
    assert 0 < blocked < 0.6 * free  # what is left comes from the suction of the other chamber


def test_nonsense_is_refused():
    with pytest.raises(ConfigError, match="share of the bubble"):
        parse_settings({"kind": "bubble_burst", "at_s": 1, "amount": 2}, BenchFault)
    with pytest.raises(ConfigError, match="above the supply"):
        parse_settings({"kind": "sensor_stuck", "at_s": 1, "amount": 7}, BenchFault)
    with pytest.raises(ConfigError, match="kind"):
        parse_settings({"kind": "earthquake", "at_s": 1}, BenchFault)
