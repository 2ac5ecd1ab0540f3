"""From finite element states to the law of a unit: linear least squares, and how far it is off.

With angles and pressures taken from the states, moments, volumes and strain energy are linear in the
coefficients of Psi: one weighted least-squares problem gives all laws at once. Each unit contributes its
moment, each state its two volumes and its energy (the sums over its units). A faint ridge settles what the
states leave open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.chain import FingerRange
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import UnitLaw, admissible_terms, derivatives_of_terms
from tubefoot.study.reduction_states import SolvedState
from tubefoot.units import DEG, KPA, ML

FloatArray = NDArray[np.float64]

Terms = tuple[tuple[int, int, int], ...]

INNER_CHOICES = (admissible_terms(6, 4), admissible_terms(5, 4), admissible_terms(4, 4))
"""Terms of a unit's energy, the richest first; the first that is stable over its range is taken."""
END_TERMS = admissible_terms(4, 4)
"""Of what an end adds."""

MOMENT_SHARE, VOLUME_SHARE, ENERGY_SHARE = 0.005, 0.002, 0.005
"""Error of each kind of equation that weighs the same, over the largest value of its kind."""
RIDGE = 1e-3
"""Weight of a coefficient's size, over the energy error that weighs the same."""


def fit_laws(
    states: Sequence[SolvedState], inner_terms: Terms = INNER_CHOICES[0]
) -> tuple[UnitLaw, UnitLaw, UnitLaw]:
    """The laws of a unit, and of what base and tip add.

    states : of fingers of at least two lengths; inner_terms : of a unit's energy

    Raises ConvergenceError when there are too few states.
    """
    sizes = [len(inner_terms), len(END_TERMS), len(END_TERMS)]
    scales = (
        MOMENT_SHARE * max(float(np.abs(state.found.moments).max()) for state in states),
        VOLUME_SHARE * max(float(np.abs(state.found.volumes).max()) for state in states),
        ENERGY_SHARE * max(state.found.energy for state in states),
    )
    blocks = [_equations(state, scales, inner_terms) for state in states]
    matrix = np.vstack([rows for rows, _ in blocks])
    wanted = np.concatenate([values for _, values in blocks])
    if len(wanted) < sum(sizes):
        raise ConvergenceError(
            f"{len(states)} states give {len(wanted)} equations for {sum(sizes)} coefficients; too "
            "many branches ended early: lower --pressure-kpa"
        )
    ridge = RIDGE / scales[2] * np.eye(sum(sizes))
    found = np.linalg.lstsq(np.vstack([matrix, ridge]), np.r_[wanted, np.zeros(sum(sizes))], rcond=None)[0]
    inner, base, tip = np.split(found, np.cumsum(sizes)[:-1])
    return (
        UnitLaw(inner_terms, tuple(inner.tolist())),
        UnitLaw(END_TERMS, tuple(base.tolist())),
        UnitLaw(END_TERMS, tuple(tip.tolist())),
    )


def _equations(
    state: SolvedState, scales: tuple[float, float, float], inner_terms: Terms
) -> tuple[FloatArray, FloatArray]:
    """Rows and right sides of one state: its moments, volumes, energy, each over its scale."""
    found = state.found
    n, n_inner, n_end = len(found.angles), len(inner_terms), len(END_TERMS)
    moments = np.zeros((n, n_inner + 2 * n_end))
    volumes, energy = np.zeros((2, n_inner + 2 * n_end)), np.zeros(n_inner + 2 * n_end)
    for unit in range(n):
        parts = [(0, inner_terms)]
        parts += [(n_inner, END_TERMS)] if unit == 0 else []
        parts += [(n_inner + n_end, END_TERMS)] if unit == n - 1 else []
        for first, terms in parts:
            columns = slice(first, first + len(terms))
            psi, moment, volume = derivatives_of_terms(terms, found.angles[unit], found.pressures)
            moments[unit, columns] += moment
            volumes[:, columns] += volume
            energy[columns] += psi + found.pressures @ volume
    of_moment, of_volume, of_energy = scales
    rows = np.vstack([moments / of_moment, volumes / of_volume, energy / of_energy])
    return rows, np.r_[found.moments / of_moment, found.volumes / of_volume, found.energy / of_energy]


def fit_shear(states: Sequence[SolvedState]) -> float:
    """Sideways shift of an inner unit's upper end by shear force [mm/N], least squares.

    states : of the fit; zero where none bears a force
    """
    shears = np.concatenate([state.found.shears[1:-1] for state in states])
    slips = np.concatenate([state.found.slips[1:-1] for state in states])
    carried = float(shears @ shears)
    return max(0.0, float(shears @ slips) / carried) if carried > 0.0 else 0.0


def identified_range(states: Sequence[SolvedState]) -> FingerRange:
    """The range that states cover, by mirror symmetry the same for both chambers.

    states : of the fit
    """
    angles = max(float(np.abs(state.found.angles).max()) for state in states)
    pressures = np.concatenate([state.found.pressures for state in states])
    return FingerRange(angles, float(pressures.min()), float(pressures.max()))


@dataclass(frozen=True)
class StateError:
    """How far the reduced finger is off at one state, asked for by its volumes and moments.

    bend_deg, unit_deg : of the tip, the worst unit; pressure_kpa : the worst chamber
    volume_ml : the worst chamber, at the state's angles and pressures
    """

    state: SolvedState
    bend_deg: float
    unit_deg: float
    pressure_kpa: float
    volume_ml: float


def state_error(finger: ReducedFinger, state: SolvedState) -> StateError:
    """How far a reduced finger is off at a state.

    finger : with as many units as the state; state : solved by finite elements
    """
    found = state.found
    mine = finger.equilibrium(found.volumes, moments=found.moments)
    volumes = finger.respond(found.angles, found.pressures).volumes
    return StateError(
        state,
        (mine.bend - found.bend) / DEG,
        float(np.abs(mine.angles - found.angles).max()) / DEG,
        float(np.abs(mine.pressures - found.pressures).max()) / KPA,
        float(np.abs(volumes - found.volumes).max()) / ML,
    )


def summarise(errors: Sequence[StateError]) -> dict[str, float]:
    """Root mean square and largest error of each kind.

    errors : of some states
    """
    table: dict[str, float] = {"states": float(len(errors))}
    for name in ("bend_deg", "unit_deg", "pressure_kpa", "volume_ml"):
        values = np.abs([getattr(error, name) for error in errors])
        table |= {f"{name}_rms": float(np.sqrt((values**2).mean())), f"{name}_max": float(values.max())}
    return table


def softest(finger: ReducedFinger, steps: int = 9) -> tuple[float, float]:
    """Smallest stiffness and smallest compliance over the range, each over its value at rest.

    finger : reduced; steps : of each variable's grid

    Both above zero mean that each state has one equilibrium.
    """
    valid, n = finger.valid, finger.n_units
    pressures = np.linspace(valid.pressure_low, valid.pressure_high, steps)
    angles = np.linspace(-valid.angle, valid.angle, steps)
    rest = finger.respond(np.zeros(n), np.zeros(2))
    rest_compliance = np.linalg.eigvalsh(rest.compliance)[0]
    stiffness, compliance = np.inf, np.inf
    for right in pressures:
        for left in pressures:
            for angle in angles:
                found = finger.respond(np.full(n, angle), np.array([right, left]))
                stiffness = min(stiffness, float((found.stiffness / rest.stiffness).min()))
                compliance = min(compliance, float(np.linalg.eigvalsh(found.compliance)[0] / rest_compliance))
    return stiffness, compliance
