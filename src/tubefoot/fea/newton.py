"""Newton's method with borders: from a guess to the equilibrium that a control asks for, or a quick refusal.

The tangent is assembled and factorised where the last factors no longer bring the residual down fast; chord
iterations in between cost a residual and a substitution. Far from equilibrium the method may wander, at the
price of a factorisation an iteration: it is given up when the residual has not come below its smallest for
some iterations. Who asked tries a shorter step, or lets the structure come to rest (`pseudo_time`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tubefoot.fea.drive import Control
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.step import Step, StepFailed

if TYPE_CHECKING:
    from tubefoot.fea.equilibrium import Model

CHORD = 0.05
"""Largest share of the error that an iteration may leave for its factors to be used once more."""
CHORD_FROM = 1e4
"""Error over the tolerance above which they are not: far from equilibrium a share says little."""
STALLED = 3
"""Iterations without a new smallest error after which a step is given up."""
TRIALS = 3
"""Lengths of one iteration's step that are tried, each half of the one before."""


def converge(model: Model, guess: State, control: Control) -> Step:
    """The converged step by Newton's iterations.

    model : what is solved; guess : where they start; control : which quantity ends at which value

    Raises StepFailed when they do not converge, invert, or leave the range of the physics.
    """
    state, tolerance = guess.copy(), model.tolerance
    found = admitted(model, state)
    history: list[float] = []
    tangent = None
    for iteration in range(tolerance.iterations + 1):
        borders = model.borders(state, control)
        error = model.error(state, found, borders)
        history.append(error)
        if error < 1.0 and model.pair(state):
            found = model.evaluate(state, stiff=False)
            borders = model.borders(state, control)
            error = model.error(state, found, borders)
            # With other partners it is another problem, whose residual may well be larger.
            history = [error]
        if error < 1.0:
            return converged(model, state, found, iteration, history, tangent)
        _require_progress(iteration, history)
        if iteration == tolerance.iterations:
            break
        near = len(history) > 1 and error < min(CHORD * history[-2], CHORD_FROM)
        if not (near and model.factorised):
            if not model.system.stiff:
                found = model.evaluate(state)
            model.factorise(borders)
        step, tangent = model.newton_step(state, borders)
        state, found = advanced(model, state, step)
    raise StepFailed(f"no convergence in {tolerance.iterations} iterations, residual {history[-1]:.1e}")


def converged(
    model: Model,
    state: State,
    found: Evaluation,
    iterations: int,
    history: list[float],
    tangent: State | None = None,
) -> Step:
    """The step that ends at a state of equilibrium at which the model was evaluated last.

    model : what was solved; state : where; found : there; iterations, history : how it went
    tangent : the path's direction per unit of the control
    """
    return Step(
        state,
        iterations,
        found.energy,
        found.min_jacobian,
        np.array([cavity.volume for cavity in model.cavities]),
        history,
        model.unstable,
        tangent,
        found.min_gap,
    )


def admitted(model: Model, state: State) -> Evaluation:
    """What is found at a state from which iterations may start, contacts paired there.

    model : what is solved; state : where

    Raises StepFailed when it is none.
    """
    if model.tears_air(state):
        raise StepFailed("the pressure of an air column is at absolute vacuum")
    model.pair(state)
    found = model.evaluate(state, stiff=False)
    if not model.tolerance.admits(found):
        raise StepFailed(model.tolerance.complaint(found))
    return found


def advanced(model: Model, state: State, step: State) -> tuple[State, Evaluation]:
    """The state after a step, shortened until it is admitted and no air column is torn apart.

    model : what is solved; state : before; step : the change

    Raises StepFailed, contacts as they were, when no length tried is short enough.
    """
    fraction, choices = 1.0, model.choices()
    for _ in range(TRIALS):
        trial = State(
            state.unknowns + fraction * step.unknowns,
            state.pressures + fraction * step.pressures,
            state.parameter + fraction * step.parameter,
        )
        if not model.tears_air(trial):
            model.pair(trial)
            found = model.evaluate(trial, stiff=False)
            if model.tolerance.admits(found):
                return trial, found
            model.choose(choices)
        fraction *= 0.5
    raise StepFailed("a cell inverts, walls cross or an air column is torn apart, however short the step")


def _require_progress(iteration: int, history: list[float]) -> None:
    """Give up a step whose residual grows or stays; the first one, of the guess, may be a lucky one."""
    error = history[-1]
    if iteration >= 4 and error > 1e3 * min(history):
        raise StepFailed(f"residual grew to {error:.1e} times the tolerance")
    later = history[1:]
    if later and len(later) - 1 - int(np.argmin(later)) >= STALLED:
        raise StepFailed(f"residual stays at {min(later):.1e} to {max(later):.1e} times the tolerance")
