"""The bench's thread without server or browser: orders, helm, recordings, calibrations, emergency stop."""

import json
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from tests.dashboard_bench import open_bench, until

from tubefoot.config import load_settings
from tubefoot.dashboard.helm import Helm
from tubefoot.errors import ConfigError, SafetyStop
from tubefoot.lab.recording import Recording
from tubefoot.lab.settings import RigSettings
from tubefoot.records import read_table


class Wrist:
    """A clock that is moved by hand."""

    def __init__(self):
        self.time = 0.0

    def __call__(self):
        return self.time


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """One bench for the tests that leave it as they found it; its page never falls silent."""
    with open_bench(tmp_path_factory.mktemp("bench"), helm=Helm(2.0, Wrist())) as opened:
        opened.desk.beat("me")
        opened.desk.do("me", {"do": "take"})
        yield opened


def test_a_bend_settles_and_leaves_its_trace(bench):
    bench.desk.do("me", {"do": "bend", "target_deg": 12, "controller": "paper"})
    assert "settled" in bench.ended()
    traces = sorted(bench.session.log.directory.glob("motion*.csv"))
    rows = read_table(traces[-1])
    assert rows[-1]["bend_deg"] == pytest.approx(12.0, abs=1.0)
    assert np.degrees(bench.virtual.truth().bend) == pytest.approx(12.0, abs=1.2)


def test_pulse_and_zero(bench):
    bench.desk.do("me", {"do": "pulse", "direction": -1, "duty": 0.5, "duration_s": 0.1})
    assert bench.ended().startswith("ran 0.100 s, completed")
    bench.desk.do("me", {"do": "zero"})
    assert "zero from" in bench.ended()


def test_a_second_order_is_refused_and_stop_ends_the_first(bench):
    bench.desk.do("me", {"do": "follow", "amplitude_deg": 5, "period_s": 600})
    with pytest.raises(ConfigError, match="busy"):
        bench.desk.do("me", {"do": "pulse", "direction": 1})
    bench.desk.do("me", {"do": "stop"})
    assert "stopped from the page" in bench.ended()
    assert not bench.pumping


@pytest.mark.parametrize(
    ("message", "fault"),
    [
        ({"do": "bend", "target_deg": 500}, "allowed: -120 to 120"),
        ({"do": "bend", "target": 5}, "did you mean `target_deg`"),
        ({"do": "pulse", "direction": 0}, "direction"),
        ({"do": "follow", "period_s": 0.1}, "period_s"),
        ({"do": "dance"}, "unknown order 'dance'"),
    ],
)
def test_bad_orders_are_refused_with_the_reason(bench, message, fault):
    with pytest.raises(ConfigError, match=fault):
        bench.desk.do("me", message)
    assert not bench.session.busy


def test_a_bend_beyond_the_model_and_a_bad_table_end_with_the_reason(bench, monkeypatch):
    monkeypatch.setattr(bench.session, "plans", replace(bench.session.plans, largest=1.0))
    bench.desk.do("me", {"do": "bend", "target_deg": -60})
    assert "outside of the 57 deg" in bench.ended()
    bench.desk.do("me", {"do": "play", "table": "time_s,direction\n0,1\n"})
    assert "line 2" in bench.ended()


def test_one_page_steers_and_the_other_watches(bench):
    bench.desk.beat("other")
    with pytest.raises(SafetyStop, match="watches"):
        bench.desk.do("other", {"do": "pulse", "direction": 1})
    with pytest.raises(SafetyStop, match="another page"):
        bench.desk.do("other", {"do": "take"})
    bench.desk.do("me", {"do": "give_back"})
    bench.desk.do("other", {"do": "take"})
    assert bench.feed.status["holder"] == "other"
    bench.desk.do("other", {"do": "give_back"})
    bench.desk.do("me", {"do": "take"})


def test_emergency_stop_latches_until_release(bench):
    bench.desk.do("me", {"do": "pulse", "direction": 1, "duty": 0.4, "duration_s": 5})
    until(lambda: bench.pumping)
    assert "sent" in bench.desk.trip("a test")
    assert "emergency stop" in bench.ended()
    assert not bench.pumping
    with pytest.raises(SafetyStop, match="release"):
        bench.desk.do("me", {"do": "pulse", "direction": 1})
    bench.desk.do("me", {"do": "release"})
    bench.desk.do("me", {"do": "pulse", "direction": -1, "duty": 0.4, "duration_s": 0.1})
    assert "completed" in bench.ended()


def test_a_release_waits_for_the_stop_and_an_order_that_hung_meanwhile_ends(bench, monkeypatch):
    run_slowly(bench)
    until(lambda: bench.pumping)
    line, goes_on = bench.session.bench.line, threading.Event()
    monkeypatch.setattr(line, "_repeats", (0.0, 0.3))
    monkeypatch.setattr(bench.session.log, "frame", lambda *_: goes_on.wait(20))
    stopping = threading.Thread(target=bench.desk.trip, args=("a test",))
    stopping.start()
    until(lambda: line.tripped)
    bench.desk.do("me", {"do": "release"})  # while Stop is still being sent, the bench's thread hangs
    stopping.join()
    assert not line.tripped
    assert not bench.feed.status["stop"]["tripped"]
    goes_on.set()
    assert "emergency stop" in bench.ended()
    assert not bench.pumping


def test_campaign_is_run_recorded_and_can_be_read(bench):
    table = "time_s,direction,duty,duration_s\n0.2,1,0.5,0.2\n1.0,-1,0.5,0.2\n"
    bench.desk.do("me", {"do": "play", "table": table})
    assert bench.ended() == "2 pulses done"
    recording = Recording(sorted(bench.session.log.directory.glob("bench*.mcap"))[-1])
    assert recording.complete
    assert [row["direction"] for row in recording.rows("pulses")] == [1, -1]
    assert len(recording.rows("angles")) > 30
    assert len(recording.rows("neutral")) == 1  # the zero that was in force before it began
    times = np.diff([row["time_s"] for row in recording.rows("samples")])
    assert times.max() < 0.02  # no sample is missed although frames are looked at meanwhile


CAMPAIGN = """
name = "tiny"
rest_s = 1.0
settle_s = 0.3
repeats = 1
[[blocks]]
kind = "load"
until_kpa = 5.0
pulse_s = 0.2
[[blocks]]
kind = "unload"
pulse_s = 0.2
"""


def test_a_campaign_file_is_run_once_and_each_angle_recorded_once(bench):
    bench.desk.do("me", {"do": "play", "table": CAMPAIGN, "form": "toml"})
    assert "1 repeats done" in bench.ended()
    (folder,) = bench.session.log.directory.glob("campaign-*/")
    angles = [row["time_s"] for row in Recording(folder / "bench.mcap").rows("angles")]
    assert len(angles) > 40
    assert np.diff(angles).min() > 0.02
    bench.desk.do("me", {"do": "play", "table": CAMPAIGN, "form": "toml"})
    assert "were done before" in bench.ended()
    bench.desk.do(
        "me", {"do": "play", "table": CAMPAIGN.replace("pulse_s = 0.2", "pulse_s = 9"), "form": "toml"}
    )
    assert "pulse_s" in bench.ended()


def test_recording_on_and_off(bench):
    bench.desk.do("me", {"do": "record", "pictures": False})
    path = until(lambda: bench.feed.status.get("recording"))
    bench.desk.do("me", {"do": "end_record"})
    until(lambda: bench.feed.status.get("recording") is None)
    assert Recording(path).complete


def test_sensor_calibration_asks_on_the_page_and_is_in_force(bench):
    bench.desk.do("me", {"do": "calibrate", "what": "pressure"})
    # simulated hands set the pressures and read the gauge; only the end is asked for
    question = until(lambda: bench.feed.status.get("question"))
    with pytest.raises(ConfigError, match="no longer open"):
        bench.desk.do("me", {"do": "answer", "id": question["id"] + 1, "text": ""})
    bench.desk.do("me", {"do": "answer", "id": question["id"], "text": ""})
    said = bench.ended()
    assert "in force" in said
    path = sorted(bench.session.log.directory.glob("rig*.toml"))[-1]
    found = load_settings(path, RigSettings).sensor("right")
    assert found.zero_fraction == pytest.approx(0.5 + 0.012 / 5.0, abs=1e-3)  # offset of 12 mV; a count
    assert bench.session.bench.rig.settings.sensor("right") == found


def test_giving_a_calibration_up_leaves_the_bench_closed(bench):
    bench.desk.do("me", {"do": "calibrate", "what": "supply"})
    until(lambda: bench.feed.status.get("question"))
    bench.desk.do("me", {"do": "stop"})
    assert "stopped from the page" in bench.ended()
    assert all(side.held is None for side in bench.virtual.plant.hydraulics.sides)


def run_slowly(bench):
    bench.desk.do("me", {"do": "follow", "amplitude_deg": 15, "period_s": 20, "cycles": 100})
    until(lambda: bench.feed.status.get("phase") == "running")


def test_a_lost_page_stops_what_it_started_unless_told_to_go_on(tmp_path):
    wrist = Wrist()
    with open_bench(tmp_path, helm=Helm(2.0, wrist)) as bench:
        bench.desk.beat("me")
        bench.desk.do("me", {"do": "take"})
        run_slowly(bench)
        wrist.time += 1.9
        before = bench.virtual.clock.now()
        until(lambda: bench.virtual.clock.now() > before + 1.0)
        assert bench.session.busy  # silent for less than the limit
        wrist.time += 0.2
        assert "not heard for 2 s" in bench.ended()
        assert not bench.pumping
        until(lambda: bench.feed.status["holder"] == "")

        bench.desk.beat("me")  # heard again: it need not ask
        assert bench.feed.status["holder"] == "me"
        bench.desk.do("me", {"do": "bend", "target_deg": 10, "controller": "paper", "goes_on": True})
        wrist.time += 100.0
        assert "settled" in bench.ended()


def test_a_lost_page_that_is_heard_again_has_control_unless_it_was_taken_or_given_back():
    wrist = Wrist()
    helm = Helm(2.0, wrist)

    def lose():
        wrist.time += 3.0
        helm.beat("other")
        helm.forget_lost()
        assert helm.holder == ""

    helm.beat("me")
    assert helm.take("me")
    lose()
    helm.beat("other")
    assert helm.holder == ""
    helm.beat("me")
    assert helm.holder == "me"
    helm.give("me")
    helm.beat("me")
    assert helm.holder == ""
    assert helm.take("me")
    lose()
    assert helm.take("other")
    helm.give("other")
    helm.beat("me")
    assert helm.holder == ""


def test_closing_stops_the_pump(tmp_path):
    with open_bench(tmp_path, helm=Helm(2.0, Wrist())) as bench:
        bench.desk.beat("me")
        bench.desk.do("me", {"do": "take"})
        bench.desk.do("me", {"do": "pulse", "direction": 1, "duty": 0.5, "duration_s": 5})
        until(lambda: bench.pumping)
    assert not bench.pumping


def test_a_board_fault_is_shown_with_its_advice_and_cleared(tmp_path):
    with open_bench(tmp_path, helm=Helm(2.0, Wrist())) as bench:
        bench.desk.beat("me")
        bench.desk.do("me", {"do": "take"})
        bench.virtual.plant.overrides[0] = 0.05  # the right sensor's wire is open
        trouble = until(lambda: bench.feed.status["trouble"])
        assert trouble[0]["what"] == "sensor_low"
        assert "check plug" in trouble[0]["advice"]
        bench.virtual.plant.overrides.clear()
        bench.desk.do("me", {"do": "clear"})
        assert bench.ended() == "cleared"
        until(lambda: not bench.feed.status["trouble"])
        json.dumps(bench.feed.status)


def test_emergency_stop_and_silence_while_the_benchs_thread_hangs(tmp_path):
    with open_bench(tmp_path, live=True, patience_s=0.25, helm=Helm(2.0, Wrist())) as bench:
        bench.desk.beat("me")
        bench.desk.do("me", {"do": "take"})
        hang = {"s": 0.0}
        bench.session.log.frame = lambda *_: time.sleep(hang["s"])
        for trip in (True, False):
            hang["s"] = 0.0
            bench.desk.do("me", {"do": "pulse", "direction": 1, "duty": 0.4, "duration_s": 5})
            until(lambda: bench.pumping)
            hang["s"] = 2.5
            before = bench.virtual.clock.now()
            if trip:
                bench.desk.trip("a test")
            until(lambda: not bench.pumping)
            stopped = bench.pins[-1][1] - before
            hang["s"] = 0.0
            bench.ended()
            if trip:  # the stop is obeyed although time passes only by itself
                assert stopped < 0.35
                bench.desk.do("me", {"do": "release"})
            else:
                assert stopped < 0.8  # 0.4 s of silence, after what was under way
