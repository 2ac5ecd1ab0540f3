"""Campaigns on the virtual bench: goals, limits, resumption, lost cameras; blind experiments, sealed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.recording import Recording
from tubefoot.lab.settings import RigSettings
from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import BenchSettings, FingerMake
from tubefoot.twin.faults import BenchFault
from tubefoot.twin.population import TUNING_SEEDS, VERDICT_SEEDS
from tubefoot.units import DEG, KPA
from tubefoot.validation.campaign import Campaign
from tubefoot.validation.loading import load_recording
from tubefoot.validation.settled import settled_states
from tubefoot.validation.virtual_experiment import (
    HIDDEN_FIRST,
    SEALED,
    VirtualExperiment,
    hidden_bench,
    run_blind,
    run_experiment,
    unseal,
)

STILL = BenchSettings(finger=FingerMake(law="still", creep=False))


def campaign(repeats=1, **changed):
    table = {
        "name": "try",
        "rest_s": 1.0,
        "settle_s": 0.5,
        "repeats": repeats,
        "blocks": [
            {"kind": "load", "side": "right", "until_kpa": 12.0, "pulse_s": 0.12},
            {"kind": "unload", "pulse_s": 0.12},
            {"kind": "load", "side": "left", "until_kpa": 8.0, "pulse_s": 0.12},
            {"kind": "unload", "pulse_s": 0.12},
        ],
        **changed,
    }
    return parse_settings(table, Campaign)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Recording of one repeat with a 3-unit finger, and what was said."""
    said: list[str] = []
    path = run_experiment(
        VirtualExperiment(STILL, 3, campaign()), tmp_path_factory.mktemp("once"), say=said.append
    )
    return path, said


def test_a_campaign_loads_unloads_and_reverses(recorded):
    path, said = recorded
    assert [line.split(": ")[1].split(" ")[0] for line in said] == ["load", "unload", "load", "unload"]
    assert all("goal reached" in line for line in said)
    found = load_recording(path)
    states = settled_states(found, 0.1, 0.2)
    assert found.units == 3
    assert max(s.right for s in states) >= 11.5 * KPA
    assert max(s.left for s in states) >= 7.5 * KPA
    assert {s.side for s in states} >= {1, -1}
    assert abs(states[-1].right - states[-1].left) < 1.5 * KPA
    assert max(s.angle for s in states) > 3 * DEG > 0 > min(s.angle for s in states)


def test_the_recorded_angle_is_that_of_the_bench(recorded):
    """Right of the pulses' ends: the finger follows the reduced law at the measured pressures."""
    from tubefoot.reduced.files import reference_finger

    finger = reference_finger().with_units(3)
    for state in settled_states(load_recording(recorded[0]), 0.1, 0.2)[1:]:
        expected = finger.free_bending(np.array([state.right, state.left])).bend
        assert state.angle == pytest.approx(expected, abs=0.25 * DEG)


def test_an_interrupted_campaign_goes_on_with_its_repeat(tmp_path):
    def interrupt(line):
        if line.startswith("repeat 2/2, block 1"):
            raise KeyboardInterrupt

    experiment = VirtualExperiment(STILL, 3, campaign(repeats=2))
    with pytest.raises(KeyboardInterrupt):
        run_experiment(experiment, tmp_path, say=interrupt)
    assert json.loads((tmp_path / "campaign.json").read_text())["repeats"] == 1
    said: list[str] = []
    second = run_experiment(experiment, tmp_path, say=said.append)
    assert second.name == "bench-2.mcap"
    assert [line.split(",")[0] for line in said] == ["repeat 2/2"] * 4
    ledger = json.loads((tmp_path / "campaign.json").read_text())
    assert (ledger["repeats"], ledger["recordings"]) == (2, ["bench.mcap", "bench-2.mcap"])
    assert Recording(tmp_path / "bench.mcap").complete


def test_a_finger_that_was_left_pumped_is_brought_back_before_it_goes_on(tmp_path):
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.validation.campaign_run import CampaignRun, Ledger

    settings, plan, said = RigSettings(), campaign(), []
    make = BenchSettings(finger=FingerMake(law="still", units=3))
    with VirtualBench(make, board="native") as bench:
        recorder = Recorder(tmp_path / "bench.mcap", settings, bench.clock.now())
        rig = BoardRig(bench.port, settings, recorder)
        rig.connect()
        neutral = measure_neutral(rig)
        rig.pulse(1, 0.5, 0.4)
        rig.wait(2.0)
        left_at = rig.read().pressures[0]
        measure_neutral(rig)
        ledger = Ledger(plan.fingerprint, 0, ["before"], [p / KPA for p in neutral.pressures])
        CampaignRun(plan, rig, recorder, None, said.append)._rest(ledger)
        right, left = rig.read().pressures
        recorder.close()
    assert left_at > 8 * KPA
    assert "was left" in said[0]
    assert abs(right - left) < 1.5 * KPA


def test_a_directory_of_another_campaign_is_refused(tmp_path):
    (tmp_path / "campaign.json").write_text(
        '{"fingerprint": "x", "repeats": 0, "recordings": [], "neutral": []}'
    )
    with pytest.raises(ConfigError, match="belongs to another campaign"):
        run_experiment(VirtualExperiment(STILL, 3, campaign()), tmp_path)


def test_a_camera_that_is_lost_stops_the_campaign_and_its_recording_is_whole(tmp_path):
    faults = (BenchFault(kind="camera_lost", at_s=4.0),)
    with pytest.raises(LinkError, match="give the same command again"):
        run_experiment(VirtualExperiment(STILL, 3, campaign(), faults=faults), tmp_path)
    assert Recording(tmp_path / "bench.mcap").complete


def test_a_block_ends_at_the_limit_of_the_campaign(tmp_path):
    said: list[str] = []
    plan = campaign(
        pressure_high_kpa=9.0,
        blocks=[{"kind": "load", "until_kpa": 8.9, "duty": 0.6, "pulse_s": 0.4}, {"kind": "unload"}],
    )
    path = run_experiment(VirtualExperiment(STILL, 3, plan), tmp_path, say=said.append)
    assert "pressure limit" in said[0]
    assert np.max(load_recording(path).pressures) < 14 * KPA


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"blocks": [{"kind": "hold"}]}, "`seconds` goes with kind = hold"),
        ({"blocks": [{"kind": "load", "until_kpa": 50.0}]}, "until_kpa = 50, but pressure_high_kpa = 45"),
        ({"blocks": []}, "blocks"),
        ({"pauses_s": 1.0}, "unknown key `pauses_s`"),
    ],
)
def test_a_campaign_that_cannot_be_run_is_refused(changed, message):
    with pytest.raises(ConfigError, match=message):
        campaign(**changed)


def test_a_campaign_beyond_the_rig_is_refused():
    with pytest.raises(ConfigError, match=r"pressure_high_kpa lies at or beyond limits.pressure_high_kpa"):
        campaign(pressure_high_kpa=99.0).demand_within(RigSettings())
    strong = campaign(blocks=[{"kind": "load", "duty": 0.9}])
    weak = parse_settings({"limits": {"duty_max": 0.5}}, RigSettings)
    with pytest.raises(ConfigError, match=r"duty = 0.9 exceeds the 0.5 of this rig"):
        strong.demand_within(weak)


def test_hidden_benches_are_none_of_those_that_controllers_are_judged_by():
    assert hidden_bench(7, 3) == hidden_bench(7, 3)
    assert hidden_bench(7, 3) != hidden_bench(8, 3)
    assert not {HIDDEN_FIRST + seed for seed in range(10_000)} & {*VERDICT_SEEDS, *TUNING_SEEDS}
    short, long = hidden_bench(7, 3).finger, hidden_bench(7, 12).finger
    assert short.bubble_right_ml == pytest.approx(long.bubble_right_ml / 4, rel=1e-5)
    assert short.stiffness == long.stiffness
    with pytest.raises(ConfigError, match="0 to 9999"):
        hidden_bench(-1, 3)


def test_the_truth_is_sealed_and_a_change_of_it_is_noticed(tmp_path):
    plan = campaign(blocks=[{"kind": "load", "until_kpa": 2.0}])
    path, digest = run_blind(5, 3, plan, tmp_path)
    truth = hidden_bench(5, 3)
    assert unseal(tmp_path, digest) == truth
    assert str(truth.finger.stiffness).encode() not in path.read_bytes()
    sealed = tmp_path / SEALED
    sealed.write_text(sealed.read_text().replace(str(truth.finger.stiffness), "1.0"))
    with pytest.raises(ConfigError, match="is not the file that was sealed"):
        unseal(tmp_path, digest)


@pytest.mark.parametrize(("units", "length", "markers"), [(3, 29.0, 2), (6, 50.0, 3), (None, 92.0, 5)])
def test_a_bench_has_a_finger_of_any_length_with_markers_on_it(units, length, markers):
    with VirtualBench(BenchSettings(finger=FingerMake(law="still", units=units)), board="native") as bench:
        assert bench.layout.length_mm == length
        assert len(bench.layout.markers) == markers
        assert len(bench.plant.finger.unit_angles) == (units or 12)
