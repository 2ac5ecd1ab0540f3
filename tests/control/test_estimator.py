"""The estimator on made-up fingers that obey its law with other numbers: it learns them, and foresees."""

import numpy as np
import pytest
from tests.control.bends import reference_law

from tubefoot.control.contract import Measurement
from tubefoot.control.creep import MODE_TIMES_S
from tubefoot.control.estimator import BendEstimator
from tubefoot.units import DEG

FRAME_S = 1 / 30


def driven(gain, ratio, pulses, last_s, latency_s=0.05, sigma=0.02 * DEG):
    """Frames of a finger with another gain and ratio, as (measurement, true bend at all times)."""
    law, chance = reference_law(), np.random.default_rng(3)
    shares, _ = law.shares_at(float(np.log(ratio)))
    step = 1e-3
    modes, volume, times, bends, volumes = np.zeros(len(MODE_TIMES_S)), 0.0, [], [], []
    for n in range(round(last_s / step)):
        time = n * step
        flow = sum(f for begin, end, f in pulses if begin <= time < end)
        volume += flow * step
        modes = modes + step / MODE_TIMES_S * (shares * law.gain * gain * volume - modes)
        times.append(time + step)
        bends.append(modes.sum())
        volumes.append(volume)
    frames = []
    for seen_at in np.arange(0.1, last_s - latency_s, FRAME_S):
        now = seen_at + latency_s
        frames.append(
            Measurement(
                now,
                seen_at,
                float(np.interp(seen_at, times, bends) + sigma * chance.standard_normal()),
                sigma,
                (0.0, 0.0),
                float(np.interp(now, times, volumes)),
                now,
                int(any(begin <= now < end for begin, end, _ in pulses)),
            )
        )
    return law, frames, lambda time: float(np.interp(time, times, bends))


@pytest.mark.parametrize(("gain", "ratio"), [(0.7, 1.2), (1.0, 2.86), (1.5, 9.0)])
def test_learns_gain_and_creep_and_foresees_two_seconds(gain, ratio):
    law, frames, truth = driven(gain, ratio, [(0.5, 1.5, 500.0), (4.0, 4.1, -500.0)], 8.0)
    estimator = BendEstimator(law)
    for seen in frames:
        estimator.observe(seen)
        if abs(seen.time - 5.0) < FRAME_S / 2:
            ahead = estimator.forecast(seen).free(np.array([0.0, 1.0, 2.0]))
            at = seen.time
    errors = ahead - [truth(at), truth(at + 1.0), truth(at + 2.0)]
    assert np.abs(errors).max() < 0.25 * DEG
    now = truth(at + 2.0) - truth(at)
    assert abs(now) > 1.5 * abs(errors[2])  # it foresees a change, it does not repeat the present
    assert estimator.learnt["gain_forward"] == pytest.approx(gain, rel=0.2)


def test_latency_is_made_up_for():
    """In mid-stroke the forecast for now is far better than the newest frame."""
    law, frames, truth = driven(1.0, 2.86, [(0.5, 2.5, 500.0)], 3.0, latency_s=0.08)
    estimator = BendEstimator(law)
    repeated, foreseen = [], []
    for seen in frames:
        estimator.observe(seen)
        if 1.0 < seen.time < 2.4:
            repeated.append(abs(seen.bend - truth(seen.time)))
            foreseen.append(abs(float(estimator.forecast(seen).free(np.zeros(1))[0]) - truth(seen.time)))
    assert np.mean(repeated) > 0.5 * DEG
    assert np.mean(foreseen) < 0.2 * np.mean(repeated)


def test_forecast_of_a_pulse_is_what_the_pulse_does():
    law, frames, truth = driven(1.0, 2.86, [(0.5, 1.0, 500.0), (3.0, 3.4, 500.0)], 6.0)
    estimator = BendEstimator(law)
    for seen in frames:
        if seen.time > 2.99:
            break
        estimator.observe(seen)
        last = seen
    ahead = estimator.forecast(last)
    times = np.array([3.4, 4.0, 5.0]) - last.time
    shift = 3.0 - last.time
    angle = ahead.gain(1) * 200.0
    foreseen = ahead.free(times) + angle * ahead.step(times - shift, 0.4)
    np.testing.assert_allclose(foreseen, [truth(3.4), truth(4.0), truth(5.0)], atol=0.35 * DEG)
