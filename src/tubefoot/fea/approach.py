"""Newton's method far from equilibrium: each point of the solids with a strain of its own (`mixed_point`).

A thin wall that turns does not seem to stretch then, so a step may go as far as the bending allows. Every
iteration factorises. It ends near equilibrium, where the strains are those of the displacements
but for terms of higher order, and `newton` goes on with the usual method to the exact state.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tubefoot.fea.drive import Control
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.predictor import Blend, straight
from tubefoot.fea.step import StepFailed

if TYPE_CHECKING:
    from tubefoot.fea.equilibrium import Model

NEAR = 1e4
"""Error over the tolerance below which equilibrium is near."""
MOST = 16
"""Iterations after which the approach is given up."""
STALLED = 3
"""Iterations without a new smallest error after which it is."""
TRIALS = (1.0, 0.5, 0.25)
"""Lengths of one iteration's step that are tried."""
SHARES = (1.0, 0.5, 0.25, 0.125, 0.0)
"""How far from the last state to the guess it begins: the first that is admitted."""


def approach(
    model: Model, guess: State, control: Control, blend: Blend | None = None, last: State | None = None
) -> State:
    """A state near equilibrium; contacts are paired there.

    model : what is solved; guess : where the iterations start; control : which quantity ends at which value
    blend : states whose strains add up to those to expect at the guess (`predictor.blend`), those of the
        guess if not given; last : a state nearer to which they start where walls cross at the guess

    Raises StepFailed when none is found.
    """
    history: list[float] = []
    try:
        state, found = _begun(model, guess, blend or [(1.0, guess.unknowns)], last)
        for _ in range(MOST):
            borders = model.borders(state, control)
            history.append(model.error(state, found, borders))
            if history[-1] < NEAR:
                return state
            later = history[1:]
            if later and len(later) - 1 - int(np.argmin(later)) >= STALLED:
                break
            model.evaluate(state)
            model.factorise(borders)
            step, _ = model.newton_step(state, borders)
            state, found = _advanced(model, state, step)
    finally:
        for solid in model.solids:
            solid.bind()
    raise StepFailed(f"residual stays at {min(history):.1e} to {max(history):.1e} times the tolerance")


def _begun(model: Model, guess: State, blend: Blend, last: State | None) -> tuple[State, Evaluation]:
    """The guess, or a state on the way to it where walls do not cross, and what is found there."""
    for share in SHARES if last is not None else SHARES[:1]:
        state = guess if last is None else _between(last, guess, share)
        strains = [(share * part, unknowns) for part, unknowns in blend]
        if last is not None:
            strains.append((1.0 - share, last.unknowns))
        for solid in model.solids:
            solid.blend(strains, state.unknowns)
        if model.tears_air(state):
            continue
        model.pair(state)
        found = model.evaluate(state, stiff=False)
        if model.tolerance.admits(found):
            return state, found
    raise StepFailed("walls cross or an air column is torn apart at the guess")


def _between(start: State, end: State, share: float) -> State:
    return State(
        start.unknowns + share * (end.unknowns - start.unknowns),
        start.pressures + share * (end.pressures - start.pressures),
        start.parameter + share * (end.parameter - start.parameter),
    )


def _advanced(model: Model, state: State, step: State) -> tuple[State, Evaluation]:
    """The state after a step, shortened until it is admitted; strains change as they do to first order.

    Raises StepFailed when no length tried is short enough.
    """
    choices, strains = model.choices(), [solid.strains for solid in model.solids]
    end = State(
        state.unknowns + step.unknowns, state.pressures + step.pressures, state.parameter + step.parameter
    )
    whole = straight(state.unknowns, end.unknowns)
    for share in TRIALS:
        trial = _between(state, end, share)
        if not model.tears_air(trial):
            model.pair(trial)
            for solid, own in zip(model.solids, strains, strict=True):
                changed = [(share * part, unknowns) for part, unknowns in whole]
                solid.blend(changed, trial.unknowns, (1.0 - share) * own)
            found = model.evaluate(trial, stiff=False)
            if model.tolerance.admits(found):
                return trial, found
            model.choose(choices)
    raise StepFailed("walls cross or an air column is torn apart, however short the step")
