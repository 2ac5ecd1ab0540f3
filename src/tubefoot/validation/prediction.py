"""What a simulation predicts of settled states: the other pressure and the angle over the pressed one.

Read from `curve.csv` of a solve. A finger that was solved one way answers for both: the reference designs are
mirror images of themselves, and a recording's left-hand states are mirrored before they are compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tubefoot.config import read_toml
from tubefoot.errors import ConfigError
from tubefoot.study.curve import Curve
from tubefoot.units import DEG, KPA
from tubefoot.validation.recording import FloatArray

NEEDED = ("pressure_right_kpa", "pressure_left_kpa", "bend_deg")


@dataclass(frozen=True)
class Prediction:
    """A predicted path.

    name : of the run; units : of its finger, None where the run does not say
    pressed, other, angle : (n,) along the path, pressed rising from zero [MPa], [MPa], [rad]
    """

    name: str
    units: int | None
    pressed: FloatArray
    other: FloatArray
    angle: FloatArray

    def covers(self, pressed: FloatArray) -> np.ndarray:
        """Which pressures lie on the path, (k,).

        pressed : (k,) [MPa]
        """
        return np.asarray((pressed >= 0) & (pressed <= self.pressed[-1] * (1 + 1e-6)))

    def other_at(self, pressed: FloatArray) -> FloatArray:
        """Pressure of the other chamber, (k,) [MPa].

        pressed : (k,) of the pressed chamber [MPa]
        """
        return np.interp(pressed, self.pressed, self.other)

    def angle_at(self, pressed: FloatArray) -> FloatArray:
        """Bend towards the other chamber, (k,) [rad].

        pressed : (k,) of the pressed chamber [MPa]
        """
        return np.interp(pressed, self.pressed, self.angle)


def load_prediction(path: Path | str) -> Prediction:
    """The predicted path of a solve.

    path : its run directory

    Raises ConfigError when there is no curve, or it does not rise from zero.
    """
    directory = Path(path)
    if not (directory / "curve.csv").exists():
        raise ConfigError(
            f"{directory} holds no curve.csv; name the directory that `tubefoot solve --out DIR` wrote"
        )
    curve = Curve(directory)
    try:
        right, left, bend = (curve.column(name) for name in NEEDED)
    except (KeyError, ValueError):
        raise ConfigError(
            f"{directory / 'curve.csv'}: needs numbers in the columns {', '.join(NEEDED)}"
        ) from None
    if len(right) and left[-1] > right[-1]:
        right, left, bend = left, right, -bend
    if len(right) < 3 or abs(right[0]) > 1e-3 or (np.diff(right) <= 0).any():
        raise ConfigError(
            f"{directory / 'curve.csv'}: the pressed chamber's pressure must rise from 0 over 3 states or "
            "more; solve with --until pressure_right_kpa"
        )
    return Prediction(directory.resolve().name, _units(directory), right * KPA, left * KPA, bend * DEG)


def prediction_for(units: int | None, predictions: list[Prediction], name: str) -> Prediction:
    """The prediction that a recording is held against: that of a finger of as many units.

    units : of the recorded finger, None where unknown
    predictions : to choose from
    name : of the recording, for errors

    Raises ConfigError when none fits, or several do.
    """
    if units is None:
        if len(predictions) == 1:
            return predictions[0]
        raise ConfigError(
            f"{name}: the recording does not say how many units its finger has, and there are "
            f"{len(predictions)} runs; give --units, or finger_units in the column map"
        )
    fitting = [one for one in predictions if one.units in (units, None)]
    if len(fitting) != 1:
        there = ", ".join(f"{one.name} ({one.units or 'unknown'})" for one in predictions)
        raise ConfigError(
            f"{name}: its finger has {units} units; {'no run' if not fitting else 'more than one run'} of "
            f"that length among {there}"
        )
    return fitting[0]


def _units(directory: Path) -> int | None:
    path = directory / "run.toml"
    if not path.exists():
        return None
    bellows = read_toml(path).get("settings", {}).get("design", {}).get("bellows", {})
    units = bellows.get("units")
    return int(units) if units else None
