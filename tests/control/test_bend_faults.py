"""Whatever fails during a motion, the pump stands soon, and the reason is told."""

import numpy as np
import pytest
from tests.control.bends import bent, reference_law

from tubefoot.control.settings import BendSettings, GuardSettings
from tubefoot.lab.settings import LimitSettings, RigSettings
from tubefoot.twin.bench_settings import BenchSettings, FingerMake
from tubefoot.twin.faults import BenchFault
from tubefoot.units import DEG

BEGUN_S = 1.6
"""The neutral takes one second; the first long pulse is under way."""


def faulty(kind, at_s=BEGUN_S, **fault):
    return [BenchFault(kind=kind, at_s=at_s, **fault)]


def pumped_after(motion, seconds):
    """Volume that the rig told after a time of the motion [ml]."""
    late = [row["pumped_volume_ml"] for row in motion.rows if row["time_s"] > seconds]
    return max(late) - min(late) if late else 0.0


def test_camera_lost_stops_the_pump_and_ends_the_motion():
    motion = bent(30, faults=faulty("camera_lost"))
    assert not motion.settled
    assert motion.reason.startswith("blind for")
    assert "no frame for 0.3 s" in motion.reason
    assert pumped_after(motion, BEGUN_S - 1.0 + 0.5) == 0.0  # frame under way, time-out of the camera
    assert abs(motion.after.pump_flow) < 1.0


def test_camera_back_in_time_goes_on():
    motion = bent(30, faults=faulty("camera_lost", lasts_s=1.0))
    assert motion.settled
    assert any(row["command"] == "blind" for row in motion.rows)


def test_marker_hidden_stops_the_pump_and_ends_the_motion():
    motion = bent(30, faults=faulty("marker_hidden"))
    assert motion.reason.startswith("blind for")
    assert "covered" in motion.reason
    assert pumped_after(motion, BEGUN_S - 1.0 + 0.35) == 0.0
    assert abs(motion.after.pump_flow) < 1.0


@pytest.mark.parametrize(("kind", "name"), [("sensor_open", "sensor_low"), ("sensor_shorted", "sensor_high")])
def test_broken_sensor_ends_the_motion(kind, name):
    motion = bent(30, faults=faulty(kind, side="left"))
    assert motion.reason.startswith("board fault")
    assert name in motion.reason
    assert abs(motion.after.pump_flow) < 1.0


def test_stuck_sensor_is_noticed():
    motion = bent(30, faults=faulty("sensor_stuck", side="right", amount=2.6))
    assert motion.reason.startswith("no answer")
    assert "right pressure" in motion.reason
    assert abs(motion.after.pump_flow) < 1.0


def test_board_reset_ends_the_motion():
    motion = bent(30, faults=faulty("board_reset"))
    assert not motion.settled
    assert "reset_while_pumping" in motion.reason or "link lost" in motion.reason
    assert abs(motion.after.pump_flow) < 1.0


def test_pulled_cable_ends_the_motion():
    motion = bent(30, faults=faulty("line_lost"))
    assert motion.reason.startswith("link lost")
    assert abs(motion.after.pump_flow) < 1.0


def test_burst_bubble_is_made_up_for():
    make = BenchSettings(finger=FingerMake(bubble_right_ml=0.6))
    motion = bent(20, make=make, faults=faulty("bubble_burst", at_s=3.0))
    assert motion.settled
    assert abs(motion.rows[-1]["true_deg"] - 20) < 1.1


@pytest.mark.slow
def test_leak_ends_the_motion():
    foreseen = 30 * DEG / reference_law().gain
    motion = bent(30, foreseen=foreseen, faults=faulty("leak", side="right", amount=60.0))
    assert not motion.settled
    assert motion.reason.startswith(("leak suspected", "out of reach"))
    assert abs(motion.after.pump_flow) < 1.0


def test_target_out_of_reach_of_the_pressure_limit():
    rig = RigSettings(limits=LimitSettings(pressure_low_kpa=-25, pressure_high_kpa=25))
    settings = BendSettings(guard=GuardSettings(pressed_max_s=6.0))
    motion = bent(30, settings=settings, rig_settings=rig)
    assert motion.reason.startswith("out of reach")
    assert "limit 25 kPa" in motion.reason or "limit -25 kPa" in motion.reason
    assert 5 < motion.rows[-1]["true_deg"] < 25
    pressures = np.array([row["pressure_right_kpa"] for row in motion.rows])
    assert pressures.max() < 26.5  # the board's own limit, and the sensor's zero shift


def test_volume_limit_of_the_rig():
    rig = RigSettings(limits=LimitSettings(volume_max_ml=0.3))
    motion = bent(30, rig_settings=rig)
    assert motion.reason.startswith("safety stop")
    assert "0.3 ml limit" in motion.reason


def test_interrupted_motion_stops_the_pump_and_keeps_its_rows():
    def interrupt(row):
        if row["time_s"] > 0.4:
            raise KeyboardInterrupt

    motion = bent(30, watch=interrupt)
    assert motion.reason.startswith("interrupted")
    assert len(motion.rows) > 5
    assert motion.rows[-1]["direction"] == 1
    assert abs(motion.after.pump_flow) < 1.0
