"""Ogden moduli and Prony terms as other programs write them; ours is W = sum 2 mu_i / alpha_i^2 (...).

| convention | energy of a term | initial shear modulus | used by |
| --- | --- | --- | --- |
| `tubefoot` | 2 mu / alpha^2 | sum mu | this program, Abaqus, CalculiX, FElupe |
| `classic` | mu / alpha | sum mu alpha / 2 | Ogden 1972, Ansys, Marc, COMSOL |
| `febio` | c / m^2 | sum c / 2 | FEBio, SOFA |

Prony terms are ours over the long-term modulus; Abaqus and Ansys write them over the instantaneous one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tubefoot.errors import ConfigError

CONVENTIONS = ("tubefoot", "classic", "febio")


def to_convention(mu: Sequence[float], alpha: Sequence[float], convention: str) -> list[float]:
    """Moduli in another convention [MPa]; the exponents stay.

    mu : ours [MPa]; alpha : exponents; convention : one of CONVENTIONS
    """
    return [float(value) for value in np.asarray(mu, float) * _ratio(alpha, convention)]


def from_convention(moduli: Sequence[float], alpha: Sequence[float], convention: str) -> list[float]:
    """Our moduli [MPa] from those of another convention.

    moduli : theirs [MPa]; alpha : exponents; convention : one of CONVENTIONS

    >>> from_convention([0.63, 0.0012, -0.01], [1.3, 5.0, -2.0], "classic")
    [0.4095, 0.003, 0.01]
    """
    return [float(f"{value:.12g}") for value in np.asarray(moduli, float) / _ratio(alpha, convention)]


def over_instantaneous(shares: Sequence[float]) -> list[float]:
    """Prony moduli over the instantaneous modulus, as Abaqus and Ansys want them.

    shares : ours, over the long-term modulus
    """
    return [float(share / (1.0 + sum(shares))) for share in shares]


def _ratio(alpha: Sequence[float], convention: str) -> np.ndarray:
    exponents = np.asarray(alpha, float)
    if convention == "tubefoot":
        return np.ones_like(exponents)
    if convention == "classic":
        return 2.0 / exponents
    if convention == "febio":
        return np.full_like(exponents, 2.0)
    raise ConfigError(f"no convention `{convention}` of the Ogden law; known: {', '.join(CONVENTIONS)}")
