"""Where a path may end, and how it lands there: limits that the extrapolated path meets, or has passed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.predictor import weights
from tubefoot.fea.step import Step

OVERSHOOT = 0.02
"""Share of a step by which a limit may lie beyond its end and still be landed on with it."""


@dataclass(frozen=True)
class Limit:
    """A value at which the path ends, and what that means.

    control : the quantity and its value; reason : what to report when it is reached
    """

    control: Control
    reason: str


def value_of(model: Model, control: Control, step: Step) -> float:
    """Value of a control's quantity at a converged step.

    model : the model solved; control : names the quantity; step : where
    """
    if control.quantity == "parameter":
        return step.state.parameter
    if control.quantity == "pressure":
        return float(step.state.pressures[control.cavity])
    if control.quantity == "volume_change":
        return float(step.volumes[control.cavity] - model.rest_volumes[control.cavity])
    assert control.measure is not None
    return control.measure(step.state.unknowns)[0]


def next_target(
    model: Model, steps: Sequence[Step], stride: float, limits: Sequence[Limit]
) -> tuple[float, Limit | None]:
    """Parameter of the next state, and the limit to land on if one lies within the step.

    model : what is solved; steps : the last ones, without a jump; stride : in the parameter
    limits : where the path may end
    """
    here = steps[-1].state.parameter
    crossings = [
        (abs(at - here), at, k)
        for k, limit in enumerate(limits)
        if (at := _crossing(model, limit.control, steps, stride)) is not None
    ]
    if not crossings:
        return here + stride, None
    _, target, nearest = min(crossings)
    return target, limits[nearest]


def passed(model: Model, limits: Sequence[Limit], before: Step, after: Step) -> tuple[Limit, float] | None:
    """The first limit that lies between two states, and about where.

    A state on a limit, up to roundoff, has reached it; one that begins there has not.

    model : what is solved; limits : where the path may end; before, after : the states
    """
    found = []
    for number, limit in enumerate(limits):
        a, b = (value_of(model, limit.control, step) - limit.control.target for step in (before, after))
        roundoff = 1e-10 * abs(limit.control.target)
        if abs(a) > roundoff and (a * b < 0.0 or abs(b) <= roundoff):
            found.append((a / (a - b), number))
    if not found:
        return None
    share, number = min(found)
    start, end = before.state.parameter, after.state.parameter
    return limits[number], start + share * (end - start)


def _crossing(model: Model, control: Control, steps: Sequence[Step], stride: float) -> float | None:
    """Parameter within the next step at which the extrapolated quantity meets its value."""
    here = steps[-1].state.parameter
    reach = here + (1 + OVERSHOOT) * stride
    if control.quantity == "parameter":
        inside = min(here, reach) <= control.target <= max(here, reach)
        return control.target if inside else None
    now = value_of(model, control, steps[-1])
    if len(steps) == 1:
        return None
    fractions = np.linspace(0.0, 1.0, 41)
    values = [
        _extrapolated(model, control, steps, here + f * (reach - here)) - control.target for f in fractions
    ]
    values[0] = now - control.target
    for k in range(40):
        if values[k] != 0.0 and values[k] * values[k + 1] <= 0.0:
            share = values[k] / (values[k] - values[k + 1])
            return float(here + (fractions[k] + share * (fractions[k + 1] - fractions[k])) * (reach - here))
    return None


def _extrapolated(model: Model, control: Control, steps: Sequence[Step], parameter: float) -> float:
    recent = steps[-3:]
    shares = weights([step.state.parameter for step in recent], parameter)
    return float(sum(w * value_of(model, control, s) for w, s in zip(shares, recent, strict=True)))
