"""The controllers: the paper's rule to the letter, ours on the virtual bench, tracking of a sine."""

import numpy as np
import pytest
from tests.control.bends import bent, controller, reference_law

from tubefoot.control.contract import Finished, Measurement, Pulse, Wait
from tubefoot.control.loop import BendLoop
from tubefoot.control.settings import BendSettings, PaperSettings
from tubefoot.control.trace import step_figures, tracking_figures
from tubefoot.control.tracking import TrackingController
from tubefoot.control.trajectory import flow_needed, largest_sine, load_trajectory, trajectory_of
from tubefoot.errors import ConfigError
from tubefoot.lab.sensing import measure_neutral
from tubefoot.twin.bench import VirtualBench
from tubefoot.units import DEG


def seen(time, bend_deg, direction=0):
    return Measurement(time, time - 0.05, bend_deg * DEG, 1e-4, (0.0, 0.0), 0.0, time, direction)


def paper(target_deg=30):
    settings = BendSettings(paper=PaperSettings(seconds_per_deg=0.01, pulse_min_s=0.03, pulse_max_s=0.2))
    return controller("paper", target_deg, settings)


@pytest.mark.parametrize(
    ("bend_deg", "direction", "duration"), [(0, 1, 0.2), (20, 1, 0.1), (31.2, -1, 0.03), (45, -1, 0.15)]
)
def test_error_becomes_a_bounded_pulse(bend_deg, direction, duration):
    steps = paper()
    assert isinstance(steps.decide(seen(0.0, bend_deg)), Wait)
    command = steps.decide(seen(0.6, bend_deg))
    assert isinstance(command, Pulse)
    assert command.direction == direction
    assert command.duration == pytest.approx(duration)


def test_the_finger_settles_for_half_a_second_after_each_pulse():
    steps = paper()
    steps.decide(seen(0.0, 0))
    assert isinstance(steps.decide(seen(0.54, 0)), Wait)  # its frame is from 0.49 s
    assert isinstance(steps.decide(seen(0.56, 0)), Pulse)
    assert isinstance(steps.decide(seen(0.6, 1, direction=1)), Wait)
    assert isinstance(steps.decide(seen(0.8, 2)), Wait)
    assert isinstance(steps.decide(seen(1.3, 3)), Wait)
    assert isinstance(steps.decide(seen(1.36, 3)), Pulse)


def test_the_hold_lasts_two_seconds_and_its_end_decides():
    steps = paper()
    steps.decide(seen(0.0, 29.5))
    assert steps.decide(seen(0.6, 29.5)).note == "hold"
    assert steps.decide(seen(2.55, 31.5)).note == "hold"
    assert steps.decide(seen(2.61, 30.9)) == Finished(True, "settled")
    steps.aim(30 * DEG)
    steps.decide(seen(10.0, 29.5))
    steps.decide(seen(10.6, 29.5))
    assert isinstance(steps.decide(seen(12.7, 31.5)), Pulse)  # crept out of the band


@pytest.mark.parametrize("target", [30, -20])
def test_ours_settles_with_few_pulses_and_little_overshoot(target):
    motion = bent(target, seed=5)
    figures = step_figures(motion, target)
    assert motion.settled
    assert figures["iterations"] <= 5
    assert figures["overshoot_deg"] < 1.0
    assert figures["hold_error_deg"] < 0.5
    true = [row["true_deg"] for row in motion.rows if row["time_s"] > motion.rows[-1]["time_s"] - 2.0]
    assert np.abs(np.array(true) - target).max() < 1.1


def test_the_same_seed_gives_the_same_motion_to_the_bit():
    first, second = (bent(10, seed=4) for _ in range(2))
    assert first.rows == second.rows


def test_figures_of_a_motion_are_those_of_its_rows():
    motion = bent(12, name="paper", seed=1)
    figures = step_figures(motion, 12.0)
    seen_rows = [row for row in motion.rows if "bend_deg" in row]
    assert figures["overshoot_deg"] == max(0, max(row["bend_deg"] for row in seen_rows) - 12)
    assert figures["final_error_deg"] == 12 - seen_rows[-1]["bend_deg"]
    starts = sum(b["pulses"] > a["pulses"] for a, b in zip(motion.rows, motion.rows[1:], strict=False))
    assert figures["iterations"] == starts + motion.rows[0]["pulses"]
    assert abs(figures["final_error_deg"]) <= 1.0


@pytest.mark.slow
def test_a_sine_is_tracked():
    times = np.arange(0, 20.01, 0.1)
    sine = trajectory_of([(float(t), 20 * float(np.sin(2 * np.pi * 0.05 * t))) for t in times])
    with VirtualBench(board="native") as bench:
        bench.rig.connect()
        measure_neutral(bench.rig)
        bench.angles.open()
        tracking = TrackingController(sine, reference_law(), bench.rig_settings.pump)
        motion = BendLoop(bench.rig, bench.angles, BendSettings()).run(tracking, timed=False)
    figures = tracking_figures(motion)
    assert figures["settled"]
    assert figures["rms_error_deg"] < 1.0
    assert max(row["bend_deg"] for row in motion.rows) > 18


def test_the_pump_limits_the_sine():
    """The amplitude that the law foresees for a flow takes about this flow when the law is inverted."""
    law, frequency = reference_law(), 0.1
    amplitude = float(largest_sine(law, 1000.0, np.array([frequency]))[0])
    times = np.arange(0, 30.001, 0.05)
    wave = trajectory_of([(float(t), amplitude / DEG * np.sin(2 * np.pi * frequency * t)) for t in times])
    flows = np.abs(flow_needed(law, wave, 0.1))[600:840]  # steady, before its end
    assert flows.max() == pytest.approx(1000.0, rel=0.15)
    assert largest_sine(law, 1000.0, np.array([1.0]))[0] < 0.2 * amplitude


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,bend_deg\n0,0\n", "two points"),
        ("time_s,bend_deg\n1,0\n2,1\n", "line 2: the first time_s is 1"),
        ("time_s,bend_deg\n0,0\n0,1\n", "line 3: time_s = 0 does not come after 0"),
        ("time_s,bend_deg\n0,0\n1,200\n", "at most 3600 s and 120 deg"),
        ("time_s,angle\n0,0\n1,2\n", "needs numbers in the columns time_s, bend_deg"),
    ],
)
def test_a_bad_trajectory_is_told_by_its_line(tmp_path, text, message):
    path = tmp_path / "trajectory.csv"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_trajectory(path)
