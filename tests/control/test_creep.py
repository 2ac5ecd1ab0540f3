"""The creep law against time-stepped equations, and against the reduced finger's own gain."""

import numpy as np
import pytest
from tests.control.bends import reference_law

from tubefoot.control.creep import LAG_S, MODE_TIMES_S, creep_law
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.relaxation import NO_RELAXATION
from tubefoot.units import ATMOSPHERE_MPA


def stepped(ratio, prony, last_s, step=2e-3):
    """Relaxed-angle share over time, by small steps of q = c p_e + a G * p_e behind the lag."""
    strengths, taus = np.array(prony.strengths), np.array(prony.times_s)
    filled, hidden, answer = 0.0, np.zeros(len(taus)), []
    for _ in range(round(last_s / step)):
        filled += step / LAG_S * (1.0 - filled)
        equilibrium = (filled + strengths @ hidden) / (ratio + 1.0 + strengths.sum())
        hidden += step / taus * (equilibrium - hidden)
        answer.append((ratio + 1.0) * equilibrium)
    return step * np.arange(1, len(answer) + 1), np.array(answer)


@pytest.mark.parametrize("ratio", [0.6, 2.86, 15.0])
def test_modes_reproduce_the_wall_and_its_air(ratio):
    law, prony = reference_law(), reference_file().to_prony()
    times, exact = stepped(ratio, prony, 20.0)
    shares, _ = law.shares_at(float(np.log(ratio)))
    modes = (1 - np.exp(-times[:, None] / MODE_TIMES_S)) @ shares
    late = times > 0.15
    assert np.abs(modes[late] / exact[late] - 1).max() < 0.02  # fit 1 %, steps 0.5 %


def test_gain_is_that_of_the_reduced_finger():
    """A small pumped volume, fully relaxed, bends by gain x volume."""
    reference = reference_file()
    law = creep_law(reference.to_finger(), reference.to_prony(), air_ml=1.0)
    state = reference.to_finger().equilibrium(np.array([5.0, -5.0]), (1000.0, 1000.0))
    assert state.bend == pytest.approx(5.0 * law.gain, rel=0.01)
    softness = law.gain * 1000.0 / ATMOSPHERE_MPA * (1.0 + law.ratio)
    assert state.bend == pytest.approx(softness * (state.pressures[0] - state.pressures[1]) / 2, rel=0.01)


def test_shares_are_smooth_and_sum_to_about_one():
    law = reference_law()
    for log_ratio in np.linspace(-1.5, 4.0, 30):
        shares, slope = law.shares_at(float(log_ratio))
        assert 0.75 < shares.sum() < 1.02
        near = law.shares_at(float(log_ratio) + 1e-4)[0]
        np.testing.assert_allclose((near - shares) / 1e-4, slope, atol=0.05)


def test_an_elastic_wall_does_not_creep():
    law = creep_law(reference_file().to_finger(), NO_RELAXATION)
    shares, _ = law.shares_at(float(np.log(law.ratio)))
    assert shares[0] > 0.9
