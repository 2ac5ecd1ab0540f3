"""The unknowns of a bench: unit, physical bounds, prior, and how they make a lean bench and its measurements.

Most unknowns are fitted as logarithms. Priors are wide where a fit shall decide and narrow where a data sheet
or the material's own test says more than a bench can (docs/theory.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, expm1, log
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.reduced.relaxation import Prony
from tubefoot.units import KPA, ML
from tubefoot.validation.lean_bench import BenchNumbers
from tubefoot.validation.windows import Observation

FloatArray = NDArray[np.float64]

NUCLEUS = 1.0
"""Air in each branch and chamber that no filling removes [mm^3]."""
HARMONICS = (1, 2, 3, 4)
"""Of the rollers' ripple, by roller."""
SAME_TIME_S = 1e-5
"""Times are the same within this: the grid's are rounded [s]."""


@dataclass(frozen=True)
class Unknown:
    """One unknown.

    name : with its unit; kind : log or linear; low, high : physical bounds
    middle, sigma : of the normal prior; of the logarithm where kind is log
    meaning : for people; nuisance : whether it is only fitted to keep it out of the others
    """

    name: str
    kind: Literal["log", "linear"]
    low: float
    high: float
    middle: float
    sigma: float
    meaning: str
    nuisance: bool = False

    def inner(self, value: float) -> float:
        """What the fit works with.

        value : in the unit of the name
        """
        return log(value) if self.kind == "log" else value

    def outer(self, value: float) -> float:
        """The value in the unit of the name.

        value : what the fit works with
        """
        return exp(value) if self.kind == "log" else value


def _log(name: str, low: float, high: float, middle: float, spread: float, meaning: str) -> Unknown:
    return Unknown(name, "log", low, high, log(middle), spread, meaning)


def _nuisance(name: str, middle: float, sigma: float, meaning: str, reach: float = 6.0) -> Unknown:
    return Unknown(
        name, "linear", middle - reach * sigma, middle + reach * sigma, middle, sigma, meaning, True
    )


UNKNOWNS = (
    _log(
        "scale", 0.15, 5.0, 0.9, 0.7, "long-term moduli of the print over the model's; literature 0.4 to 1.7"
    ),
    Unknown("seam", "linear", 0.0, 2.0, 0.1, 0.3, "bending stiffness of the bond over the unit's own"),
    _log("air_right_ml", 0.02, 20.0, 0.7, 1.0, "air above the right column at zero gauge"),
    _log("air_left_ml", 0.02, 20.0, 0.7, 1.0, "air above the left column"),
    Unknown("bubble_right_ml", "linear", 0.0, 5.0, 0.05, 0.15, "air in the right chamber at zero gauge"),
    Unknown("bubble_left_ml", "linear", 0.0, 5.0, 0.05, 0.15, "air in the left chamber"),
    _log("tube_kpa_s_per_ml", 0.05, 100.0, 2.2, 0.6, "flow resistance of each tube"),
    _log("flow_forward_ml_per_s", 0.02, 5.0, 0.3, 0.6, "pump's flow at the duty used, into the right branch"),
    _log("flow_reverse_ml_per_s", 0.02, 5.0, 0.3, 0.6, "the same into the left branch"),
    _log(
        "leak_back_ul_per_s_kpa",
        0.0003,
        2.0,
        0.01,
        1.2,
        "through the rollers for each kPa between the branches",
    ),
    _log("relaxation_strength", 0.1, 5.0, 1.0, 0.15, "of the wall over that of the material's test"),
    _log(
        "relaxation_time",
        0.02,
        50.0,
        1.0,
        0.6,
        "relaxation times over those of the material's test at 23 degC",
    ),
    Unknown("fast_loss_s", "log", 1e-4, 0.3, log(0.012), 0.7, "of what relaxes faster than the terms", True),
    _nuisance("pump_lag_s", 0.06, 0.02, "time constant of the motor", 2.5),
    _nuisance("lost_time_s", 0.0005, 0.0005, "of each pulse: it runs shorter than the board told", 4.0),
    _nuisance("gain_right", 1.0, 0.01, "of the right pressure sensor"),
    _nuisance("gain_left", 1.0, 0.01, "of the left pressure sensor"),
    _nuisance("pressure_late_s", 0.001, 0.003, "of the samples against the pulses: sensors, stamps", 4.0),
    _nuisance("angle_gain", 1.0, 0.003, "of the measured angle"),
    _nuisance("angle_zero_deg", 0.0, 0.05, "of the measured angle"),
    _nuisance("zero_right_kpa", 0.0, 0.1, "left of the right sensor's zero after the baseline"),
    _nuisance("zero_left_kpa", 0.0, 0.1, "left of the left sensor's zero"),
    Unknown(
        "roller_volume_ml",
        "log",
        0.1,
        1.0,
        log(0.3),
        0.05,
        "between two rollers: 0.9 ml a turn, three rollers",
        True,
    ),
    *(
        _nuisance(f"ripple_{part}_{h}_ul", 0.0, 8.0 / h**1.5, "volume that the rollers run ahead or behind")
        for h in HARMONICS
        for part in ("sin", "cos")
    ),
)
"""Every unknown of one bench with one finger."""
NAMES = tuple(unknown.name for unknown in UNKNOWNS)
MAIN = tuple(unknown.name for unknown in UNKNOWNS if not unknown.nuisance)


def unknown_named(name: str) -> Unknown:
    """The unknown of a name.

    name : one of NAMES
    """
    return UNKNOWNS[NAMES.index(name)]


def bench_numbers(values: Mapping[str, float], relaxation: Prony) -> BenchNumbers:
    """The lean bench of some values.

    values : by the names of UNKNOWNS; relaxation : of the material's test, in a room of 23 degC
    """
    strength = values["relaxation_strength"]
    return BenchNumbers(
        scale=values["scale"],
        seam=values["seam"],
        air=(values["air_right_ml"] * ML + NUCLEUS, values["air_left_ml"] * ML + NUCLEUS),
        bubble=(values["bubble_right_ml"] * ML + NUCLEUS, values["bubble_left_ml"] * ML + NUCLEUS),
        resistance=values["tube_kpa_s_per_ml"] * KPA / ML,
        leak=values["leak_back_ul_per_s_kpa"] / KPA,
        fast_loss=values["fast_loss_s"],
        shares=strength * np.array(relaxation.strengths),
        times=values["relaxation_time"] * np.array(relaxation.times_s),
    )


def usual_duty(observations: Sequence[Observation]) -> float:
    """The duty at which a fit's flows are: the median of those that are known; 1 where none is.

    observations : that are fitted together
    """
    duties = np.concatenate([observation.duties for observation in observations])
    known = duties[np.isfinite(duties)]
    return float(np.median(known)) if len(known) else 1.0


def pumped_volumes(observation: Observation, values: Mapping[str, float], duty: float) -> FloatArray:
    """Volume that the rollers bring into the right branch in each step, (n,) [mm^3].

    observation : with the pulses; values : by the names of UNKNOWNS; duty : at which their flows are

    A pulse begins and ends with the motor's lag; its lost time takes volume from all of it. Another duty has
    its flow in proportion to its excess over a dead duty of 0.16; an unknown one counts as that duty.
    """
    flows = ML * np.array([values["flow_forward_ml_per_s"], values["flow_reverse_ml_per_s"]])
    used = np.where(np.isfinite(observation.duties), observation.duties, duty)
    way = np.where(observation.directions > 0, 0, 1)
    ran = 1.0 - values["lost_time_s"] / (observation.ends - observation.starts)
    rate = flows[way] * _excess(used) / _excess(np.array(duty)) * ran
    begin, beyond = (
        np.searchsorted(observation.grid, at - SAME_TIME_S) for at in (observation.starts, observation.ends)
    )
    wanted = np.zeros((2, len(observation.grid)))
    np.add.at(wanted, (way, begin), rate)
    np.add.at(wanted, (way, beyond), -rate)
    steps = np.diff(observation.grid)
    turned = turned_volumes(steps, wanted.cumsum(axis=1), values["pump_lag_s"])
    both = turned.sum(axis=0)
    ahead = np.zeros_like(both)
    for h in HARMONICS:
        phase = 2 * np.pi * h * both / (values["roller_volume_ml"] * ML)
        ahead += values[f"ripple_sin_{h}_ul"] * np.sin(phase)
        ahead += values[f"ripple_cos_{h}_ul"] * (np.cos(phase) - 1.0)
    moved = np.diff(turned[0] - turned[1])
    turning = np.diff(both)
    direction = np.divide(moved, turning, out=np.zeros_like(moved), where=turning > 0)
    return np.asarray(moved + direction * np.diff(ahead))


def _excess(duty: FloatArray) -> FloatArray:
    return np.maximum(duty - 0.16, 0.02)


@njit(cache=True)
def turned_volumes(steps, wanted, lag):  # type: ignore[no-untyped-def]
    """Volume that the motor has turned either way at each time, (2, n + 1) [mm^3], following with its lag.

    steps : (n,) durations [s]; wanted : (2, n or more) flows at full speed in each step [mm^3/s]; lag : [s]
    """
    turned = np.zeros((2, len(steps) + 1))
    for way in range(2):
        flow = 0.0
        for k in range(len(steps)):
            caught_up = -expm1(-steps[k] / lag)
            over = flow - wanted[way, k]
            turned[way, k + 1] = turned[way, k] + wanted[way, k] * steps[k] + over * lag * caught_up
            flow -= over * caught_up
    return turned


def starting_values(observations: Sequence[Observation]) -> dict[str, float]:
    """Where a fit starts: the priors' middles.

    observations : whose usual duty tells the pump's flow
    """
    values = {unknown.name: unknown.outer(unknown.middle) for unknown in UNKNOWNS}
    duty = usual_duty(observations)
    for name in ("flow_forward_ml_per_s", "flow_reverse_ml_per_s"):
        values[name] = 1.25 * float(_excess(np.array(duty))) / 0.84
    return values
