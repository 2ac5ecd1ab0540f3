"""Walking through stations: landing, halving, giving up, stopping; with a model that fails on demand."""

import numpy as np
import pytest

from tubefoot.errors import ConvergenceError
from tubefoot.fea.items import State
from tubefoot.fea.path import Path
from tubefoot.fea.step import Step, StepFailed
from tubefoot.fea.waypoints import walk


class Stubborn:
    """Solves steps up to a length; the answer is the square of the parameter."""

    def __init__(self, longest, beyond=np.inf):
        self.longest, self.beyond, self.here, self.guesses = longest, beyond, 0.0, []

    def solve(self, guess, control):
        self.guesses.append(float(guess.unknowns[0]))
        if abs(control.target - self.here) > self.longest or control.target > self.beyond:
            raise StepFailed("too far")
        self.here = control.target
        return Step(state_at(control.target), 3, 0.0, 1.0, np.zeros(0))


def state_at(parameter):
    return State(np.array([parameter**2]), np.zeros(0), parameter)


def walked(model, stations, stride, observe=None):
    path = Path([Step(state_at(0.0), 0, 0.0, 1.0, np.zeros(0))])
    stop = walk(model, path, stations, stride, observe)
    return path, stop


def test_every_station_is_landed_on_by_even_steps():
    path, stop = walked(Stubborn(1.0), [1.0, 1.5], 0.4)
    assert stop is None
    parameters = [step.state.parameter for step in path.steps]
    assert parameters == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0, 1.25, 1.5])


def test_steps_begin_on_the_line_through_the_last_two_states():
    model = Stubborn(1.0)
    walked(model, [3.0], 1.0)
    assert model.guesses == pytest.approx([0.0, 2.0, 7.0])


def test_a_step_that_fails_is_halved_and_grows_again():
    path, _ = walked(Stubborn(0.3), [1.0], 1.0)
    lengths = np.diff([step.state.parameter for step in path.steps])
    assert lengths.max() <= 0.3
    assert path.failures
    assert path.steps[-1].state.parameter == pytest.approx(1.0)


def test_a_path_that_cannot_go_on_says_where_and_keeps_its_states():
    with pytest.raises(ConvergenceError, match=r"beyond parameter 0\.\d+: step to .* too far") as caught:
        walked(Stubborn(10.0, beyond=0.55), [1.0], 0.25)
    assert caught.value.last_state.steps[-1].state.parameter <= 0.55
    assert caught.value.last_state.steps[-1].state.parameter > 0.5


def test_a_text_of_the_observer_ends_the_path_before_the_step():
    path, stop = walked(
        Stubborn(1.0), [1.0], 0.25, lambda step, wall_s: "enough" if step.state.parameter > 0.6 else None
    )
    assert stop == "enough"
    assert path.steps[-1].state.parameter == pytest.approx(0.5)
