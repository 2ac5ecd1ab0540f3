"""How a finger's angle follows the pumped volume in time: relaxation modes from the reduced model.

Linearised about rest, the pump's volume q stretches the chambers by c p_e (p_e the pressure that the relaxed
wall would need) and compresses the branch's air by a p; the wall's memory ties them, p = G(t) * p_e:

    q = c p_e + a G * p_e,     bend = b p_e

so the angle creeps after every pulse: at first most of the volume hides in the air. The shape of this creep
depends on one number, the ratio k = c / a of chamber to air compliance (a soft print, or little air: large),
its height on another, the gain. Both are unknown for a given print and are learnt on line (`estimator.py`).
The exact response has one mode for each Prony term; six modes at fixed times, fitted in least squares,
reproduce it from 0.1 to 60 s within 1 %. The lag of pump and tube, about 0.1 s, is part of the fastest one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import BenchModel
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import ATMOSPHERE_MPA

FloatArray = NDArray[np.float64]

MODE_TIMES_S = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 40.0])
"""Times of the modes [s]."""
LAG_S = 0.08
"""Lag of motor, tube and chamber [s]."""
FITTED_S = (0.1, 60.0)
"""Where the modes reproduce the exact response [s]."""
RATIO_GRID = np.geomspace(0.2, 60.0, 33)
"""Compliance ratios that are tabulated."""
RIDGE = 0.02
"""Weight that keeps the shares small and smooth over the ratio."""


@dataclass(frozen=True)
class CreepLaw:
    """Modes of the bend angle, of a relaxed angle of one.

    log_ratios : (n,) logarithms of the compliance ratio; shares : (n, modes), summing to about one
    ratio : that of the reference bench; gain : its relaxed bend for a pumped volume [rad/mm^3]
    model : the same finger on its bench, nonlinear
    """

    log_ratios: FloatArray
    shares: FloatArray
    ratio: float
    gain: float
    model: BenchModel

    def shares_at(self, log_ratio: float) -> tuple[FloatArray, FloatArray]:
        """Shares of the modes, (modes,), and their derivatives by the logarithm of the ratio.

        log_ratio : cut to the table
        """
        step = float(self.log_ratios[1] - self.log_ratios[0])
        place = (min(max(log_ratio, self.log_ratios[0]), self.log_ratios[-1]) - self.log_ratios[0]) / step
        below = min(int(place), len(self.log_ratios) - 2)
        slope = self.shares[below + 1] - self.shares[below]
        return self.shares[below] + (place - below) * slope, slope / step


def creep_law(finger: ReducedFinger, prony: Prony, air_ml: float = 1.1) -> CreepLaw:
    """The creep of a finger on a bench with some trapped air.

    finger : the reduced finger; prony : memory of its wall
    air_ml : of a branch and its chamber's bubble together, at zero gauge pressure [ml]
    """
    rest = finger.respond(np.zeros(finger.n_units), np.zeros(2))
    turn = rest.coupling / rest.stiffness
    chambers = rest.compliance + turn @ rest.coupling.T
    chamber = float(chambers[0, 0] - chambers[0, 1])
    air = 1e3 * air_ml / ATMOSPHERE_MPA
    softness = float(turn[0].sum() - turn[1].sum())
    shares = np.array([_shares(ratio, prony) for ratio in RATIO_GRID])
    model = BenchModel(finger, prony)
    return CreepLaw(np.log(RATIO_GRID), shares, chamber / air, softness / (chamber + air), model)


def _shares(ratio: float, prony: Prony) -> FloatArray:
    """Least-squares shares of the modes at one compliance ratio."""
    times = np.geomspace(*FITTED_S, 60)
    exact = (ratio + 1.0) * _response(ratio, prony, times)
    modes = 1.0 - np.exp(-times[:, None] / MODE_TIMES_S)
    count = len(MODE_TIMES_S)
    rows = np.vstack([modes / exact[:, None], RIDGE * np.eye(count)])
    aims = np.concatenate([np.ones(len(times)), np.full(count, RIDGE / count)])
    return np.asarray(np.linalg.lstsq(rows, aims, rcond=None)[0])


def _response(ratio: float, prony: Prony, times: FloatArray) -> FloatArray:
    """Exact p_e(t) after a unit of volume over a, behind a first-order lag; 1 / (ratio + 1) in the end."""
    strengths, taus = np.asarray(prony.strengths), np.asarray(prony.times_s)
    at_once = 1.0 / (ratio + 1.0 + strengths.sum())
    risen = 1.0 - np.exp(-times / LAG_S)
    if not len(taus):
        return at_once * risen
    rates, vectors = np.linalg.eig(np.outer(1.0 / taus, at_once * strengths) - np.diag(1.0 / taus))
    heights: NDArray[Any] = at_once * (strengths @ vectors) * np.linalg.solve(vectors, at_once / taus) / rates
    rates, heights = rates.real, heights.real
    lagged = (np.exp(np.outer(times, rates)) - np.exp(-times / LAG_S)[:, None]) / (1.0 + rates * LAG_S)
    return np.asarray(at_once * risen + (lagged - risen[:, None]) @ heights)
