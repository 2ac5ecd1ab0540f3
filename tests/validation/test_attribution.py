"""Shares add up to the offset, a cause alone counts all; scatter of benches; what to measure next."""

from dataclasses import replace

import numpy as np
import pytest
from tests.validation.lean_records import CONTENT, known_values, made_record

from tubefoot.errors import ConvergenceError
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.units import KPA
from tubefoot.validation.attribution import CAUSES, QUANTITIES, attribute, state_at, values_of
from tubefoot.validation.bench_fit import fit_bench
from tubefoot.validation.bench_parameters import NAMES
from tubefoot.validation.decisive import MEASUREMENTS, decisive_rows
from tubefoot.validation.fit_problem import FitProblem
from tubefoot.validation.lean_bench import LeanBench
from tubefoot.validation.sensitivity import sobol_rows
from tubefoot.validation.windows import observe

FINGER, RELAXATION = CONTENT.to_finger().with_units(3), CONTENT.to_prony()
BENCH = LeanBench(FINGER)
IDEAL = {key: value for off in CAUSES.values() for key, value in off.items()}


def test_shares_add_up_to_the_offset():
    found = attribute(known_values(), BENCH, RELAXATION)
    for quantity in QUANTITIES:
        assert sum(found.shapley[quantity].values()) == pytest.approx(found.offset(quantity), abs=1e-9)
    assert found.offset("bend_deg") < 0 < found.offset("pressure_left_kpa")  # the paper's signs (C9)


def test_the_ideal_bench_has_no_offset():
    found = attribute(known_values() | IDEAL, BENCH, RELAXATION)
    assert found.offset("bend_deg") == 0.0
    assert all(share == 0.0 for share in found.shapley["bend_deg"].values())


@pytest.mark.parametrize(
    ("cause", "values"),
    [("seam", {"seam": 0.5}), ("air columns", {"air_right_ml": 1.0, "air_left_ml": 1.0})],
)
def test_one_cause_alone_is_all_of_it(cause, values):
    found = attribute(known_values() | IDEAL | values, BENCH, RELAXATION)
    for quantity in QUANTITIES:
        for table in (found.first, found.last, found.shapley):
            assert table[quantity][cause] == pytest.approx(found.offset(quantity), abs=1e-9)
    assert found.main_cause("bend_deg") == cause


def test_the_ideal_state_is_that_of_the_reduced_finger():
    found = attribute(known_values(), LeanBench(FINGER, np.pi / 2), RELAXATION)  # no weight in the plane
    rest = FINGER.free_bending(np.array([found.top, found.ideal[1] * KPA]))
    assert np.degrees(rest.bend) == pytest.approx(found.ideal[0], rel=1e-3)
    # What one chamber takes the other gives [mm^3].
    assert rest.volumes.sum() == pytest.approx(0.0, abs=3.0)


def test_the_nominal_bench_is_ruled_by_creep_and_air():
    found = attribute(values_of(BenchSettings()), BENCH, RELAXATION)
    assert found.main_cause("bend_deg") == "relaxation"
    assert found.main_cause("pressure_left_kpa") == "air columns"


def test_a_pressure_out_of_reach_is_said():
    leaking = known_values(leak_back_ul_per_s_kpa=8.0)
    with pytest.raises(ConvergenceError, match="bring the right branch to"):
        state_at(leaking, BENCH, RELAXATION, 30 * KPA)


def test_scatter_of_the_angle_comes_from_the_print_and_none_from_the_tube():
    rows = sobol_rows(BENCH, RELAXATION, samples=16, seed=1)
    total = {row["unknown"]: row["total"] for row in rows if row["quantity"] == "bend_deg"}
    assert max(total, key=total.get) == "scale"
    assert abs(total["tube_kpa_s_per_ml"]) < 0.02
    assert {row["quantity"] for row in rows} == set(QUANTITIES)


def test_a_measurement_of_bubbles_is_of_one_finger():
    values = known_values()
    free = ("scale", "seam", "bubble_right_ml")
    known = {name: values[name] for name in NAMES if name not in free}
    seen = [replace(observe(made_record(values, seed=seed)), name=f"finger {seed}") for seed in (0, 1)]
    problem = FitProblem(CONTENT.to_finger(), RELAXATION, seen, known)
    fit = fit_bench(problem)
    rows = {row["measurement"]: row for row in decisive_rows(problem, fit)}
    information = np.linalg.inv(fit.covariance)
    information[2, 2] += 0.005**-2
    expected = np.sqrt(np.linalg.inv(information)[1, 1])
    assert rows["finger filled under vacuum, bubbles below 0.01 ml"]["seam_sigma"] == pytest.approx(expected)


def test_a_further_measurement_narrows_what_it_measures():
    values = known_values()
    free = ("scale", "seam", "relaxation_strength", "air_right_ml")
    known = {name: values[name] for name in NAMES if name not in free}
    problem = FitProblem(CONTENT.to_finger(), RELAXATION, [observe(made_record(values))], known)
    rows = {row["measurement"]: row for row in decisive_rows(problem, fit_bench(problem))}
    alone = rows["recordings alone"]
    assert set(rows) == {"recordings alone", *MEASUREMENTS}
    coupon = rows["tensile coupon printed beside the finger, modulus to 3 %"]
    expected = (alone["scale_sigma"] ** -2 + 0.03**-2) ** -0.5
    assert coupon["scale_sigma"] == pytest.approx(expected, rel=1e-6)
    assert all(row["seam_sigma"] <= alone["seam_sigma"] * (1 + 1e-9) for row in rows.values())
