"""The search against closed forms, SciPy, bounds and starts without residuals."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import least_squares

from tubefoot.errors import ConvergenceError
from tubefoot.validation.search import search


@dataclass
class Valley:
    """Rosenbrock's curved valley with its least at (1, 1), within bounds."""

    low: np.ndarray = field(default_factory=lambda: np.array([-3.0, -3.0]))
    high: np.ndarray = field(default_factory=lambda: np.array([3.0, 3.0]))
    spread: np.ndarray = field(default_factory=lambda: np.ones(2))
    forbidden: float = np.inf

    def all_residuals(self, x):
        if x[1] > self.forbidden:
            raise ConvergenceError("no balance there")
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    def jacobian(self, x):
        return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


def test_the_least_of_a_curved_valley_is_found():
    found = search(Valley(), np.array([-1.2, 1.0]), 1e-10, 60)
    assert found.converged
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-4)


def test_within_bounds_it_ends_where_scipy_does():
    valley = Valley(high=np.array([0.5, 3.0]))
    found = search(valley, np.array([-1.2, 1.0]), 1e-12, 60)
    other = least_squares(valley.all_residuals, [-1.2, 1.0], valley.jacobian, (valley.low, valley.high))
    assert found.x[0] == 0.5
    assert found.x == pytest.approx(other.x, abs=1e-3)


def test_steps_to_where_there_is_no_balance_are_shortened():
    found = search(Valley(forbidden=1.5), np.array([-1.2, 1.0]), 1e-10, 60)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-4)
    with pytest.raises(ConvergenceError):
        search(Valley(forbidden=0.5), np.array([-1.2, 1.0]))


def test_a_search_that_was_cut_short_says_so():
    assert not search(Valley(), np.array([-1.2, 1.0]), 1e-10, 2).converged
