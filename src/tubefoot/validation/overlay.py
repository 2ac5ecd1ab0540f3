"""Measured over predicted: slopes, linearity and offsets of the loading strokes of one recording.

States with the left chamber pressed are mirrored: `pressed` is the pressure of the pressed branch, `other`
that of the opposite one, the angle counts towards the latter. Offsets are measured less predicted at the same
pressed pressure; a positive offset of the other pressure is a smaller suction than predicted.

Each stroke begins with what the wall remembers of the one before: lines have one slope and an offset for each
stroke. The pooled R squared is that of one line through all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tubefoot.errors import ConfigError
from tubefoot.study.curve import line_fit
from tubefoot.units import DEG, KPA
from tubefoot.validation.prediction import Prediction
from tubefoot.validation.recording import FloatArray
from tubefoot.validation.settled import SettledState
from tubefoot.validation.spread import Estimate, by_strokes, with_confidence

HIGH_SHARE = 2 / 3
"""High loads are those above this share of the largest pressed pressure that was compared."""
LEAST_STATES = 4
BAND_POINTS = 25


@dataclass(frozen=True)
class Points:
    """Loading states, side by side.

    pressed, other, angle : (n,) [MPa], [MPa], [rad]
    stroke : (n,) number of the stroke that each belongs to
    """

    pressed: FloatArray
    other: FloatArray
    angle: FloatArray
    stroke: np.ndarray

    @classmethod
    def of(cls, states: Sequence[SettledState]) -> Points:
        """The loading states, those of the left side mirrored; flagged and unseen ones left out.

        states : of one recording
        """
        loading = [s for s in states if s.branch == "loading" and s.side]
        kept = [s for s in loading if not s.outlier and np.isfinite(s.angle)]
        strokes = {key: number for number, key in enumerate(dict.fromkeys((s.cycle, s.side) for s in kept))}
        right, left, angle, side = (
            np.array([getattr(s, name) for s in kept], dtype=float)
            for name in ("right", "left", "angle", "side")
        )
        return cls(
            np.where(side > 0, right, left),
            np.where(side > 0, left, right),
            angle * side,
            np.array([strokes[s.cycle, s.side] for s in kept], dtype=int),
        )

    def strokes(self, among: np.ndarray) -> list[np.ndarray]:
        """Numbers of the states of each stroke.

        among : (n,) which states are meant
        """
        return [
            numbers
            for one in np.unique(self.stroke)
            if len(numbers := np.flatnonzero((self.stroke == one) & among))
        ]


FIGURES = (
    "coupling_slope",
    "coupling_r_squared",
    "coupling_pooled_r_squared",
    "angle_slope_deg_per_kpa",
    "angle_r_squared",
    "angle_deviation_deg",
    "angle_pooled_r_squared",
    "angle_offset_deg",
    "suction_offset_kpa",
    "angle_offset_high_deg",
    "suction_offset_high_kpa",
    "angle_ratio_high",
    "suction_ratio_high",
    "angle_rms_deg",
    "suction_rms_kpa",
)
"""Figures of a comparison: lines of the measured states; offsets, ratios and rms against the prediction."""


@dataclass(frozen=True)
class Comparison:
    """One recording against one prediction.

    recording, units, run : which; states, strokes : how many were compared
    beyond : states at pressures that the prediction does not reach, left out
    top : largest pressed pressure that was compared [MPa]
    figures : by the names of FIGURES, with confidence
    predicted : slopes and R squared of the prediction over the same pressures
    whole_strokes : whether the bootstrap drew strokes
    band : columns of the mean stroke with its confidence, for the overlay
    """

    recording: str
    units: int | None
    run: str
    states: int
    strokes: int
    beyond: int
    top: float
    figures: dict[str, Estimate]
    predicted: dict[str, float]
    whole_strokes: bool
    band: dict[str, FloatArray]

    def row(self) -> dict[str, float | str]:
        """One row of comparison.csv."""
        row: dict[str, float | str] = {
            "recording": self.recording,
            "units": "" if self.units is None else self.units,
            "run": self.run,
            "states": self.states,
            "strokes": self.strokes,
            "states_beyond_prediction": self.beyond,
            "top_pressure_kpa": self.top / KPA,
        }
        for name, estimate in self.figures.items():
            row |= {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
        return row | {f"predicted_{name}": value for name, value in self.predicted.items()}


def compare(
    recording: str, states: Sequence[SettledState], prediction: Prediction, seed: int = 0
) -> Comparison:
    """The loading strokes of a recording against a prediction.

    recording : its name
    states : settled, of the recording
    prediction : of a finger of the same length
    seed : of the bootstrap

    Raises ConfigError when too few states can be compared.
    """
    points = Points.of(states)
    inside = prediction.covers(points.pressed)
    if inside.sum() < LEAST_STATES:
        raise ConfigError(
            f"{recording}: {inside.sum()} loading states lie within the "
            f"{prediction.pressed[-1] / KPA:.1f} kPa of `{prediction.name}`, {LEAST_STATES} are needed; "
            "record more pulses, or solve further"
        )
    top = float(points.pressed[inside].max())
    strokes = points.strokes(inside)

    def figures(chosen: np.ndarray) -> FloatArray:
        return _figures(points, chosen, prediction, top)

    estimates = with_confidence(figures, strokes, seed)
    return Comparison(
        recording,
        prediction.units,
        prediction.name,
        int(inside.sum()),
        len(strokes),
        int((~inside).sum()),
        top,
        dict(zip(FIGURES, estimates, strict=True)),
        _predicted(prediction, top),
        by_strokes(strokes),
        _band(points, strokes, prediction, top, seed),
    )


def _figures(points: Points, chosen: np.ndarray, prediction: Prediction, top: float) -> FloatArray:
    """The figures of some states, in the order of FIGURES, in kPa and degrees."""
    pressed, other = points.pressed[chosen] / KPA, points.other[chosen] / KPA
    angle = points.angle[chosen] / DEG
    expected_other = prediction.other_at(points.pressed[chosen]) / KPA
    expected_angle = prediction.angle_at(points.pressed[chosen]) / DEG
    off_angle, off_other = angle - expected_angle, other - expected_other
    high = pressed >= HIGH_SHARE * top / KPA
    if np.ptp(pressed) <= 0 or not high.any():
        return np.full(len(FIGURES), np.nan)
    stroke = points.stroke[chosen]
    coupling, bending = (line_within(stroke, pressed, values) for values in (other, angle))
    return np.array(
        [
            *coupling[:2],
            line_fit(pressed, other)[1],
            *bending,
            line_fit(pressed, angle)[1],
            off_angle.mean(),
            off_other.mean(),
            off_angle[high].mean(),
            off_other[high].mean(),
            angle[high].sum() / expected_angle[high].sum(),
            other[high].sum() / expected_other[high].sum(),
            np.sqrt((off_angle**2).mean()),
            np.sqrt((off_other**2).mean()),
        ]
    )


def line_within(stroke: np.ndarray, x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Slope, R squared and largest deviation of lines with one slope and an offset for each stroke.

    stroke : (n,) number of the stroke; x, y : (n,)
    """
    kinds, place = np.unique(stroke, return_inverse=True)
    count = np.bincount(place, minlength=len(kinds))
    about = [values - (np.bincount(place, values) / count)[place] for values in (x, y)]
    spread = float(about[0] @ about[0])
    slope = float(about[0] @ about[1]) / spread if spread > 0 else float("nan")
    residual = about[1] - slope * about[0]
    whole = float(about[1] @ about[1])
    r_squared = 1.0 - float(residual @ residual) / whole if whole > 0 else float("nan")
    return slope, r_squared, float(np.abs(residual).max())


def _predicted(prediction: Prediction, top: float) -> dict[str, float]:
    """Slopes and R squared of the predicted path over the compared pressures."""
    pressed = np.linspace(0.0, top, BAND_POINTS)
    coupling = line_fit(pressed / KPA, prediction.other_at(pressed) / KPA)
    bending = line_fit(pressed / KPA, prediction.angle_at(pressed) / DEG)
    return {
        "coupling_slope": coupling[0],
        "coupling_r_squared": coupling[1],
        "angle_slope_deg_per_kpa": bending[0],
        "angle_r_squared": bending[1],
    }


def _band(
    points: Points, strokes: list[np.ndarray], prediction: Prediction, top: float, seed: int
) -> dict[str, FloatArray]:
    """Mean stroke with its confidence at even pressures, where all strokes have been; nan elsewhere."""
    pressed = np.linspace(0.0, top, BAND_POINTS)
    columns: dict[str, FloatArray] = {"pressed_kpa": pressed / KPA}
    drawn = np.random.default_rng(seed).integers(len(strokes), size=(400, len(strokes)))
    for name, values, unit in (("angle_deg", points.angle, DEG), ("other_kpa", points.other, KPA)):
        paths = np.array([_stroke(points.pressed[one], values[one], pressed) for one in strokes]) / unit
        columns[name] = paths.mean(axis=0)
        low, high = np.percentile(paths[drawn].mean(axis=1), [2.5, 97.5], axis=0)
        columns |= {f"{name}_low": low, f"{name}_high": high}
    columns["predicted_angle_deg"] = prediction.angle_at(pressed) / DEG
    columns["predicted_other_kpa"] = prediction.other_at(pressed) / KPA
    return columns


def _stroke(pressed: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """A stroke at given pressures, from its lowest to its highest state; nan beyond."""
    order = np.argsort(pressed)
    return np.interp(at, pressed[order], values[order], left=np.nan, right=np.nan)
