"""Calibrations find what the simulated bench was built with, within the uncertainty they state."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.calibration import fit_flow, fit_sag, fit_sensor, measure_pressures, measure_supply
from tubefoot.lab.pump import pumped_volume
from tubefoot.lab.settings import FlowSettings, PumpSettings, RigSettings, SensorSettings
from tubefoot.twin.bench_plant import BenchPlant
from tubefoot.twin.bench_settings import BenchSettings, SensorMake
from tubefoot.twin.board import LockstepPort, SimulatedBoard
from tubefoot.twin.simulated_operator import SimulatedOperator
from tubefoot.units import ML


def hush(text):
    pass


def pulses(flow, dead, lag, sigma=0.0, seed=0):
    noise = np.random.default_rng(seed)
    grid = [(duty, time) for duty in (0.1, 0.3, 0.5, 0.75, 1.0) for time in (0.1, 0.3, 1.0)]
    return [
        {
            "duty": duty,
            "duration_s": time,
            "volume_ml": max(0.0, flow * (duty - dead) / (1 - dead) * (time - lag)) + sigma * noise.normal(),
        }
        for duty, time in grid
    ]


def test_the_flow_law_is_recovered_exactly_without_noise():
    law, scatter = fit_flow(pulses(1.4, 0.17, 0.02))
    assert (law.flow_ml_per_s, law.dead_duty, law.lag_s) == pytest.approx((1.4, 0.17, 0.02), abs=1e-8)
    assert scatter < 1e-9


def test_the_stated_uncertainty_of_the_flow_is_that_of_repeated_calibrations():
    fits = [fit_flow(pulses(1.4, 0.17, 0.0, 0.01, seed))[0] for seed in range(200)]
    for value, sigma in (("flow_ml_per_s", "flow_sigma_ml_per_s"), ("dead_duty", "dead_duty_sigma")):
        spread = np.std([getattr(fit, value) for fit in fits])
        stated = np.mean([getattr(fit, sigma) for fit in fits])
        assert stated == pytest.approx(spread, rel=0.25)


def test_the_volume_of_a_pulse_has_the_uncertainty_of_its_law():
    law = FlowSettings(
        flow_ml_per_s=1.5,
        flow_sigma_ml_per_s=0.1,
        dead_duty=0.2,
        dead_duty_sigma=0.02,
        lag_s=0.01,
        lag_sigma_s=0.005,
    )
    noise = np.random.default_rng(0).standard_normal((3, 20_000))
    flow, dead, lag = 1.5 + 0.1 * noise[0], 0.2 + 0.02 * noise[1], 0.01 + 0.005 * noise[2]
    samples = flow * (0.6 - dead) / (1 - dead) * (0.4 - lag) * ML
    volume, sigma = pumped_volume(PumpSettings(reverse=law), -1, 0.6, 0.4)
    assert -volume == pytest.approx(samples.mean(), rel=0.01)
    assert sigma == pytest.approx(samples.std(), rel=0.05)


def test_pressure_calibration_finds_the_sensors_offsets():
    sensors = SensorMake(offset_right_v=0.05, offset_left_v=-0.03)
    plant = BenchPlant(BenchSettings(sensors=sensors))
    with SimulatedBoard(plant) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        rows = measure_pressures(rig, SimulatedOperator(plant), hush, steps=(-30.0, 0.0, 30.0))
    for branch, offset in (("right", 0.05), ("left", -0.03)):
        fitted, worst = fit_sensor([row for row in rows if row["branch"] == branch], SensorSettings())
        assert fitted.zero_fraction == pytest.approx(0.5 + offset / 5, abs=0.0012)  # 1 count
        assert fitted.span_kpa == pytest.approx(250, rel=0.01)
        assert worst < 0.5


def test_supply_calibration_finds_what_sags_and_corrects_it():
    """A sensor with its own regulator, read as if it were ratiometric, reads high while the supply sags."""
    plant = BenchPlant(
        BenchSettings(sensors=SensorMake(ratiometric=False, offset_right_v=0.0, offset_left_v=0.0))
    )
    with SimulatedBoard(plant) as board:
        rig = BoardRig(LockstepPort(board), RigSettings())
        rig.connect()
        rows = measure_supply(rig, SimulatedOperator(plant), hush)
    fitted, sigma = fit_sag(rows, "right", SensorSettings())
    # 2.5 V / V at 250 kPa a full scale: d p / d V = -250 x 0.5 / 5
    # The simulated converter has no noise, so the supply is read in steps of 22 mV over a sag of 200 mV.
    assert fitted.sag_kpa_per_v == pytest.approx(-25.0, abs=4.0)
    assert sigma < 1.0


def test_too_little_data_is_refused_with_what_to_do():
    with pytest.raises(ConfigError, match="take 3 or more"):
        fit_sensor([{"indicated_kpa": 0.0, "reference_kpa": 0.0}], SensorSettings())
    still = [{"indicated_kpa": 0.1 * k, "reference_kpa": 20.0 * k} for k in range(4)]
    with pytest.raises(ConfigError, match="is it tight"):
        fit_sensor(still, SensorSettings())
    with pytest.raises(ConfigError, match="in the pump head"):
        fit_flow([{"duty": 1.0, "duration_s": 1.0, "volume_ml": 0.0}] * 6)
