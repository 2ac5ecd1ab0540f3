"""Prony terms of a viscoelastic solid from its dynamic moduli, by least squares with moduli >= 0.

E'(w) = E_inf + sum_a E_a (w t_a)^2 / (1 + (w t_a)^2),   E''(w) = sum_a E_a w t_a / (1 + (w t_a)^2).

Both are linear in the moduli; the misfit is relative, since they span decades (Lawson and Hanson's NNLS).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tubefoot.errors import ConfigError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PronyFit:
    """Prony terms of a tensile modulus.

    times : (n,) [s]; moduli : (n,) [MPa], not negative; long_term : [MPa]
    misfit : relative, root mean square
    """

    times: FloatArray
    moduli: FloatArray
    long_term: float
    misfit: float

    def relaxation_modulus(self, time: ArrayLike) -> FloatArray:
        """Modulus some time after a step of strain [MPa].

        time : since the step [s]
        """
        decay = np.exp(-np.asarray(time, float)[..., None] / self.times)
        return np.asarray(self.long_term + decay @ self.moduli, float)


def fit_prony(frequency: ArrayLike, storage: ArrayLike, loss: ArrayLike, times: ArrayLike) -> PronyFit:
    """The Prony terms at given times that fit dynamic moduli best.

    frequency : [Hz]; storage, loss : moduli E', E'' there [MPa]
    times : relaxation times [s]; two a decade over the whole range of the data leave no gap

    Raises ConfigError for data that are not positive or not of one length.
    """
    from scipy.optimize import nnls

    hertz, real, imaginary = (np.asarray(values, float) for values in (frequency, storage, loss))
    if not hertz.shape == real.shape == imaginary.shape or hertz.ndim != 1 or not hertz.size:
        raise ConfigError(
            f"{hertz.size} frequencies, {real.size} storage and {imaginary.size} loss moduli; "
            "give as many of each"
        )
    if min(hertz.min(), real.min(), imaginary.min()) <= 0:
        raise ConfigError("frequencies and dynamic moduli must be positive; drop the rows that are not")
    taus = np.asarray(times, float)
    x = 2 * np.pi * hertz[:, None] * taus
    one, zero = np.ones((len(hertz), 1)), np.zeros((len(hertz), 1))
    rows = np.vstack(
        [
            np.hstack([x**2 / (1 + x**2), one]) / real[:, None],
            np.hstack([x / (1 + x**2), zero]) / imaginary[:, None],
        ]
    )
    moduli, distance = nnls(rows, np.ones(len(rows)))
    return PronyFit(taus, moduli[:-1], float(moduli[-1]), float(distance / np.sqrt(len(rows))))
