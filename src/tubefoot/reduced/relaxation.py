"""The memory of the wall: quasi-linear viscoelasticity of a reduced finger, as a generalised Maxwell model.

Every stress of the wall relaxes by one function, G(t) = 1 + sum_i g_i exp(-t / tau_i), over the equilibrium
law: Fung's form, shape of the law by strain times a function of time, which needs no more than small-strain
data. In the volume form, (M, p) = int G(t - t') d(M_e, p_e)/dt' dt' with M_e, p_e the
equilibrium law at (phi, v). As p_e obeys a linear equation without phi, all units share it, and the law may
be kept in its pressure form:

    p_e   from the actual pressures, by the inverse filter;       M_e,k = dPsi/dphi(phi_k, p_e)
    V = -dPsi/dp(phi, p_e);                                       M_k from M_e,k, by the filter G

So with the volumes held the angles do not creep and the pressures relax; with the pressures held the angles
creep; with M = 0 throughout, the unit follows p_e. A step is exact where M_e and p_e grow linearly over it.

The terms come from the design's material, relative to its long-term modulus. That the quasi-static Ogden
law is that long-term modulus is an assumption; the stiffness scale of each print covers it. They were
measured at 20 degC; in a warmer room the wall relaxes faster (docs/decisions/0005-relaxation.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.reduced.chain import Response
from tubefoot.reduced.finger import ReducedFinger

FloatArray = NDArray[np.float64]

MEASURED_C, ROOM_C = 20.0, 23.0
"""Temperature of the relaxation data, and that of a laboratory [degC]."""
DECADES_PER_K = 0.13
"""By how much a kelvin shortens the relaxation times: published storage moduli of Agilus30 at 1 Hz, 13.4, 6.4
and 3.7 MPa at 20, 25 and 30 degC, read against the modulus over frequency at 20 degC (design/data)."""


@dataclass(frozen=True)
class Prony:
    """Relaxation over equilibrium: strengths g_i [-] and times tau_i [s], in ascending order of time."""

    strengths: tuple[float, ...]
    times_s: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.strengths) != len(self.times_s):
            raise ConfigError(
                f"{len(self.strengths)} Prony strengths and {len(self.times_s)} times; give as many of each"
            )
        if any(g < 0 for g in self.strengths) or any(t <= 0 for t in self.times_s):
            raise ConfigError("Prony strengths must not be negative, and times must be positive [s]")

    def modulus(self, time_s: float) -> float:
        """Modulus at a time after a step of strain, over the equilibrium one.

        time_s : [s]
        """
        terms = zip(self.strengths, self.times_s, strict=True)
        return 1.0 + sum(g * float(np.exp(-time_s / tau)) for g, tau in terms)

    def scaled(self, share: float) -> Prony:
        """The same with all strengths multiplied.

        share : 0 for an elastic wall
        """
        return Prony(tuple(share * g for g in self.strengths), self.times_s)

    def warmed(self, kelvin: float) -> Prony:
        """The same wall in a warmer or colder room: all times shortened or lengthened.

        kelvin : by which it is warmer
        """
        share = 10.0 ** (-DECADES_PER_K * kelvin)
        return Prony(self.strengths, tuple(share * tau for tau in self.times_s))


NO_RELAXATION = Prony((), ())
"""An elastic wall."""


class RelaxingFinger:
    """A reduced finger with memory; `respond` asks, `commit` moves on."""

    def __init__(self, finger: ReducedFinger, prony: Prony):
        """Begin at rest, relaxed.

        finger : the equilibrium law; prony : its relaxation
        """
        self.finger = finger
        self.prony = prony
        self._strengths = np.asarray(prony.strengths, dtype=float)[:, None]
        self._times = np.asarray(prony.times_s, dtype=float)[:, None]
        self._duration = -1.0
        self._decay = self._gain = self._strengths
        self._instant = 1.0
        self._before = np.zeros(2 + finger.n_units)
        self._over = np.zeros((len(prony.strengths), 2 + finger.n_units))

    @property
    def n_units(self) -> int:
        """Number of units."""
        return self.finger.n_units

    def respond(self, angles: FloatArray, pressures: FloatArray, duration: float) -> Response:
        """The answer at the end of a step that begins at the last committed state.

        angles : (n,) [rad]; pressures : (2,) actual, gauge [MPa]; duration : of the step [s]

        stiffness and compliance are those of the step, the fast response of the wall in them. The coupling is
        dV/dphi and, as one factor makes M_e stiffer and p_e softer, still -dM/dp.
        """
        self._prepare(duration)
        carried = self._carried()
        return self._answer(angles, (pressures - carried[:2]) / self._instant, carried)

    def commit(self, angles: FloatArray, pressures: FloatArray, duration: float) -> Response:
        """Accept a state as the end of a step; its answer, as `respond` gives it.

        angles : (n,) [rad]; pressures : (2,) [MPa]; duration : of the step [s]
        """
        self._prepare(duration)
        carried = self._carried()
        equilibrium = (pressures - carried[:2]) / self._instant
        answer = self._answer(angles, equilibrium, carried)
        now = np.concatenate([equilibrium, (answer.moments - carried[2:]) / self._instant])
        self._over = self._decay * self._over + self._gain * (now - self._before)
        self._before = now
        return answer

    def settle(self, angles: FloatArray, pressures: FloatArray) -> None:
        """Forget the history: the wall is relaxed at this state.

        angles : (n,) [rad]; pressures : (2,) [MPa]
        """
        found = self.finger.respond(angles, np.asarray(pressures))
        self._before = np.concatenate([np.asarray(pressures, dtype=float), found.moments])
        self._over = np.zeros_like(self._over)

    def memory(self) -> tuple[FloatArray, FloatArray]:
        """The history so far, for `recall`."""
        return self._before.copy(), self._over.copy()

    def recall(self, memory: tuple[FloatArray, FloatArray]) -> None:
        """Go back to a history.

        memory : from `memory`
        """
        self._before, self._over = memory[0].copy(), memory[1].copy()

    def _answer(self, angles: FloatArray, equilibrium: FloatArray, carried: FloatArray) -> Response:
        """The answer at equilibrium pressures (2,), with what the past adds to the moments."""
        found = self.finger.respond(angles, equilibrium)
        return Response(
            self._instant * found.moments + carried[2:],
            self._instant * found.stiffness,
            found.volumes,
            found.compliance / self._instant,
            found.coupling,
            found.energy,
        )

    def _carried(self) -> FloatArray:
        """What the past adds to pressures (2,) and moments (n,), were the input now zero."""
        return np.asarray((self._decay * self._over).sum(axis=0) - (self._instant - 1.0) * self._before)

    def _prepare(self, duration: float) -> None:
        if duration == self._duration:
            return
        if not duration > 0.0:
            raise ConfigError(f"a step of {duration:g} s; it must be longer than zero")
        ratio = duration / self._times
        self._decay = np.exp(-ratio)
        self._gain = -self._strengths * np.expm1(-ratio) / ratio
        self._instant = 1.0 + float(self._gain.sum())
        self._duration = duration
