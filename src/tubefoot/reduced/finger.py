"""A reduced finger of any number of units: its answers, its equilibria, and what a pump makes of it.

A wall whose moduli are g times the identified ones answers M = g M_1(phi, p / g), V = V_1(phi, p / g): the
energy scales with the moduli, and so do moments and pressures.

Fluid: what is filled into a branch goes to its chamber and to its trapped-air column,
filled_i = V_i(phi, p) + A_i p_i / (p_atm + p_i) (isothermal). The cyclic pump fills (+q, -q).
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.reduced.chain import Chain, FingerRange, Response
from tubefoot.reduced.law import UnitLaw
from tubefoot.units import ATMOSPHERE_MPA, DEG, KPA, ML

FloatArray = NDArray[np.float64]

PUMP = np.array([1.0, -1.0])
"""What the cyclic pump brings into the right and the left branch for each volume pumped."""
PUMP_STRIDE = 500.0
"""Largest change of the pumped volume in one iteration [mm^3]."""
MOST_ITERATIONS = 80
TOLERANCE = 1e-11
"""Of angles [rad] and of filled volumes over the largest one."""
LARGEST_TURN = 0.05
"""Of a unit in one iteration [rad]."""
LARGEST_PRESSURE_STEP = 0.03
"""In one iteration, at scale one [MPa]."""
LOWEST_PRESSURE = -0.999 * ATMOSPHERE_MPA
"""Gauge pressure under which no equilibrium is looked for [MPa]: the fluid cavitates."""


@dataclass(frozen=True)
class Equilibrium:
    """A state at rest.

    angles : (n,) of the units [rad]; pressures : (2,) right and left [MPa]; volumes : (2,) changes [mm^3]
    """

    angles: FloatArray
    pressures: FloatArray
    volumes: FloatArray

    @property
    def bend(self) -> float:
        """Turn of the tip [rad], positive towards the left chamber."""
        return float(self.angles.sum())


@dataclass(frozen=True)
class ReducedFinger:
    """A finger as a chain of units.

    name : of the design; n_units : number of units; pitch, cap : length of a unit, of an end cap [mm]
    inner, base, tip : law of a unit, what the ends add; valid : where the laws hold, unscaled
    half_width, height : middle line to the outside of a crest; size across the bending plane [mm]
    unit_mass, cap_mass : of wall and fluid of a unit, of a cap [t]
    shear_compliance : shift of a unit's upper end by shear force, unscaled, for its shape only [mm/N]
    scale : stiffness of the wall over the identified one
    """

    name: str
    n_units: int
    pitch: float
    cap: float
    inner: UnitLaw
    base: UnitLaw
    tip: UnitLaw
    valid: FingerRange
    half_width: float
    height: float
    unit_mass: float
    cap_mass: float
    shear_compliance: float = 0.0
    scale: float = 1.0
    chain: Chain = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not 1 <= self.n_units <= 48:
            raise ConfigError(f"a reduced finger has 1 to 48 units, not {self.n_units}")
        _check_scale(self.scale)
        chain = Chain(self.n_units, self.inner, self.base, self.tip, self.valid)
        object.__setattr__(self, "chain", chain)

    @property
    def length(self) -> float:
        """Length at rest, caps included [mm]."""
        return self.n_units * self.pitch + 2 * self.cap

    def with_units(self, n_units: int) -> ReducedFinger:
        """The same finger with another number of units.

        n_units : 1 to 48
        """
        return replace(self, n_units=n_units)

    def with_scale(self, scale: float) -> ReducedFinger:
        """The same finger with a stiffer or softer wall.

        scale : moduli over the identified ones
        """
        _check_scale(scale)
        scaled = copy(self)
        object.__setattr__(scaled, "scale", scale)
        return scaled

    def respond(self, angles: FloatArray, pressures: FloatArray) -> Response:
        """The answer at a state; see `Response`.

        angles : (n,) of the units [rad]; pressures : (2,) right and left, gauge [MPa]
        """
        if self.scale == 1.0:
            return self.chain.respond(angles, pressures)
        g = self.scale
        found = self.chain.respond(angles, np.asarray(pressures) / g)
        return Response(
            g * found.moments,
            g * found.stiffness,
            found.volumes,
            found.compliance / g,
            found.coupling,
            g * found.energy,
        )

    def check_range(self, angles: FloatArray, pressures: FloatArray) -> None:
        """Raise ConfigError when a state lies outside of what was identified.

        angles : (n,) [rad]; pressures : (2,) [MPa]
        """
        worst = float(np.abs(angles).max())
        if worst > self.valid.angle:
            raise ConfigError(
                f"a unit's angle of {worst / DEG:.2f} deg is outside of the {self.valid.angle / DEG:.2f} deg "
                f"that `{self.name}` was identified for; bend less, or reduce with a larger --pressure-kpa"
            )
        low, high = self.scale * self.valid.pressure_low, self.scale * self.valid.pressure_high
        for hand, pressure in zip(("right", "left"), pressures, strict=True):
            if not low <= pressure <= high:
                raise ConfigError(
                    f"{hand} pressure {pressure / KPA:.2f} kPa is outside of {low / KPA:.2f} to "
                    f"{high / KPA:.2f} kPa that `{self.name}` was identified for at stiffness scale "
                    f"{self.scale:g}; stay within, or reduce with a larger --pressure-kpa"
                )

    @property
    def unit_stiffness(self) -> float:
        """Bending stiffness of an inner unit at rest, at fixed pressures [N mm/rad]."""
        middle = replace(self, n_units=3).respond(np.zeros(3), np.zeros(2))
        return float(middle.stiffness[1])

    def free_bending(self, pressures: FloatArray, moments: FloatArray | float = 0.0) -> Equilibrium:
        """Angles at given pressures.

        pressures : (2,) right and left, gauge [MPa]; moments : (n,) from outside [N mm]

        Raises ConvergenceError when no angles hold the moments.
        """
        given = np.asarray(pressures, dtype=float)
        angles = np.zeros(self.n_units)
        for _ in range(MOST_ITERATIONS):
            found = self.respond(angles, given)
            unbalanced = np.asarray(moments) - found.moments
            if np.abs(unbalanced).max() < TOLERANCE * float(np.abs(found.stiffness).max()):
                return Equilibrium(angles, given, found.volumes)
            angles = angles + np.clip(unbalanced / found.stiffness, -LARGEST_TURN, LARGEST_TURN)
        raise ConvergenceError(
            f"no angles of `{self.name}` are in equilibrium at {given[0] / KPA:.2f} kPa right and "
            f"{given[1] / KPA:.2f} kPa left; lower the pressures or the load"
        )

    def equilibrium(
        self,
        filled: FloatArray,
        air: FloatArray | tuple[float, float] = (0.0, 0.0),
        moments: FloatArray | float = 0.0,
        start: Equilibrium | None = None,
    ) -> Equilibrium:
        """Angles and pressures at rest with given amounts of fluid.

        filled : (2,) fluid brought into the right and left branch [mm^3]; the pump brings (+q, -q)
        air : (2,) trapped-air columns at zero gauge [mm^3]; moments : (n,) from outside [N mm]
        start : a state nearby

        Raises ConvergenceError when there is none above absolute vacuum.
        """
        target, columns = np.asarray(filled, dtype=float), np.asarray(air, dtype=float)
        angles = np.zeros(self.n_units) if start is None else start.angles
        pressures = np.zeros(2) if start is None else start.pressures
        scale = max(float(np.abs(target).max()), 1.0)
        for _ in range(MOST_ITERATIONS):
            found = self.respond(angles, pressures)
            missing = target - found.volumes - columns * pressures / (ATMOSPHERE_MPA + pressures)
            unbalanced = np.asarray(moments) - found.moments
            settled = np.abs(unbalanced).max() < TOLERANCE * float(np.abs(found.stiffness).max())
            if settled and np.abs(missing).max() < TOLERANCE * scale:
                return Equilibrium(angles, pressures, found.volumes)
            softened = found.coupling / found.stiffness
            step = np.linalg.solve(
                _fluid_compliance(found, columns, pressures), missing - softened @ unbalanced
            )
            turn = (unbalanced + step @ found.coupling) / found.stiffness
            share = _allowed_share(pressures, step, turn, LARGEST_PRESSURE_STEP * self.scale)
            pressures, angles = pressures + share * step, angles + share * turn
        raise ConvergenceError(
            f"no equilibrium of `{self.name}` with {target[0] / ML:.4g} ml filled right and "
            f"{target[1] / ML:.4g} ml left: its pressures run to {pressures[0] / KPA:.1f} and "
            f"{pressures[1] / KPA:.1f} kPa; pump less"
        )

    def pumped_volume_for(self, bend: float, air: FloatArray | tuple[float, float] = (0.0, 0.0)) -> float:
        """Volume to pump from the left into the right branch for a bend angle [mm^3].

        bend : wanted [rad]; air : (2,) trapped-air columns at zero gauge [mm^3]

        Raises ConfigError when the bend is outside of the identified range, ConvergenceError when the
        pressures for it lie under absolute vacuum.
        """
        most = self.n_units * self.valid.angle
        if abs(bend) > most:
            raise ConfigError(
                f"a bend of {bend / DEG:.1f} deg is outside of the {most / DEG:.1f} deg that the "
                f"{self.n_units} units of `{self.name}` were identified for; bend less"
            )
        volume, columns = 0.0, np.asarray(air, dtype=float)
        state = self.equilibrium(np.zeros(2), air)
        for _ in range(MOST_ITERATIONS):
            if abs(state.bend - bend) < 1e-9:
                return volume
            found = self.respond(state.angles, state.pressures)
            slope = np.linalg.solve(_fluid_compliance(found, columns, state.pressures), PUMP)
            gain = float(((slope @ found.coupling) / found.stiffness).sum())
            volume += float(np.clip((bend - state.bend) / gain, -PUMP_STRIDE, PUMP_STRIDE))
            state = self.equilibrium(volume * PUMP, air, start=state)
        raise ConvergenceError(f"no pumped volume bends `{self.name}` by {bend / DEG:.1f} deg")


def _check_scale(scale: float) -> None:
    if not 0.05 <= scale <= 20.0:
        raise ConfigError(f"stiffness scale {scale:g} of a reduced finger: allowed are 0.05 to 20")


def _fluid_compliance(found: Response, columns: FloatArray, pressures: FloatArray) -> FloatArray:
    """d filled / d pressure with the angles following, (2, 2) [mm^3/MPa]."""
    chambers = found.compliance + (found.coupling / found.stiffness) @ found.coupling.T
    return np.asarray(chambers + np.diag(columns * ATMOSPHERE_MPA / (ATMOSPHERE_MPA + pressures) ** 2))


def _allowed_share(pressures: FloatArray, step: NDArray[Any], turn: NDArray[Any], largest: float) -> float:
    """Share of a Newton step that stays small and above absolute vacuum."""
    share = min(
        1.0,
        largest / max(float(np.abs(step).max()), 1e-300),
        LARGEST_TURN / max(float(np.abs(turn).max()), 1e-300),
    )
    for pressure, change in zip(pressures, step, strict=True):
        if pressure + share * change < LOWEST_PRESSURE:
            share = 0.5 * (LOWEST_PRESSURE - pressure) / change
    return float(share)
