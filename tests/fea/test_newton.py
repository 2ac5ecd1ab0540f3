"""When Newton's method goes on and when it gives up, on a model whose errors are given."""

from types import SimpleNamespace

import numpy as np
import pytest

from tubefoot.fea.drive import Control
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.newton import converge
from tubefoot.fea.step import StepFailed, Tolerance

STILL = Control("parameter", 0.0)


class Told:
    """A model of one unknown whose error after each iteration is given; a trial beyond `wall` is refused."""

    cavities: tuple = ()
    unstable = 0

    def __init__(self, errors, wall=np.inf, way=1.0):
        self.errors, self.wall, self.way = list(errors), wall, way
        self.tolerance, self.system = Tolerance(), SimpleNamespace(stiff=False)
        self.factorised, self.factorisations, self.tried = False, 0, []

    def tears_air(self, state):
        return False

    def pair(self, state):
        return False

    def choices(self):
        return []

    def choose(self, choices):
        assert choices == []

    def evaluate(self, state, stiff=True):
        self.tried.append(float(state.unknowns[0]))
        return Evaluation(min_jacobian=1.0 if state.unknowns[0] < self.wall else -1.0)

    def borders(self, state, control):
        return None

    def error(self, state, found, borders):
        return self.errors.pop(0)

    def factorise(self, borders):
        self.factorised = True
        self.factorisations += 1

    def newton_step(self, state, borders):
        return State(np.array([self.way]), np.zeros(0), 0.0), None


def solved(model):
    return converge(model, State(np.zeros(1), np.zeros(0), 0.0), STILL)


def test_a_residual_that_stays_is_given_up_after_three_iterations():
    model = Told([1e6, 5e6, 6e6, 7e6, 6e6, 5.5e6, 0.5])
    with pytest.raises(StepFailed, match="stays"):
        solved(model)
    assert model.factorisations == 4


def test_a_guess_that_was_luckier_than_what_follows_is_no_reason():
    model = Told([1e4, 5e6, 4e6, 2e6, 1e6, 3e5, 2e5, 0.5])
    assert solved(model).iterations == 7


def test_good_factors_serve_once_more():
    model = Told([1e6, 5e3, 2e2, 0.5])
    solved(model)
    assert model.factorisations == 1


def test_a_refused_step_is_halved_twice_at_most():
    near = Told([1e6, 0.5], wall=0.3)
    assert solved(near).state.unknowns == pytest.approx(0.25)
    far = Told([1e6, 0.5], wall=0.2)
    with pytest.raises(StepFailed, match="however short"):
        solved(far)
    assert far.tried[-3:] == pytest.approx([1.0, 0.5, 0.25])
