"""Prony terms of a viscoelastic solid from dynamic moduli and relaxation, by least squares with moduli >= 0.

E'(w) = E_inf + sum_a E_a (w t_a)^2 / (1 + (w t_a)^2),   E''(w) = sum_a E_a w t_a / (1 + (w t_a)^2),
E(t) = E_inf + sum_a E_a exp(-t / t_a).

All are linear in the moduli; the misfit is relative, since they span decades (Lawson and Hanson's NNLS).
Terms that end at zero are taken as known to be so; the covariance of the others is that of the linear
problem.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tubefoot.errors import ConfigError

FloatArray = NDArray[np.float64]

TERMS_A_DECADE = 2
LOST = 0.5
"""Relative standard deviation above which a combination of terms is not determined."""


@dataclass(frozen=True)
class PronyFit:
    """Prony terms of a tensile modulus.

    times : (n,) [s]; moduli : (n,) [MPa], not negative; long_term : [MPa]
    misfit : relative, root mean square
    covariance : (n + 1, n + 1) of the moduli and, last, the long-term one [MPa^2]; zero for terms at zero
    undetermined : how many combinations of terms the data do not tell apart: others would fit as well
    """

    times: FloatArray
    moduli: FloatArray
    long_term: float
    misfit: float
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    undetermined: int = 0

    def relaxation_modulus(self, time: ArrayLike) -> FloatArray:
        """Modulus some time after a step of strain [MPa].

        time : since the step [s]
        """
        return np.asarray(_of_time(time, self.times) @ self._all, float)

    def dynamic_moduli(self, frequency: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Storage and loss modulus [MPa].

        frequency : [Hz]
        """
        storage, loss = _of_frequency(frequency, self.times)
        return np.asarray(storage @ self._all), np.asarray(loss @ self._all)

    def sigma(self, what: str, at: ArrayLike) -> FloatArray:
        """Standard deviation of a modulus by the fit's covariance [MPa].

        what : storage, loss or relaxation; at : frequencies [Hz] or times [s]
        """
        if what == "relaxation":
            rows = _of_time(at, self.times)
        else:
            rows = _of_frequency(at, self.times)[what == "loss"]
        return np.asarray(np.sqrt(np.einsum("ni,ij,nj->n", rows, self.covariance, rows)))

    @property
    def _all(self) -> FloatArray:
        return np.append(self.moduli, self.long_term)


def times_for(frequency: ArrayLike = (), time: ArrayLike = ()) -> FloatArray:
    """Relaxation times over the whole range of the data, two a decade, on round powers of ten [s].

    frequency : of the dynamic data [Hz]; time : of the relaxation data [s]
    """
    hertz, seconds = np.atleast_1d(np.asarray(frequency, float)), np.atleast_1d(np.asarray(time, float))
    reach = np.log10(np.concatenate([1.0 / (2 * np.pi * hertz), seconds[seconds > 0]]))
    if not reach.size:
        raise ConfigError("no frequency or time above zero: no relaxation times can be chosen")
    first, last = np.floor(reach.min() * TERMS_A_DECADE), np.ceil(reach.max() * TERMS_A_DECADE)
    return np.asarray(10.0 ** (np.arange(first, last + 1) / TERMS_A_DECADE))


def fit_prony(
    frequency: ArrayLike,
    storage: ArrayLike,
    loss: ArrayLike,
    times: ArrayLike,
    relaxation: tuple[ArrayLike, ArrayLike] = ((), ()),
) -> PronyFit:
    """The Prony terms at given times that fit dynamic moduli, relaxation or both best.

    frequency : [Hz]; storage, loss : moduli E', E'' there [MPa]; all may be empty
    times : relaxation times [s]; two a decade over the whole range of the data leave no gap
    relaxation : times [s] and moduli [MPa] after a step of strain

    Raises ConfigError for data that are not positive or not of one length.
    """
    from scipy.optimize import nnls

    hertz, real, imaginary = (np.asarray(values, float) for values in (frequency, storage, loss))
    seconds, relaxed = (np.asarray(values, float) for values in relaxation)
    if (
        not hertz.shape == real.shape == imaginary.shape
        or hertz.ndim != 1
        or not (hertz.size or seconds.size)
    ):
        raise ConfigError(
            f"{hertz.size} frequencies, {real.size} storage and {imaginary.size} loss moduli; "
            "give as many of each"
        )
    if seconds.shape != relaxed.shape:
        raise ConfigError(
            f"{seconds.size} times and {relaxed.size} moduli of relaxation; give as many of each"
        )
    if min(np.concatenate([hertz, real, imaginary, relaxed]), default=1.0) <= 0 or (seconds < 0).any():
        raise ConfigError("frequencies and dynamic moduli must be positive; drop the rows that are not")
    taus = np.asarray(times, float)
    of_storage, of_loss = _of_frequency(hertz, taus)
    rows = np.vstack(
        [of_storage / real[:, None], of_loss / imaginary[:, None], _of_time(seconds, taus) / relaxed[:, None]]
    )
    moduli, distance = nnls(rows, np.ones(len(rows)))
    covariance, undetermined = _uncertainty(rows, moduli, distance)
    misfit = float(distance / np.sqrt(len(rows)))
    return PronyFit(taus, moduli[:-1], float(moduli[-1]), misfit, covariance, undetermined)


def _uncertainty(rows: FloatArray, moduli: FloatArray, distance: float) -> tuple[FloatArray, int]:
    """Covariance of the moduli, and how many combinations are not determined."""
    covariance, kept = np.zeros((len(moduli), len(moduli))), np.flatnonzero(moduli > 0)
    scaled = rows[:, kept] * moduli[kept]
    _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    variance = distance**2 / max(len(rows) - len(kept), 1)
    safe = np.maximum(singular, 1e-12 * singular.max())
    shares = (directions.T / safe**2) @ directions * variance
    covariance[np.ix_(kept, kept)] = shares * np.outer(moduli[kept], moduli[kept])
    return covariance, int((np.sqrt(variance) > LOST * safe).sum())


def _of_frequency(frequency: ArrayLike, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Storage and loss for moduli of one, (n_frequencies, n_terms + 1); the last column is the long term."""
    x = 2 * np.pi * np.asarray(frequency, float)[..., None] * times
    one = np.ones((*x.shape[:-1], 1))
    return np.hstack([x**2 / (1 + x**2), one]), np.hstack([x / (1 + x**2), 0 * one])


def _of_time(time: ArrayLike, times: FloatArray) -> FloatArray:
    decay = np.exp(-np.asarray(time, float)[..., None] / times)
    return np.hstack([decay, np.ones((*decay.shape[:-1], 1))])
