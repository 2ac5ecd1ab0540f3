"""The population of benches: fixed for ever, inside its table, each one able to run."""

from __future__ import annotations

import numpy as np
import pytest

from tubefoot.twin.bench import VirtualBench
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.population import (
    SPREADS,
    TUNING_SEEDS,
    VERDICT_SEEDS,
    drawn_bench,
    drawn_values,
    population_table,
    spread_table,
)
from tubefoot.units import DEG


def test_seeds_for_tuning_and_verdict_do_not_meet():
    assert len(set(VERDICT_SEEDS)) == 200
    assert not set(VERDICT_SEEDS) & set(TUNING_SEEDS)
    assert drawn_bench(1) != drawn_bench(1001)


def test_the_benches_never_change():
    """Numbers written down when the population was fixed: results stay comparable."""
    assert drawn_values(1)[:4] == [0.585086, 0.0484573, 0.512723, 0.15214]
    assert drawn_values(200)[0] == 0.440209
    assert drawn_bench(1) == drawn_bench(1)


def test_every_number_keeps_its_spread():
    table = population_table([*VERDICT_SEEDS, *TUNING_SEEDS])
    for spread in SPREADS:
        values = np.array([row[spread.key] for row in table])
        rounding = 1e-5 * abs(spread.high)
        assert values.min() >= spread.low - rounding
        assert values.max() <= spread.high + rounding
        low, high, middle = spread.low, spread.high, np.median(values)
        if spread.kind == "log":
            low, high, middle = np.log([low, high, middle])
        if spread.kind == "normal":
            assert middle == pytest.approx(spread.middle, abs=0.25 * spread.sigma)
        else:
            assert (middle - low) / (high - low) == pytest.approx(0.5, abs=0.12)


def test_the_table_tells_all_that_varies():
    default = BenchSettings().model_dump()
    for spread in SPREADS:
        table, key = spread.key.split(".")
        assert key in default[table]
        assert spread.why
    asked = ("stiffness", "seam", "bubble", "air_", "flow", "wear", "stiction", "latency", "drift")
    keys = " ".join(row["key"] for row in spread_table())
    assert all(word in keys for word in asked)


@pytest.mark.parametrize("seed", [2, 3, 1005])
def test_a_drawn_bench_bends_its_finger_and_comes_back(seed):
    with VirtualBench(drawn_bench(seed), seed, "native") as bench:
        bench.rig.connect()
        bench.rig.pulse(1, 0.7, 0.25)
        bench.rig.wait(0.8)
        bend = bench.truth().bend
        assert bend > 0.5 * DEG
        bench.rig.pulse(-1, 0.7, 0.25)
        bench.rig.wait(0.8)
        assert abs(bench.truth().bend) < 0.6 * bend
