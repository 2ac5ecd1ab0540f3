"""Solves in time on a coarse one-unit finger: both limits, relaxation, creep, recovery, ends, resuming."""

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.design.material import OgdenMaterial
from tubefoot.errors import ConfigError
from tubefoot.fea.drive import Control
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.solve import solve_design
from tubefoot.fea.timeline import Stage, stages
from tubefoot.records import read_table

FINGER = FingerDesign().with_bellows(units=1)
PUMPED = {"until": "pumped_volume_ml", "target": 0.01}
BOTH = ("pressure_right_kpa", "pressure_left_kpa")


def solved(directory, finger=FINGER, **keys):
    coarse = {"element_size_mm": 3.5, "states": 3, "fields": "none", **PUMPED}
    return solve_design(finger, directory, SolveSettings(**{**coarse, **keys}))


def scaled(factor):
    body = OgdenMaterial(scale=factor)
    return FingerDesign.model_validate({**{k: getattr(FINGER, k) for k in ("name", "bellows")}, "body": body})


def test_a_slow_ramp_is_the_elastic_finger(tmp_path):
    slow = solved(tmp_path / "slow", viscoelastic=True, ramp_s=1e6)
    elastic = solved(tmp_path / "elastic")
    # The slowest term of 1000 s has 0.18 of the modulus: on a ramp of 1e6 s it leaves about 1e-3 of it.
    for name in (*BOTH, "bend_deg", "strain_energy_mj"):
        assert slow.column(name)[-1] == pytest.approx(elastic.column(name)[-1], rel=6e-4), name


def test_a_sudden_ramp_is_the_elastic_finger_with_all_moduli(tmp_path):
    factor = 1 + sum(FINGER.body.relaxation_share)
    keys = {"pressure_space": "none", "target": 0.004}
    sudden = solved(tmp_path / "sudden", viscoelastic=True, ramp_s=1e-9, **keys)
    stiff = solved(tmp_path / "stiff", scaled(factor), **keys)
    for name in (*BOTH, "bend_deg"):
        assert sudden.column(name)[-1] == pytest.approx(stiff.column(name)[-1], rel=1e-6), name


def test_pressures_relax_while_the_pump_stands_and_recover_after_its_return(tmp_path):
    result = solved(tmp_path, viscoelastic=True, ramp_s=1.0, hold_s=1e5, recover_s=1e5)
    time, right, left = (result.column(name) for name in ("time_s", *BOTH))
    assert result.summary["end_reason"] == "all stages done"
    holding = (time >= 1.0 - 1e-9) & (time <= 1e5 + 1.0 + 1e-3)
    assert np.ptp(result.column("pumped_volume_ml")[holding]) < 1e-9
    assert (np.diff(right[holding]) < 0).all()
    assert (np.diff(left[holding]) > 0).all()
    elastic = solved(tmp_path / "elastic")
    relaxed = np.flatnonzero(holding)[-1]
    # The last step of some 1e4 s takes the slowest term's stress to change evenly: that leaves some 1e-6.
    assert right[relaxed] == pytest.approx(elastic.column(BOTH[0])[-1], rel=2e-5)
    assert abs(right[-1]) < 1e-6 * right.max()
    # While the pump runs back the right chamber is under suction: the wall lags behind.
    assert right.min() < -0.3 * right.max()


def test_at_a_kept_pressure_the_finger_creeps(tmp_path):
    goal = {"until": "pressure_right_kpa", "target": 10.0, "hold": "goal"}
    result = solved(tmp_path, viscoelastic=True, ramp_s=1.0, hold_s=100.0, **goal)
    holding = result.column("time_s") >= 1.0 - 1e-9
    assert np.allclose(result.column("pressure_right_kpa")[holding], 10.0, rtol=1e-7)
    assert (np.diff(result.column("bend_deg")[holding]) > 0).all()
    assert (np.diff(result.column("pumped_volume_ml")[holding]) > 0).all()


def test_vacuum_ends_a_run_on_the_way(tmp_path):
    result = solved(tmp_path, viscoelastic=True, ramp_s=0.3, hold_s=10.0, target=0.04)
    assert "absolute vacuum" in result.summary["end_reason"]
    assert result.column("pressure_left_kpa")[-1] == pytest.approx(-101.325, rel=1e-6)
    assert result.column("time_s")[-1] < 0.3


def test_an_interrupted_run_goes_on_with_what_its_material_remembers(tmp_path):
    keys = {"viscoelastic": True, "ramp_s": 0.5, "hold_s": 20.0}

    class Interrupted(Exception):
        pass

    def stop(row):
        if row["step"] == 4:
            raise Interrupted

    settings = SolveSettings(element_size_mm=3.5, states=3, fields="none", **PUMPED, **keys)
    with pytest.raises(Interrupted):
        solve_design(FINGER, tmp_path / "a", settings, progress=stop)
    assert len(read_table(tmp_path / "a" / "curve.csv")) == 5
    resumed, whole = solved(tmp_path / "a", **keys), solved(tmp_path / "b", **keys)
    assert np.allclose(resumed.column("time_s"), whole.column("time_s"), rtol=1e-12)
    assert np.allclose(resumed.column("pressure_right_kpa"), whole.column("pressure_right_kpa"), rtol=1e-6)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"hold_s": 5.0}, "hold_s belong to a solve in time"),
        ({"hold": "goal", "recover_s": 1.0}, "hold, recover_s belong"),
        ({"viscoelastic": True, "ramp_s": 0.0}, "ramp_s"),
        ({"viscoelastic": True, "cavities": "filtered"}, "not in time"),
        ({"viscoelastic": True, "hold": "volume"}, "pump"),
    ],
)
def test_bad_times_are_explained(table, words):
    with pytest.raises(ConfigError, match=words):
        parse_settings(table, SolveSettings)


def test_stages_and_their_steps():
    goal = Control("parameter", 6.0)
    plan = stages(goal, ramp=2.0, hold=500.0, recover=0.0, steps=4, keep_goal=False)
    assert [stage.duration for stage in plan] == [2.0, 500.0]
    assert np.allclose(plan[0].ends(0.5), [0.25, 0.5, 0.75, 1.0])
    assert plan[0].control(0.5, None).target == 3.0
    ends = plan[1].ends(0.5)
    steps = np.diff(np.r_[0.0, ends]) * 500.0
    assert steps[0] == pytest.approx(0.5, rel=1e-6)
    assert ends[-1] == pytest.approx(1.0, rel=1e-12)
    assert np.ptp(steps[1:] / steps[:-1]) < 1e-6
    short = Stage(1.0, 4, lambda *_: goal, growing=True)
    assert np.allclose(short.ends(0.5), [0.25, 0.5, 0.75, 1.0])
