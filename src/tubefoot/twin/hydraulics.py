"""The closed loop of fluid: two branches with trapped air, two tubes, two chambers, no valve.

The state is where the liquid is: l of each branch and chamber, the change since rest [mm^3]. Pressures follow
from it, gauge, isothermal (Boyle), theta being the absolute temperature over that at rest:

    branch   l_b = A - theta a p0 / (p0 + p_b)                    A, a : trapped air at rest, and now
    chamber  l_c = w(p_R, p_L) + B - theta b p0 / (p0 + p_c)      w : of the walls; B, b : bubble
    tube     f = (p_b - p_c) / R
    pump     q - G (p_bR - p_bL), out of the left branch into the right one; G : leak through the rollers

Reversing needs no valve: q changes its sign. Every flow leaves one place and enters another with the same
number, so the sum of all liquid is kept to rounding, however well the pressures converged. A step is implicit
in tubes, air and walls (backward Euler): each branch is a quadratic, the two chambers are solved together by
Newton's method. Leaks, which are slow, take the pressures of the step before. The finger's walls are injected
(`finger_response.py`). Left out: the weight of the columns (0.1 kPa for 10 mm), inertia of the fluid.

MPa, mm^3, s; index 0 is the right side, 1 the left.
"""

from __future__ import annotations

from math import pi, sqrt

from tubefoot.errors import ConvergenceError
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.finger_response import FingerResponse
from tubefoot.units import ATMOSPHERE_MPA, KPA, ML

NUCLEUS = 1.0
"""Air that no filling removes, a microlitre in each chamber: at absolute vacuum it grows, as vapour does."""
TOLERANCE = 1e-6
"""Of the last correction of the chamber pressures [MPa]; what is left then is of the order of its square."""
MOST_ITERATIONS = 60
LEAST_RESISTANCE = 1e-9
"""Of a tube [MPa s/mm^3], a two-thousandth of the nominal one."""


class Side:
    """One branch with its tube and its chamber's bubble.

    air, bubble : gas of branch and chamber, as its volume at rest: zero gauge, first temperature [mm^3]
    in_branch, in_chamber : liquid that entered since the start [mm^3]
    lost : liquid that left through leaks, or by who holds the branch [mm^3]
    resistance : of the tube [MPa s/mm^3]; a blocked one is a large one
    leak : conductance of the branch to the surroundings [mm^3/(s MPa)]
    held : pressure that something outside holds (open to the air: 0), None where the branch is closed [MPa]
    """

    def __init__(self, air: float, bubble: float, resistance: float):
        """Fill one side, at rest and without pressure.

        air : trapped above the column [mm^3]
        bubble : in the chamber [mm^3]
        resistance : of the tube [MPa s/mm^3]
        """
        self.air = self.air_at_rest = air + NUCLEUS
        self.bubble = self.bubble_at_rest = bubble + NUCLEUS
        self.resistance = max(resistance, LEAST_RESISTANCE)
        self.in_branch = self.in_chamber = self.lost = self.leak = 0.0
        self.held: float | None = None

    def branch_pressure(self, temperature: float) -> float:
        """Gauge pressure of the branch [MPa].

        temperature : absolute, over that at rest
        """
        if self.held is not None:
            return self.held
        space = self.air_at_rest - self.in_branch
        return ATMOSPHERE_MPA * (temperature * self.air / space - 1.0)

    def entering(self, pressure: float, gas: float, supply: float, duration: float) -> tuple[float, float]:
        """Flow into the chamber [mm^3/s] and its change with the chamber's pressure, at the end of a step.

        pressure : of the chamber [MPa]
        gas : temperature times the pressure of the atmosphere [MPa]
        supply : volume that pump and leaks bring into the branch in the step [mm^3]
        duration : [s]
        """
        if self.held is not None:
            return (self.held - pressure) / self.resistance, -1.0 / self.resistance
        ease = duration / self.resistance
        half = 0.5 * (self.air_at_rest - self.in_branch - supply - ease * (ATMOSPHERE_MPA + pressure))
        root = sqrt(half * half + ease * self.air * gas)
        absolute = self.air * gas / (half + root) if half > 0 else (root - half) / ease
        slope = ease * absolute / (2.0 * root)
        return (absolute - ATMOSPHERE_MPA - pressure) / self.resistance, (slope - 1.0) / self.resistance

    def move(self, flow: float, supply: float, leaked: float, temperature: float, duration: float) -> None:
        """Move the liquid of a step.

        flow : into the chamber [mm^3/s]
        supply : volume brought into the branch, leaks taken off [mm^3]
        leaked : volume that left through the leak [mm^3]
        temperature : absolute, over that at rest
        duration : [s]
        """
        moved = duration * flow
        self.in_chamber += moved
        self.lost += leaked
        if self.held is None:
            self.in_branch += supply - moved
            return
        absolute = ATMOSPHERE_MPA + self.held
        inside = self.air_at_rest - temperature * self.air * ATMOSPHERE_MPA / absolute
        self.lost += supply - moved - (inside - self.in_branch)
        self.in_branch = inside


class Hydraulics:
    """The fluid of one finger.

    sides : right and left
    branch_pressure, chamber_pressure : gauge, right and left [MPa]
    temperature : absolute, over that at rest
    """

    def __init__(self, make: BenchSettings, finger: FingerResponse):
        """Fill the loop, at rest and without pressure.

        make : of the bench
        finger : how its chambers respond
        """
        branches, chambers = make.branches, make.finger
        tube = branches.tube_kpa_s_per_ml * KPA / ML
        self.finger = finger
        self.sides = (
            Side(branches.air_right_ml * ML, chambers.bubble_right_ml * ML, tube),
            Side(branches.air_left_ml * ML, chambers.bubble_left_ml * ML, tube),
        )
        self.branch_pressure = (0.0, 0.0)
        self.chamber_pressure = (0.0, 0.0)
        self.temperature = 1.0
        self._leak_back = make.pump.leak_back_ul_per_s_kpa / KPA
        self._bore_area = pi / 4 * branches.column_bore_mm**2
        self._level_at_rest = branches.column_level_mm
        self._trend = (0.0, 0.0)

    @property
    def liquid_error(self) -> float:
        """All liquid in the loop and lost from it, less what there was at the start: only rounding [mm^3]."""
        return sum(side.in_branch + side.in_chamber + side.lost for side in self.sides)

    @property
    def chamber_volumes(self) -> tuple[float, float]:
        """Liquid that entered the chambers since the start [mm^3]."""
        return self.sides[0].in_chamber, self.sides[1].in_chamber

    @property
    def column_levels(self) -> tuple[float, float]:
        """Level of the liquid in each visible column above its foot [mm]."""
        right, left = (self._level_at_rest + side.in_branch / self._bore_area for side in self.sides)
        return right, left

    def burst(self, side: int, share: float = 1.0) -> None:
        """Let air of a chamber's bubble escape through its tube into the air of the branch.

        side : 0 right, 1 left
        share : of the bubble
        """
        place = self.sides[side]
        moved = share * (place.bubble - NUCLEUS)
        place.bubble -= moved
        place.air += moved

    def step(self, duration: float, flow: float) -> None:
        """Move on.

        duration : [s]
        flow : of the pump's rollers, into the right branch [mm^3/s]

        Raises ConvergenceError when no pressures satisfy the balance.
        """
        (top_r, top_l), (right, left) = self.branch_pressure, self.sides
        pumped = duration * (flow - self._leak_back * (top_r - top_l))
        leaked_r = self._leaked(right, top_r, duration) if right.leak else 0.0
        leaked_l = self._leaked(left, top_l, duration) if left.leak else 0.0
        supply_r, supply_l = pumped - leaked_r, -pumped - leaked_l
        flow_r, flow_l = self._balance(duration, supply_r, supply_l)
        right.move(flow_r, supply_r, leaked_r, self.temperature, duration)
        left.move(flow_l, supply_l, leaked_l, self.temperature, duration)
        self.branch_pressure = (
            right.branch_pressure(self.temperature),
            left.branch_pressure(self.temperature),
        )
        self.finger.advance(*self.chamber_pressure, duration)

    def _leaked(self, side: Side, pressure: float, duration: float) -> float:
        """Liquid lost through a leak [mm^3]; below the surroundings' pressure it draws in air instead."""
        volume = duration * side.leak * pressure
        if volume >= 0:
            return volume
        side.air -= volume
        return 0.0

    def _balance(self, duration: float, supply_r: float, supply_l: float) -> tuple[float, float]:
        """Flows into the chambers [mm^3/s] at the end of the step; sets the chamber pressures."""
        (right, left), volumes = self.sides, self.finger.volumes
        gas = self.temperature * ATMOSPHERE_MPA
        old_r, old_l = self.chamber_pressure
        p_r, p_l = _above_vacuum(old_r, -self._trend[0]), _above_vacuum(old_l, -self._trend[1])
        for _ in range(MOST_ITERATIONS):
            wall_r, wall_l, rr, rl, ll = volumes(p_r, p_l, duration)
            flow_r, ease_r = right.entering(p_r, gas, supply_r, duration)
            flow_l, ease_l = left.entering(p_l, gas, supply_l, duration)
            bubble_r = right.bubble * gas / (ATMOSPHERE_MPA + p_r)
            bubble_l = left.bubble * gas / (ATMOSPHERE_MPA + p_l)
            miss_r = wall_r + right.bubble_at_rest - bubble_r - right.in_chamber - duration * flow_r
            miss_l = wall_l + left.bubble_at_rest - bubble_l - left.in_chamber - duration * flow_l
            rr += bubble_r / (ATMOSPHERE_MPA + p_r) - duration * ease_r
            ll += bubble_l / (ATMOSPHERE_MPA + p_l) - duration * ease_l
            det = rr * ll - rl * rl
            by_r, by_l = (miss_r * ll - miss_l * rl) / det, (miss_l * rr - miss_r * rl) / det
            p_r, p_l = _above_vacuum(p_r, by_r), _above_vacuum(p_l, by_l)
            if -TOLERANCE < by_r < TOLERANCE and -TOLERANCE < by_l < TOLERANCE:
                self._trend = (p_r - old_r, p_l - old_l)
                self.chamber_pressure = (p_r, p_l)
                return flow_r, flow_l
        raise ConvergenceError(
            f"hydraulics: no balance after {MOST_ITERATIONS} iterations, chambers at {p_r / KPA:.1f} and "
            f"{p_l / KPA:.1f} kPa; check volumes and stiffness in the bench's settings"
        )


def _above_vacuum(pressure: float, by: float) -> float:
    """The pressure less a correction, never further than half the way to absolute vacuum."""
    after, least = pressure - by, 0.5 * (pressure - ATMOSPHERE_MPA)
    return after if after > least else least
