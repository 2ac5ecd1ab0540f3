"""A crowd of possible benches, drawn to the one that is seen: an ensemble Kalman filter on `BenchModel`.

Every guess of the crowd is a whole bench: print, air, tubes, pump, and its present state. Between two frames
all are moved by what the pump was told; at a frame each says what it would show, bend angle and both
pressures, and the crowd is drawn towards what was measured, as far as spread and scatter ask (ensemble
square root filter of Whitaker and Hamill, 2002; one number after the other). So what the angle, the pressures
and the creep tell of a bench is learnt together, from the first pulse on. The guesses at first are spread as
prints and benches are (`twin/population.py` has the sources); the drawing is seeded: runs can be repeated.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.bench_model import FORWARD, OFFSET, REVERSE, UNKNOWN, BenchModel
from tubefoot.control.contract import Measurement
from tubefoot.control.rollers import SPREADS_MM3
from tubefoot.units import DEG, KPA

FloatArray = NDArray[np.float64]

MIDDLES = np.array(
    [
        *(np.log(0.85), 0.1),
        *(np.log(850.0), np.log(850.0)),
        np.log(2.2e-6),
        *(np.log(0.8), np.log(0.8)),
        np.log(0.055),
        *(0.0, 0.0),
        *(0.0 * SPREADS_MM3),
        np.log(10.0),
    ]
)
"""Guesses at first, rows as in `BenchModel`: stiffness 0.85, seam 10 %, 0.85 ml of gas a side, tube
2.2 kPa s/ml, 0.8 of the uncalibrated flow, motor's lag 55 ms, leak 0.01 ul/s/kPa."""
SPREADS = np.array([0.42, 0.1, 0.55, 0.55, 0.45, 0.12, 0.12, 0.3, 0.5, 0.1 * DEG, *SPREADS_MM3, 0.9])
"""Their standard deviations."""
LOWEST, HIGHEST = (MIDDLES - 4.0 * SPREADS)[:, None], (MIDDLES + 4.0 * SPREADS)[:, None]
"""No guess goes beyond."""
WALKS = np.array([0.01, 0.005, 0.01, 0.01, 0.0, 0.01, 0.01, 0.0, 0.01, 0.1 * DEG, *([0.2] * 4), 0.0])
"""Random walk of each guess, by the root of the time [s]."""
SIZE = 96
PULSE_SCATTER, PULSE_SCATTER_MM3 = 0.03, 2.0
"""Of the volume between two frames, relative, and beside it [mm^3]: what the model has not of the pump."""
ANGLE_SIGMA, TIMING_S = 0.04 * DEG, 5e-3
"""Least scatter of an angle [rad], and uncertainty of a frame's time [s]."""
PRESSURE_SIGMA, PRESSURE_SHARE, PRESSURE_TIMING_S = 0.4 * KPA, 0.02, 8e-3
"""Scatter of a pressure [MPa], share of its value, uncertainty of its time [s]."""
STANDING_MM3, LEAP_SHARE = 0.1, 0.2
"""Volume between frames below which the pump stands, and weight of such a frame in the usual leap."""
KEPT_S = 2.0
LONGEST_STEP_S = 0.05


class Crowd:
    """Follows one bench from its first frame on, the finger then straight and at rest."""

    def __init__(self, model: BenchModel, size: int = SIZE):
        """Draw the guesses.

        model : of the finger; size : how many guesses
        """
        self.model = model
        self._chance = np.random.default_rng(20_241)
        drawn = self._chance.standard_normal((UNKNOWN, size))
        drawn -= drawn.mean(axis=1, keepdims=True)
        self._state = model.at_rest(np.clip(MIDDLES[:, None] + SPREADS[:, None] * drawn, LOWEST, HIGHEST))
        self._time: float | None = None
        self._volume = self._leap = 0.0
        self._seen: deque[tuple[float, float, float, float]] = deque()
        self._zero = (0.0, 0.0)

    def observe(self, seen: Measurement) -> None:
        """Take in a frame.

        seen : newer than the one before
        """
        if self._time is None:
            self._zero = seen.pressures
        right, left = (p - zero for p, zero in zip(seen.pressures, self._zero, strict=True))
        self._note(seen.volume_at, seen.pumped_volume, right, left)
        if self._time is None:
            self._time, self._volume = seen.seen_at, self._told(seen.seen_at)[0]
            return
        duration = seen.seen_at - self._time
        if duration <= 1e-4:
            return
        volume, *pressures = self._told(seen.seen_at)
        before = self._shown()
        self._move(duration, volume - self._volume)
        rates = np.abs(self._shown().mean(1) - before.mean(1)) / duration
        if abs(volume - self._volume) < STANDING_MM3:
            self._leap += LEAP_SHARE * (float(self._shown()[0].mean()) - seen.bend - self._leap)
        self._time, self._volume = seen.seen_at, volume
        measured = np.array([seen.bend, *pressures])
        scatter = np.hypot([max(seen.sigma, ANGLE_SIGMA), PRESSURE_SIGMA, PRESSURE_SIGMA], 0.0)
        scatter = np.hypot(scatter, rates * np.array([TIMING_S, PRESSURE_TIMING_S, PRESSURE_TIMING_S]))
        scatter[1:] = np.hypot(scatter[1:], PRESSURE_SHARE * measured[1:])
        self._draw_near(measured, scatter)

    def present(self, seen: Measurement) -> FloatArray:
        """The most likely bench now, a state (rows, 1) of the model.

        seen : the newest frame, already observed

        The mean of many benches, each in balance, is not quite in balance, nor are benches that were drawn
        near a frame: at the next step they leap. The angle is the mean of theirs, less their usual leap.
        """
        state = self._state.mean(axis=1, keepdims=True)
        if self._time is None:
            return state
        left, volume = seen.time - self._time, self._seen[-1][1] - self._volume
        if left > 1e-4:
            both = np.hstack([state, self._state])
            both = self.model.step(both, left, np.full(both.shape[1], volume))
            bends = self.model.bend(both)
            state = both[:, :1]
            state[OFFSET] += bends[1:].mean() - bends[0] - self._leap
        return state

    def gain_spread(self, direction: int) -> float:
        """Standard deviation of the logarithm of the pump's gain.

        direction : 1 or -1
        """
        return float(self._state[FORWARD if direction > 0 else REVERSE].std())

    @property
    def learnt(self) -> dict[str, float]:
        """What is thought of the bench, for the record."""
        names = ("stiffness", "spring", "gas_right", "gas_left", "tube", "forward", "reverse", "lag", "pace")
        values = self._state[:UNKNOWN].mean(axis=1)
        return {
            name: float(value if name == "spring" else np.exp(value))
            for name, value in zip(names, values, strict=False)
        }

    # ---- the filter ----------------------------------------------------------------------------------------

    def _shown(self) -> FloatArray:
        """What each guess would show: bend angle, pressures right and left (3, n)."""
        return np.vstack([self.model.bend(self._state), self.model.branch_pressures(self._state)])

    def _move(self, duration: float, volume: float) -> None:
        """Move all guesses, with the scatter of pump and walks."""
        size = self._state.shape[1]
        count = max(1, int(np.ceil(duration / LONGEST_STEP_S)))
        scatter = min(PULSE_SCATTER * abs(volume) + PULSE_SCATTER_MM3, 0.3 * abs(volume))
        sent = (volume + scatter * self._even(size)) / count
        for _ in range(count):
            self._state = self.model.step(self._state, duration / count, sent)
        walks = WALKS[:, None] * np.sqrt(duration) * np.stack([self._even(size) for _ in range(UNKNOWN)])
        self._state[:UNKNOWN] = np.clip(self._state[:UNKNOWN] + walks, LOWEST, HIGHEST)

    def _even(self, size: int) -> FloatArray:
        """Standard normal numbers whose mean is zero."""
        drawn = self._chance.standard_normal(size)
        return np.asarray(drawn - drawn.mean())

    def _draw_near(self, measured: FloatArray, scatter: FloatArray) -> None:
        """Draw the crowd towards the measured numbers, one after the other."""
        whole = np.vstack([self._state, self._shown()])
        for at, value, sigma in zip(range(-len(measured), 0), measured, scatter, strict=True):
            middle = whole.mean(axis=1, keepdims=True)
            apart = whole - middle
            own, noise = apart[at], sigma**2 * (len(apart[at]) - 1)
            spread = float(own @ own)
            gains = (apart @ own / (spread + noise))[:, None]
            share = 1.0 / (1.0 + np.sqrt(noise / (spread + noise)))
            whole = middle + gains * (value - middle[at]) + apart - share * gains * own
        self._state = whole[: -len(measured)]
        self._state[:UNKNOWN] = np.clip(self._state[:UNKNOWN], LOWEST, HIGHEST)

    # ---- what the rig told ---------------------------------------------------------------------------------

    def _note(self, time: float, volume: float, right: float, left: float) -> None:
        if not self._seen or time > self._seen[-1][0]:
            self._seen.append((time, volume, right, left))
        while self._seen[0][0] < time - KEPT_S:
            self._seen.popleft()

    def _told(self, time: float) -> tuple[float, float, float]:
        """Volume and pressures at a time of the near past, as the rig told them."""
        times, *columns = zip(*self._seen, strict=True)
        volume, right, left = (float(np.interp(time, times, column)) for column in columns)
        return volume, right, left
