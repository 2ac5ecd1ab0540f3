"""What the finger will do next, learnt while it is driven: an extended Kalman filter on the creep's modes.

State: angle of each mode [rad]; the relaxed angle U that the fluid in place is worth [rad]; logarithms of the
gain forward and in reverse over the law's, and of the compliance ratio. Between frames

    U' = gain q,     mode_i' = (share_i(ratio) U - mode_i) / T_i,     bend = sum of the modes

with the pumped volume as the rig tells it. Its error (duty, wear, supply) is learnt as the gain of each
direction; what a pulse moves beside that, leaks and what the linear law misses, enter as process noise.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.contract import Measurement
from tubefoot.control.creep import MODE_TIMES_S, CreepLaw
from tubefoot.units import DEG

FloatArray = NDArray[np.float64]

MODES = len(MODE_TIMES_S)
RELAXED, FORWARD_GAIN, REVERSE_GAIN, RATIO, DRIFT = range(MODES, MODES + 5)
STATES = MODES + 5

GAIN_SIGMA = 0.35
"""Prior scatter of the logarithm of each gain: flow, air, nonlinearity."""
SHARED_GAIN = 0.8
"""Correlation of the two gains: air and wall are the same both ways, the flow is not."""
RATIO_SIGMA = 0.8
"""Prior scatter of the logarithm of the compliance ratio: stiffness 0.4 to 1.7, air 0.2 to 3 ml."""
PULSE_SCATTER = 0.04
"""Of the volume that passes between two frames, relative."""
LEAK = 0.05 * DEG
"""Random walk of the relaxed angle [rad/sqrt(s)]."""
MODE_WALK = 0.05 * DEG
"""Random walk of each mode [rad/sqrt(s)]: what the linear law misses."""
DRIFT_SIGMA, DRIFT_TIME_S = 0.3 * DEG, 2.5
"""Scatter [rad/s] and memory [s] of a drift that the linear law does not explain."""
GAIN_WALK, RATIO_WALK = 0.02, 0.02
"""Random walks of the learnt logarithms [1/sqrt(s)]."""
FRAME_SIGMA = 0.05 * DEG
"""Least scatter of a measured angle [rad]: what vision's own sigma leaves out."""
FRAME_TIMING_S = 4e-3
"""Uncertainty of a frame's time stamp [s]."""
KEPT_S = 2.0


@dataclass(frozen=True)
class Forecast:
    """The finger from now on, as it would move with the pump standing.

    modes : (modes,) angles now [rad]; relaxed : angle that the fluid in place is worth [rad]
    drift : further rate now [rad/s], which dies out
    shares : (modes,); gains : relaxed angle for a volume forward and in reverse [rad/mm^3]
    """

    modes: FloatArray
    relaxed: float
    drift: float
    shares: FloatArray
    gains: tuple[float, float]

    def free(self, times: FloatArray) -> FloatArray:
        """Bend angle with the pump standing [rad].

        times : (n,) from now [s]
        """
        decay = np.exp(-times[:, None] / MODE_TIMES_S)
        drifted = self.drift * DRIFT_TIME_S * (1.0 - np.exp(-times / DRIFT_TIME_S))
        return np.asarray(decay @ self.modes + (1.0 - decay) @ self.shares * self.relaxed + drifted)

    def step(self, times: FloatArray, duration: float = 0.0) -> FloatArray:
        """Further bend for one radian of relaxed angle, pumped evenly from now on.

        times : (n,) from now [s]; duration : of the pumping, 0 for at once [s]
        """
        column = times[:, None]
        if duration <= 1e-6:
            return np.asarray((1.0 - np.exp(-column / MODE_TIMES_S)) @ self.shares)
        after = np.maximum(column - duration, 0.0)
        ramp = _ramp(column) - _ramp(after)
        return np.asarray(ramp @ self.shares / duration)

    def gain(self, direction: float) -> float:
        """Relaxed angle for a volume [rad/mm^3].

        direction : its sign tells the way
        """
        return self.gains[0] if direction >= 0 else self.gains[1]


def _ramp(times: FloatArray) -> FloatArray:
    """Response of each mode to an input that grows by one a second."""
    return np.asarray(times - MODE_TIMES_S * (1.0 - np.exp(-times / MODE_TIMES_S)))


class BendEstimator:
    """Follows one finger from the first frame on."""

    def __init__(self, law: CreepLaw):
        """Begin with what is known before the first pulse.

        law : of the finger's creep
        """
        self.law = law
        self._state = np.zeros(STATES)
        self._state[RATIO] = np.log(law.ratio)
        spread = np.zeros((STATES, STATES))
        spread[RELAXED, RELAXED] = (0.5 * DEG) ** 2
        for gain in (FORWARD_GAIN, REVERSE_GAIN):
            spread[gain, gain] = GAIN_SIGMA**2
        spread[FORWARD_GAIN, REVERSE_GAIN] = spread[REVERSE_GAIN, FORWARD_GAIN] = SHARED_GAIN * GAIN_SIGMA**2
        spread[RATIO, RATIO] = RATIO_SIGMA**2
        spread[DRIFT, DRIFT] = DRIFT_SIGMA**2
        self._spread = spread
        self._time: float | None = None
        self._volume = 0.0
        self._volumes: deque[tuple[float, float]] = deque()

    def observe(self, seen: Measurement) -> None:
        """Take in a frame.

        seen : newer than the one before
        """
        self._note_volume(seen.volume_at, seen.pumped_volume)
        if self._time is None:
            self._begin(seen)
            return
        if seen.seen_at <= self._time:
            return
        volume = self._volume_at(seen.seen_at)
        before = float(self._state[:MODES].sum())
        duration = seen.seen_at - self._time
        self._state, step, noise = self._moved(self._state, duration, volume - self._volume)
        self._spread = step @ self._spread @ step.T + np.diag(noise)
        rate = (float(self._state[:MODES].sum()) - before) / duration
        self._time, self._volume = seen.seen_at, volume
        self._correct(seen, rate)

    def forecast(self, seen: Measurement) -> Forecast:
        """The finger from now on.

        seen : the newest frame, already observed
        """
        state = self._state
        if self._time is not None and seen.time > self._time:
            latest = self._volumes[-1][1] if self._volumes else self._volume
            state, _, _ = self._moved(state, seen.time - self._time, latest - self._volume)
        shares, _ = self.law.shares_at(float(state[RATIO]))
        gains = self.law.gain * np.exp(state[[FORWARD_GAIN, REVERSE_GAIN]])
        return Forecast(
            state[:MODES],
            float(state[RELAXED]),
            float(state[DRIFT]),
            shares,
            (float(gains[0]), float(gains[1])),
        )

    @property
    def learnt(self) -> dict[str, float]:
        """Gains over the law's and the compliance ratio, for the record."""
        forward, reverse, ratio = np.exp(self._state[[FORWARD_GAIN, REVERSE_GAIN, RATIO]])
        return {
            "gain_forward": float(forward),
            "gain_reverse": float(reverse),
            "compliance_ratio": float(ratio),
        }

    def _begin(self, seen: Measurement) -> None:
        """The first frame: at rest where it is seen, the slowest modes taken as relaxed."""
        shares, _ = self.law.shares_at(float(self._state[RATIO]))
        self._time, self._volume = seen.seen_at, self._volume_at(seen.seen_at)
        self._state[RELAXED] = seen.bend / shares.sum()
        self._state[:MODES] = shares * self._state[RELAXED]

    def _moved(
        self, state: FloatArray, duration: float, volume: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """State after a time in which a volume was pumped; the Jacobian; variances added."""
        gain_at = FORWARD_GAIN if volume >= 0 else REVERSE_GAIN
        change = self.law.gain * float(np.exp(state[gain_at])) * volume
        shares, slope = self.law.shares_at(float(state[RATIO]))
        rest = 1.0 - np.exp(-duration / MODE_TIMES_S)
        middle = state[RELAXED] + 0.5 * change
        moved = state.copy()
        moved[:MODES] += rest * (shares * middle - state[:MODES])
        moved[RELAXED] += change
        fade = float(np.exp(-duration / DRIFT_TIME_S))
        moved[MODES - 1] += duration * state[DRIFT]
        moved[DRIFT] *= fade
        step = np.eye(STATES)
        step[range(MODES), range(MODES)] = 1.0 - rest
        step[:MODES, RELAXED] = rest * shares
        step[:MODES, gain_at] = rest * shares * 0.5 * change
        step[:MODES, RATIO] = rest * slope * middle
        step[RELAXED, gain_at] = change
        step[MODES - 1, DRIFT] = duration
        step[DRIFT, DRIFT] = fade
        noise = np.zeros(STATES)
        noise[:MODES] = MODE_WALK**2 * duration
        noise[RELAXED] = LEAK**2 * duration + (PULSE_SCATTER * change) ** 2
        noise[[FORWARD_GAIN, REVERSE_GAIN]] = GAIN_WALK**2 * duration
        noise[RATIO] = RATIO_WALK**2 * duration
        noise[DRIFT] = DRIFT_SIGMA**2 * (1.0 - fade**2)
        return moved, step, noise

    def _correct(self, seen: Measurement, rate: float) -> None:
        """Kalman update by the seen angle; the modes' sum is measured."""
        seen_row = np.zeros(STATES)
        seen_row[:MODES] = 1.0
        scatter = max(seen.sigma, FRAME_SIGMA) ** 2 + (FRAME_TIMING_S * rate) ** 2
        gains = self._spread @ seen_row
        gains /= float(seen_row @ gains) + scatter
        self._state = self._state + gains * (seen.bend - float(self._state[:MODES].sum()))
        self._spread = self._spread - np.outer(gains, seen_row @ self._spread)
        self._spread = 0.5 * (self._spread + self._spread.T)

    def _note_volume(self, time: float, volume: float) -> None:
        if not self._volumes or time > self._volumes[-1][0]:
            self._volumes.append((time, volume))
        while self._volumes[0][0] < time - KEPT_S:
            self._volumes.popleft()

    def _volume_at(self, time: float) -> float:
        """Pumped volume at a time of the near past, as the rig told it."""
        times, volumes = zip(*self._volumes, strict=True)
        return float(np.interp(time, times, volumes))
