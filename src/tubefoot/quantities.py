"""Units that data of other laboratories come in: a name in a header or a column map, and its factor.

Inside, everything is mm, N, s, MPa, rad (`units.py`); a factor multiplies on the way in.
"""

from __future__ import annotations

from difflib import get_close_matches
from math import pi

from tubefoot.errors import ConfigError

FACTORS: dict[str, dict[str, float]] = {
    "stress": {
        "mPa": 1e-9,
        "Pa": 1e-6,
        "hPa": 1e-4,
        "mbar": 1e-4,
        "kPa": 1e-3,
        "bar": 0.1,
        "MPa": 1.0,
        "N/mm2": 1.0,
        "GPa": 1e3,
        "psi": 6.894757293168e-3,
        "ksi": 6.894757293168,
        "mmHg": 1.33322387415e-4,
        "mmH2O": 9.80665e-6,
        "cmH2O": 9.80665e-5,
        "inH2O": 2.4908891e-4,
        "atm": 0.101325,
        "kgf/cm2": 0.0980665,
    },
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180, "°": pi / 180, "turn": 2 * pi},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "volume": {"mm3": 1.0, "ul": 1.0, "µl": 1.0, "ml": 1e3, "cm3": 1e3, "cc": 1e3, "l": 1e6},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "mHz": 1e-3, "MHz": 1e6, "rad/s": 0.5 / pi, "rpm": 1 / 60},
    "ratio": {"1": 1.0, "": 1.0, "-": 1.0, "%": 0.01, "percent": 0.01},
}
"""Quantities and their units; `stress` serves pressures as well."""


def factor(quantity: str, unit: str) -> float:
    """What a value in a unit is multiplied with to be in Tubefoot's own.

    quantity : a key of FACTORS; unit : its name, upper or lower case where that leaves no doubt

    Raises ConfigError for a unit that this quantity does not have.

    >>> factor("stress", "psi") * 5
    0.03447378646584
    """
    known = FACTORS[quantity]
    if unit in known:
        return known[unit]
    alike = [value for name, value in known.items() if name.lower() == unit.lower()]
    if len(set(alike)) == 1:
        return alike[0]
    near = get_close_matches(unit, known, n=1, cutoff=0.5)
    hint = f"; did you mean `{near[0]}`?" if near else ""
    names = ", ".join(name for name in known if name)
    raise ConfigError(f"`{unit}` is not a unit of {quantity} that is known here: {names}{hint}")
