"""Finite-strain viscoelasticity: what each quadrature point remembers of the stresses it went through.

The isochoric second Piola-Kirchhoff stress is S + sum_a Q_a, S the long-term one of the Ogden law, with

    Q_a(t) = share_a int_0^t exp(-(t - s) / tau_a) dS/ds ds,

a generalised Maxwell solid (Simo 1987; Holzapfel and Simo 1996). Over a step of duration d, in which S goes
linearly from S_n to S, the integral is exact with x = d / tau_a and h_a = (1 - exp(-x)) / x (Taylor, Pister
and Goudreau 1970):

    Q_a = exp(-x) Q_a,n + share_a h_a (S - S_n).

So within a step the stress is (1 + sum share_a h_a) S plus a constant H: the moduli are scaled and H works on
C, the tangent follows exactly. Second order in d; exact while the strain stands still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tubefoot.fea.items import State
from tubefoot.fea.material_point import cofactor, deformation_gradient
from tubefoot.fea.ogden import FLAGS, ogden_point
from tubefoot.fea.solid import Solid

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Relaxation:
    """Prony terms over the long-term modulus.

    times : (n,) [s]; shares : (n,) modulus of each term over the long-term one
    """

    times: tuple[float, ...]
    shares: tuple[float, ...]

    def kept(self, duration: float) -> FloatArray:
        """(n,) share of a remembered stress that is left after a step.

        duration : of the step [s]
        """
        return np.exp(-duration / np.array(self.times))

    def gained(self, duration: float) -> FloatArray:
        """(n,) share of a step's change of stress that each term has at the end of the step.

        duration : of the step [s]; 0 for a sudden one
        """
        x = duration / np.array(self.times)
        mean = np.where(x > 0, -np.expm1(-x) / np.where(x > 0, x, 1.0), 1.0)
        return np.array(self.shares) * mean

    def modulus(self, time: float) -> float:
        """Modulus over the long-term one some time after a sudden step of strain.

        time : since the step [s]
        """
        return 1.0 + float(np.array(self.shares) @ self.kept(time))


@njit(parallel=True, cache=True, fastmath=FLAGS, error_model="numpy")
def long_term_stresses(  # type: ignore[no-untyped-def]
    unknowns, slots, gradients, material, mu, alpha, history, stresses, energies, remembered
):
    """Write the isochoric second Piola-Kirchhoff stress and energy of the law at every quadrature point.

    unknowns : (n,); slots : (n_cells, 3 n_nodes) numbers of each cell's displacements
    gradients : (n_cells, n_q, n_nodes, 3); material : (n_cells,); mu, alpha : (n_laws, n_terms)
    history : (n_cells, n_q, 6) remembered stress H [MPa]
    stresses : (n_cells, n_q, 6) out [MPa]
    energies, remembered : (n_cells, n_q) out, W and H : (C - 1) / 2 [MPa]
    """
    n_cells, n_q, n_nodes = gradients.shape[:3]
    for cell in prange(n_cells):
        nodal = np.empty((n_nodes, 3))
        for a in range(n_nodes):
            for i in range(3):
                nodal[a, i] = unknowns[slots[cell, 3 * a + i]]
        f, cof, nominal = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        tangent, work = np.empty((9, 9)), np.empty((7, 9))
        law = material[cell]
        for q in range(n_q):
            deformation_gradient(nodal, gradients[cell, q], f)
            jacobian = cofactor(f, cof)
            energies[cell, q] = ogden_point(f, mu[law], alpha[law], False, nominal, tangent, work)
            work_of_history = 0.0
            for i in range(3):
                for j in range(i, 3):
                    k = i if i == j else i + j + 2
                    value, stretch = 0.0, 0.0
                    for m in range(3):
                        value += cof[m, i] * nominal[m, j] / jacobian
                        stretch += f[m, i] * f[m, j]
                    stresses[cell, q, k] = value
                    h = history[cell, q, k]
                    work_of_history += 0.5 * h * (stretch - 1.0) if i == j else h * stretch
            remembered[cell, q] = work_of_history


class Memory:
    """The remembered stresses of a solid; it tells the solid how its material behaves over the next step."""

    def __init__(self, solid: Solid, relaxation: Relaxation, elastic_regions: Sequence[int] = ()):
        """Start at rest.

        solid : whose cells remember; relaxation : their Prony terms
        elastic_regions : numbers of the regions that remember nothing
        """
        self.solid, self.relaxation = solid, relaxation
        shape = (*solid.weights.shape, 6)
        self._branches = np.zeros((len(relaxation.times), *shape))
        self._stress = np.zeros(shape)
        self._viscous = np.ones(len(solid.constants[0]))
        self._viscous[list(elastic_regions)] = 0.0
        self._law = solid.constants
        self._history = np.zeros(shape)
        self._duration = 0.0

    def begin(self, duration: float) -> None:
        """Let the solid behave as it does over a step from the last kept state.

        duration : of the step [s]; 0 for a sudden one
        """
        self._duration = duration
        kept, gained = self.relaxation.kept(duration), self.relaxation.gained(duration)
        self._history = np.einsum("a,acqi->cqi", kept, self._branches) - gained.sum() * self._stress
        self._history *= self._viscous[self.solid.material][:, None, None]
        self._factor = 1.0 + gained.sum() * self._viscous
        self.solid.remember(self._factor, self._history)

    def keep(self, state: State) -> float:
        """Remember the state in which a step ended.

        Returns what the step's potential exceeds the long-term stored energy by [mJ].

        state : the converged state
        """
        solid = self.solid
        stresses = np.empty_like(self._stress)
        energies, remembered = np.empty(solid.weights.shape), np.empty(solid.weights.shape)
        mu, alpha, _ = self._law
        long_term_stresses(
            state.unknowns,
            solid.displacement_slots,
            solid.gradients,
            solid.material,
            mu,
            alpha,
            self._history,
            stresses,
            energies,
            remembered,
        )
        kept, gained = self.relaxation.kept(self._duration), self.relaxation.gained(self._duration)
        change = stresses - self._stress
        for branch, left, share in zip(self._branches, kept, gained, strict=True):
            branch *= left
            branch += share * change
        self._stress = stresses
        excess = (self._factor - 1.0)[solid.material][:, None] * energies + remembered
        return float((excess * solid.weights).sum())
