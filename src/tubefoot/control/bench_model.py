"""A bench as a controller pictures it: a reduced finger with air, tubes and pump, for many guesses at once.

All units of the finger take the same angle phi. With the relaxed law (M, V) of `tubefoot.reduced`, times the
stiffness s of the print, behind the wall's memory G (as in `reduced/relaxation.py`):

    fluid     V_R + gas_R p_R' / (p0 + p_R') = q,    V_L + gas_L p_L' / (p0 + p_L') = -q
    tube      p' = p + R dV/dt                       p' : pressure of the branch, p : of its chamber
    bending   G * M + (s x - w) k phi + c dphi/dt = 0

x is what the bonded seam adds to the bending stiffness k at rest, w what the finger's own weight takes off it
where it stands upright, c the loss of the wall that is faster than its shortest term. q is the pumped volume,
behind the lag of the motor, with the ripple of its rollers (`rollers.py`), less what leaks back through them.
A step is implicit. A column of the state is one guess: what is not known of a bench, mostly as logarithms,
then where that bench would be now. N, mm, s, MPa, rad.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tubefoot.control.rollers import ahead
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import ANGLE_SCALE, PRESSURE_SCALE
from tubefoot.reduced.relaxation import Prony
from tubefoot.units import ATMOSPHERE_MPA, STANDARD_GRAVITY

FloatArray = NDArray[np.float64]

STIFFNESS, SPRING, GAS_RIGHT, GAS_LEFT, TUBE, FORWARD, REVERSE, LAG, PACE, OFFSET = range(10)
"""Rows of what is not known: logarithms, but for the spring x [-] and the offset of the bend angle [rad]."""
ROLLERS = slice(10, 14)
"""Rows of the rollers' ripple, as in `rollers.py` [mm^3]."""
LEAK = 14
"""Row of the logarithm of what flows back through the pump [mm^3/s/MPa]."""
UNKNOWN = 15
PHI, RIGHT, LEFT, VOLUME_RIGHT, VOLUME_LEFT, SENT, PUMPED, TURNED, AHEAD, BEFORE = range(
    UNKNOWN, UNKNOWN + 10
)
"""Rows of the moving state: angle of a unit, chamber pressures and volumes, volume sent, arrived, turned
either way, by which the rollers are ahead, memory."""
OVER = BEFORE + 3
GASES, CHAMBERS, VOLUMES = slice(GAS_RIGHT, TUBE), slice(RIGHT, VOLUME_RIGHT), slice(VOLUME_RIGHT, SENT)
FAST_LOSS = 0.3
"""Loss over the fast stiffness, share of the shortest relaxation time; to the measured loss at 10 Hz."""
ITERATIONS, CLOSE = 3, 3e-3
"""Newton steps in a time step; a correction after which none is due [rad, MPa]: the next is its square."""
SOFTEST = 0.6
"""Most of the bending stiffness that the weight may take off: beyond, a finger would not stand."""
WAYS = np.array([[1.0], [-1.0]])
"""What a pumped volume brings into the right and the left branch."""


ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of the derivatives by pressure difference and by pressure sum."""


class Answer(NamedTuple):
    """Of the relaxed wall of stiffness one, a value a guess.

    moment : (n,) that holds the angles [N mm]; by_angle : (n,) its derivative [N mm/rad]
    volumes : (2, n) [mm^3]; coupling : (2, n) dV/dphi = -dM/dp [mm^3/rad]
    compliance : (3, n) dV/dp: right by right, right by left and back, left by left [mm^3/MPa]
    """

    moment: FloatArray
    by_angle: FloatArray
    volumes: FloatArray
    coupling: FloatArray
    compliance: FloatArray


class _Step(NamedTuple):
    """What does not change in a step: see the module's formulas; ease : R / duration."""

    stiffness: FloatArray
    spring: FloatArray
    loss: FloatArray
    instant: FloatArray
    carried: FloatArray
    gases: FloatArray
    ease: FloatArray
    fluid: FloatArray


class BenchModel:
    """The equations; the state is the caller's."""

    def __init__(self, finger: ReducedFinger, prony: Prony):
        """Take the finger.

        finger : at its identified stiffness; prony : memory of its wall
        """
        chain = finger.chain
        self.units = finger.n_units
        self._table = self.units * chain.table[0] + chain.table[1] + chain.table[2]
        most = 1 + int(chain.pairs.max())
        by_difference, by_sum = np.transpose(ORDERS)
        self._of_difference = by_difference[:, None] * most + chain.pairs[0]
        self._of_sum = by_sum[:, None] * most + chain.pairs[1]
        self._slopes, self._angle_slopes = _derivatives(most), _derivatives(len(self._table))
        self._valid = finger.valid
        self._strengths, self._times = np.array(prony.strengths)[:, None], np.array(prony.times_s)[:, None]
        self.rows = OVER + 3 * len(self._times)
        none = np.zeros(1)
        self._rigid = float(self.answer(none, none, none).by_angle[0])
        self._weight = _weight(finger) / self._rigid
        self._loss = FAST_LOSS * float(min(prony.times_s, default=0.0)) * (1.0 + sum(prony.strengths))

    def at_rest(self, guesses: FloatArray) -> FloatArray:
        """States (rows, n) of benches that stand straight and relaxed.

        guesses : (UNKNOWN, n)
        """
        state = np.zeros((self.rows, guesses.shape[1]))
        state[:UNKNOWN] = guesses
        return state

    def bend(self, state: FloatArray) -> FloatArray:
        """Bend angles (n,) as the camera would see them [rad].

        state : (rows, n)
        """
        return np.asarray(self.units * state[PHI] + state[OFFSET])

    def branch_pressures(self, state: FloatArray) -> FloatArray:
        """Gauge pressures of the right and the left branch, (2, n) [MPa].

        state : (rows, n)
        """
        share = np.minimum(
            (WAYS * (state[PUMPED] + state[AHEAD]) - state[VOLUMES]) / np.exp(state[GASES]), 0.95
        )
        return np.asarray(ATMOSPHERE_MPA * share / (1.0 - share))

    def step(self, state: FloatArray, duration: float, sent: FloatArray) -> FloatArray:
        """The states after a time in which the pump was told to move a volume.

        state : (rows, n); duration : [s]; sent : (n,) signed volume as the calibrated pump has it [mm^3]
        """
        after = state.copy()
        self._pump(after, duration, sent)
        decay, gain = self._memory(state, duration)
        over = state[OVER:].reshape(3, *decay.shape)
        instant = 1.0 + gain.sum(0)
        carried = (decay * over).sum(1) - (instant - 1.0) * state[BEFORE:OVER]
        stiffness = np.exp(state[STIFFNESS])
        spring = np.maximum(stiffness * state[SPRING] - self._weight, -SOFTEST * stiffness) * self._rigid
        loss = self._loss * np.exp(state[PACE]) * stiffness * self._rigid / duration
        now = _Step(
            stiffness,
            spring,
            loss,
            instant,
            carried,
            np.exp(state[GASES]),
            np.exp(state[TUBE]) / duration,
            WAYS * (after[PUMPED] + after[AHEAD]),
        )
        unknown, volumes = self._balanced(state, now)
        after[[PHI, RIGHT, LEFT]], after[VOLUMES] = unknown, volumes
        moment = -(spring * unknown[0] + loss * (unknown[0] - state[PHI]))
        relaxed = (np.stack([unknown[1], unknown[2], moment]) - carried) / instant
        grown = decay * over + gain * (relaxed - state[BEFORE:OVER])[:, None]
        after[BEFORE:OVER], after[OVER:] = relaxed, grown.reshape(-1, state.shape[1])
        return after

    def answer(self, phi: FloatArray, right: FloatArray, left: FloatArray) -> Answer:
        """The relaxed wall of stiffness one, cut to where the law was identified.

        phi : (n,) of each unit [rad]; right, left : (n,) chamber pressures [MPa]
        """
        valid = self._valid
        pressures = np.clip(np.stack([right, left]), valid.pressure_low, valid.pressure_high) / PRESSURE_SCALE
        angles = np.clip(phi, -valid.angle, valid.angle) / ANGLE_SCALE
        by_angle = _powers(angles, self._angle_slopes).reshape(len(phi), 3, -1) @ self._table
        by_pressure = _powers(pressures[0] - pressures[1], self._slopes)[:, self._of_difference]
        by_pressure *= _powers(pressures[0] + pressures[1], self._slopes)[:, self._of_sum]
        energy, moment, rigid = (by_angle @ by_pressure.transpose(0, 2, 1)).transpose(1, 2, 0)
        return Answer(
            moment[0] / ANGLE_SCALE,
            rigid[0] / ANGLE_SCALE**2,
            PER_SIDE @ energy / -PRESSURE_SCALE,
            PER_SIDE @ moment / -(ANGLE_SCALE * PRESSURE_SCALE),
            PER_PAIR @ energy / -(PRESSURE_SCALE**2),
        )

    # ---- parts of a step -----------------------------------------------------------------------------------

    def _pump(self, after: FloatArray, duration: float, sent: FloatArray) -> None:
        """Move the volume that was sent, and let what arrives follow it; ripple and leak of the pump."""
        right, left = self.branch_pressures(after)
        leaked = np.exp(after[LEAK]) * (right - left) * duration
        after[SENT] -= leaked
        after[PUMPED] -= leaked
        before = after[SENT].copy()
        after[SENT] += sent * np.exp(np.where(sent >= 0, after[FORWARD], after[REVERSE]))
        lag = np.exp(after[LAG])
        behind, fade = (after[SENT] - before) / duration * lag, np.exp(-duration / lag)
        pumped = after[PUMPED].copy()
        after[PUMPED] = after[SENT] - behind - (before - behind - pumped) * fade
        turned = after[PUMPED] - pumped
        before_it = ahead(after[TURNED], after[ROLLERS])
        after[TURNED] += np.abs(turned)
        after[AHEAD] += np.sign(turned) * (ahead(after[TURNED], after[ROLLERS]) - before_it)

    def _memory(self, state: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
        """Decay and gain of each term (terms, n) over a step."""
        ratio = duration / (self._times * np.exp(state[PACE]))
        decay = np.exp(-ratio)
        return decay, self._strengths * (1.0 - decay) / ratio

    def _balanced(self, state: FloatArray, now: _Step) -> tuple[FloatArray, FloatArray]:
        """Angle and chamber pressures (3, n) at the end of a step, and the chambers' volumes (2, n)."""
        unknown = state[[PHI, RIGHT, LEFT]]
        soft = 1.0 / (now.instant * now.stiffness)
        slope = np.empty((state.shape[1], 3, 3))
        for _ in range(ITERATIONS):
            chambers = unknown[1:]
            found = self.answer(unknown[0], *((chambers - now.carried[:2]) * soft))
            tops = chambers + now.ease * (found.volumes - state[VOLUMES])
            space = ATMOSPHERE_MPA + np.maximum(tops, -0.97 * ATMOSPHERE_MPA)
            spread = now.gases * ATMOSPHERE_MPA / space**2
            widened = np.asarray(1.0 + spread * now.ease)
            turn = now.stiffness * now.instant * found.moment + now.carried[2] + now.spring * unknown[0]
            turn = turn + now.loss * (unknown[0] - state[PHI])
            fluid = found.volumes + now.gases * (1.0 - ATMOSPHERE_MPA / space) - now.fluid
            rr, rl, ll = found.compliance * soft
            slope[:, 0, 0] = now.stiffness * now.instant * found.by_angle + now.spring + now.loss
            slope[:, 0, 1:] = -found.coupling.T
            slope[:, 1:, 0] = (found.coupling * widened).T
            slope[:, 1, 1], slope[:, 1, 2] = rr * widened[0] + spread[0], rl * widened[0]
            slope[:, 2, 1], slope[:, 2, 2] = rl * widened[1], ll * widened[1] + spread[1]
            miss = np.stack([turn, fluid[0], fluid[1]], axis=1)
            by = np.linalg.solve(slope, miss[:, :, None])[:, :, 0].T
            unknown = unknown - by
            unknown[1:] = np.maximum(unknown[1:], 0.5 * (chambers - ATMOSPHERE_MPA))
            if abs(by).max() < CLOSE:
                break
        turned, (pressed_r, pressed_l) = -by[0], -by[1:] * soft
        rr, rl, ll = found.compliance
        moved = np.stack([rr * pressed_r + rl * pressed_l, rl * pressed_r + ll * pressed_l])
        return unknown, found.volumes + found.coupling * turned + moved


PER_SIDE = np.array([[0, 1, 1, 0, 0, 0], [0, -1, 1, 0, 0, 0]], dtype=float)
"""From `ORDERS` to the derivatives by the right and by the left pressure."""
PER_PAIR = np.array([[0, 0, 0, 1, 2, 1], [0, 0, 0, -1, 0, 1], [0, 0, 0, 1, -2, 1]], dtype=float)
"""From `ORDERS` to the second ones: right right, right left, left left."""


def _derivatives(size: int) -> FloatArray:
    """(size, 3 size): powers of x times this are the powers, their first and their second derivatives."""
    first = np.diag(np.arange(1.0, size), 1)
    return np.hstack([np.eye(size), first, first @ first])


def _powers(x: FloatArray, slopes: FloatArray) -> FloatArray:
    """Powers of x and their derivatives, (n, 3 size)."""
    powers = np.ones((len(x), len(slopes)))
    powers[:, 1:] = np.multiply.accumulate(np.broadcast_to(x[:, None], powers[:, 1:].shape), axis=1)
    return np.asarray(powers @ slopes)


def _weight(finger: ReducedFinger) -> float:
    """What the weight of an upright finger takes off the stiffness of its uniform angle [N mm/rad].

    To second order a link that is turned by k phi, k joints above the base, sinks by its length times
    (k phi)^2 / 2, with all that it carries.
    """
    links = np.arange(1, finger.n_units + 1)
    above = (finger.n_units - links) * finger.unit_mass + finger.cap_mass
    sunk = finger.pitch * (above + 0.5 * finger.unit_mass) * links**2
    return float(STANDARD_GRAVITY * sunk.sum())
