"""The closed loop of fluid: liquid kept, Boyle's law, closed forms, symmetry, extremes."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest
from scipy.optimize import fsolve

from tubefoot.twin.bench_settings import BenchSettings, BranchMake, FingerMake, PumpMake
from tubefoot.twin.finger_response import LinearFinger
from tubefoot.twin.hydraulics import NUCLEUS, Hydraulics
from tubefoot.units import ATMOSPHERE_MPA, KPA, ML

MEMORY = ((0.5, 0.1), (0.3, 1.0))


def settings(air=1.0, bubble=0.1, tube=1.9, back=0.0):
    return BenchSettings(
        branches=BranchMake(air_right_ml=air, air_left_ml=air, tube_kpa_s_per_ml=tube),
        finger=FingerMake(bubble_right_ml=bubble, bubble_left_ml=bubble),
        pump=PumpMake(leak_back_ul_per_s_kpa=back),
    )


def run(fluid, flows, step=1e-3):
    trace = []
    for flow in flows:
        fluid.step(step, flow)
        trace.append((*fluid.branch_pressure, *fluid.chamber_pressure, *fluid.column_levels))
    return np.array(trace)


def test_liquid_is_kept_to_rounding_whatever_happens():
    """A minute of random pumping with leaks, bursts, blocked tubes, open branches and a warming room."""
    fluid = Hydraulics(settings(back=0.05), LinearFinger(memory=MEMORY))
    chance = np.random.default_rng(3)
    moved = 0.0
    for block in range(600):
        flow = chance.uniform(-1500, 1500)
        right, left = fluid.sides
        right.leak = chance.choice([0.0, 500.0])
        left.resistance = chance.choice([1.9e-6, 1.0])
        left.held = 0.0 if block % 50 == 7 else None
        fluid.temperature = 1.0 + 0.01 * np.sin(block / 100)
        if block % 97 == 0:
            fluid.burst(int(chance.integers(2)), 0.3)
        for _ in range(100):
            fluid.step(1e-3, flow * (block % 3 == 0))
            moved += abs(flow) * 1e-3 * (block % 3 == 0)
    assert moved > 10 * ML
    assert sum(abs(side.lost) for side in fluid.sides) > 0.3 * ML
    assert abs(fluid.liquid_error) < 1e-10 * moved


def test_trapped_air_obeys_boyle_and_the_columns_move_in_opposite_directions():
    make = settings()
    fluid = Hydraulics(make, LinearFinger())
    trace = run(fluid, [800.0] * 1000)
    air = 1.0 * ML + NUCLEUS
    area = np.pi / 4 * make.branches.column_bore_mm**2
    for side in (0, 1):
        space = air - area * (trace[:, 4 + side] - make.branches.column_level_mm)
        np.testing.assert_allclose(
            (ATMOSPHERE_MPA + trace[:, side]) * space, ATMOSPHERE_MPA * air, rtol=1e-12
        )
    rise = np.diff(trace[:, 4:], axis=0)
    assert np.all(rise[:, 0] > 0)
    assert np.all(rise[:, 1] < 0)


def test_state_at_rest_is_the_closed_form():
    """Volume balance of both sides with Boyle's law and the linear finger, solved by other means."""
    c, m = 2e4, 1.5e4
    fluid = Hydraulics(settings(air=0.7, bubble=0.3), LinearFinger(compliance=c, partition=m))
    pumped = 900.0
    run(fluid, [pumped] * 1000 + [0.0] * 3000)

    def balance(p):
        gas = (0.7 * ML + 0.3 * ML + 2 * NUCLEUS) * p / (ATMOSPHERE_MPA + p)
        walls = np.array([(c + m) * p[0] - m * p[1], (c + m) * p[1] - m * p[0]])
        return walls + gas - np.array([pumped, -pumped])

    np.testing.assert_allclose(fluid.chamber_pressure, fsolve(balance, [0.02, -0.02]), rtol=1e-9)
    np.testing.assert_allclose(fluid.branch_pressure, fluid.chamber_pressure, rtol=1e-9)


def test_a_chamber_fills_through_its_tube_with_the_time_constant_of_both():
    """A small pressure held at both branches: the chambers follow 1 - exp(-t / R C) at small steps."""
    c, m, tube = 2e4, 1.5e4, 20.0
    fluid = Hydraulics(settings(bubble=0.0, tube=tube), LinearFinger(compliance=c, partition=m))
    fluid.sides[0].held, fluid.sides[1].held = 1e-6, 1e-6
    resistance = tube * KPA / ML
    # Equal pressures leave the partition alone: each chamber is a capacity c, and the nucleus of air in it.
    constant = resistance * (c + NUCLEUS / ATMOSPHERE_MPA)
    run(fluid, [0.0] * 8000, step=constant / 8000)
    assert fluid.chamber_pressure[0] == pytest.approx(1e-6 * (1 - exp(-1)), rel=2e-4)


def test_reversing_the_pump_mirrors_everything_without_valves():
    flows = np.concatenate([np.full(500, 1400.0), np.zeros(300), np.full(400, -900.0)])
    one, other = (Hydraulics(settings(back=0.02), LinearFinger(memory=MEMORY)) for _ in "ab")
    forward, reverse = run(one, flows), run(other, -flows)
    np.testing.assert_allclose(
        forward[:, [0, 1, 2, 3, 4, 5]], reverse[:, [1, 0, 3, 2, 5, 4]], rtol=1e-9, atol=1e-12
    )
    assert one.finger.bend == pytest.approx(-other.finger.bend, rel=1e-9)
    assert one.finger.bend != 0


def test_steps_converge_with_first_order():
    """Halving the step halves the error; 1 ms is within a per mille of the swing."""
    ends = {}
    for step in (4e-3, 2e-3, 1e-3, 1.25e-4):
        fluid = Hydraulics(settings(), LinearFinger(memory=MEMORY))
        run(fluid, [1200.0] * round(0.4 / step) + [0.0] * round(0.04 / step), step)
        ends[step] = fluid.branch_pressure[0]
    errors = [abs(ends[step] - ends[1.25e-4]) for step in (4e-3, 2e-3, 1e-3)]
    assert errors[0] / errors[1] == pytest.approx(2, abs=0.4)
    assert errors[2] < 1e-3 * ends[1.25e-4]


@pytest.mark.parametrize(("air", "bubble", "tube"), [(0, 0, 1.9), (50, 20, 0), (0, 20, 1000), (0.2, 0, 1e-3)])
def test_extremes_stay_finite_and_above_absolute_vacuum(air, bubble, tube):
    fluid = Hydraulics(settings(air, bubble, tube), LinearFinger(memory=MEMORY))
    chance = np.random.default_rng(1)
    trace = run(fluid, np.repeat(chance.uniform(-3000, 3000, 20), 100))
    assert np.all(np.isfinite(trace))
    assert trace[:, :4].min() > -ATMOSPHERE_MPA


def test_suction_ends_in_vapour_not_in_an_error():
    fluid = Hydraulics(settings(air=0.2, bubble=0.0), LinearFinger())
    run(fluid, [1500.0] * 10_000)
    assert -ATMOSPHERE_MPA < fluid.chamber_pressure[1] < -0.9 * ATMOSPHERE_MPA
    assert fluid.chamber_pressure[0] > 3 * ATMOSPHERE_MPA


def test_a_blocked_tube_leaves_the_chamber_alone():
    fluid = Hydraulics(settings(), LinearFinger())
    fluid.sides[0].resistance = 1e3
    run(fluid, [1000.0] * 300)
    assert fluid.branch_pressure[0] > 30 * KPA
    assert abs(fluid.chamber_pressure[0]) < 5 * KPA  # moved by the partition only
    assert fluid.chamber_volumes[0] == pytest.approx(0, abs=0.1)


def test_rollers_leak_back_at_the_stated_rate():
    fluid = Hydraulics(settings(air=50.0, back=0.5), LinearFinger())
    run(fluid, [1000.0] * 1000 + [0.0] * 500)
    before, difference = (
        fluid.sides[0].in_branch + fluid.sides[0].in_chamber,
        np.subtract(*fluid.branch_pressure),
    )
    run(fluid, [0.0] * 100)
    after = fluid.sides[0].in_branch + fluid.sides[0].in_chamber
    assert (before - after) / 0.1 == pytest.approx(0.5 / KPA * difference, rel=0.01)


def test_a_leak_loses_liquid_under_pressure_and_draws_air_under_suction():
    fluid = Hydraulics(settings(), LinearFinger())
    run(fluid, [1000.0] * 500)
    for side in fluid.sides:
        side.leak = 10_000.0
    air = fluid.sides[1].air
    run(fluid, [0.0] * 8000, step=5e-3)
    assert fluid.sides[0].lost > 100
    assert fluid.sides[1].air > air + 100
    assert abs(fluid.branch_pressure[0]) < 0.1 * KPA
    assert abs(fluid.branch_pressure[1]) < 0.1 * KPA


def test_warm_air_presses():
    """With the tubes shut, the column's pressure rises with the absolute temperature."""
    fluid = Hydraulics(settings(bubble=0.0), LinearFinger())
    for side in fluid.sides:
        side.resistance = 1e9
    fluid.temperature = 1.05
    run(fluid, [0.0] * 10)
    np.testing.assert_allclose(fluid.branch_pressure, 0.05 * ATMOSPHERE_MPA, rtol=1e-6)


def test_a_bubble_that_bursts_moves_its_air_into_the_column():
    fluid = Hydraulics(settings(bubble=0.5), LinearFinger())
    run(fluid, [500.0] * 1000 + [0.0] * 2000)
    before = fluid.sides[0].air + fluid.sides[0].bubble
    fluid.burst(0)
    assert fluid.sides[0].bubble == NUCLEUS
    assert fluid.sides[0].air + fluid.sides[0].bubble == pytest.approx(before, rel=1e-12)
    pressure = fluid.chamber_pressure[0]
    run(fluid, [0.0] * 2000)
    # The same air at the same pressure, only elsewhere: nothing else may change.
    assert fluid.branch_pressure[0] == pytest.approx(pressure, rel=1e-6)
    assert fluid.chamber_pressure[0] == pytest.approx(pressure, rel=1e-6)
