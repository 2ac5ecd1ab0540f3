"""Prony terms by least squares: a known series comes back; the shipped one follows from the shipped data."""

import csv
from importlib.resources import files

import numpy as np
import pytest

from tubefoot.design.material import OgdenMaterial
from tubefoot.errors import ConfigError
from tubefoot.study.prony import fit_prony


def test_a_known_series_comes_back():
    times, moduli, long_term = np.array([0.1, 1.0, 10.0]), np.array([3.0, 0.0, 0.5]), 0.8
    frequency = np.logspace(-3, 2, 30)
    x = 2 * np.pi * frequency[:, None] * times
    storage = long_term + (x**2 / (1 + x**2)) @ moduli
    loss = (x / (1 + x**2)) @ moduli
    found = fit_prony(frequency, storage, loss, times)
    assert found.moduli == pytest.approx(moduli, abs=1e-9)
    assert found.long_term == pytest.approx(long_term, abs=1e-9)
    assert found.misfit < 1e-12
    assert found.relaxation_modulus([0.0, 1e9]) == pytest.approx([4.3, 0.8])


def test_the_shipped_terms_follow_from_the_shipped_test():
    text = (files("tubefoot.design") / "data" / "agilus30_dma_20C.csv").read_text()
    rows = list(csv.DictReader(text.splitlines()))
    data = [
        [float(row[key]) for row in rows]
        for key in ("frequency_hz", "storage_modulus_mpa", "loss_modulus_mpa")
    ]
    fit = fit_prony(*data, 10.0 ** np.arange(-9, 3.01, 0.5))
    assert fit.misfit < 0.004
    assert (fit.moduli >= 0).all()
    body = OgdenMaterial()
    slow = fit.times > 0.09
    assert fit.times[slow] == pytest.approx(body.relaxation_time_s, rel=2e-3)
    shares = fit.moduli[slow] / fit.long_term
    assert shares == pytest.approx(body.relaxation_share, rel=0.04)
    assert shares.sum() == pytest.approx(sum(body.relaxation_share), rel=0.02)


@pytest.mark.parametrize(
    ("data", "words"),
    [(([1.0, 2.0], [1.0], [1.0]), "as many"), (([1.0], [-1.0], [1.0]), "positive")],
)
def test_bad_data_are_refused(data, words):
    with pytest.raises(ConfigError, match=words):
        fit_prony(*data, [1.0])
