"""The compiled model of the benchmarks is the controller's own, but for rounding."""

import numpy as np
import pytest
from benchmarks.compiled_model import CompiledBenchModel

from tubefoot.control.bench_model import LAG, UNKNOWN, BenchModel
from tubefoot.control.crowd import MIDDLES, SPREADS
from tubefoot.reduced.files import reference_file


@pytest.mark.slow
def test_steps_are_the_same_but_for_rounding():
    reference = reference_file()
    finger, prony = reference.to_finger(), reference.to_prony()
    slow, fast = BenchModel(finger, prony), CompiledBenchModel(finger, prony)
    chance = np.random.default_rng(3)
    guesses = MIDDLES[:, None] + 0.7 * SPREADS[:, None] * chance.standard_normal((UNKNOWN, 12))
    one = other = slow.at_rest(guesses)
    assert np.exp(one[LAG]).std() > 0
    most = 0.0
    for duration, volume in [(0.033, 40.0)] * 24 + [(0.3, 0.0)] * 3 + [(0.04, -40.0)] * 4 + [(0.7, 0.0)] * 3:
        one, other = (
            model.step(state, duration, np.full(12, volume)) for model, state in ((slow, one), (fast, other))
        )
        most = max(most, np.abs(slow.bend(one) - fast.bend(other)).max())
        np.testing.assert_allclose(slow.branch_pressures(other), slow.branch_pressures(one), atol=1e-12)
    assert np.abs(slow.bend(one)).min() > 0.1
    assert most < 1e-10
