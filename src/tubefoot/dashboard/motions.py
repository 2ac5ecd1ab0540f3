"""Closed-loop motions that the page can order: to an angle, or along a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from tubefoot.config import Settings
from tubefoot.control.choice import step_controller, volume_foreseen
from tubefoot.control.contract import Controller
from tubefoot.control.creep import CreepLaw
from tubefoot.control.loop import BendLoop, Motion
from tubefoot.control.settings import BendSettings
from tubefoot.control.tracking import TrackingController
from tubefoot.control.trajectory import Trajectory, load_trajectory, trajectory_of
from tubefoot.dashboard.logbook import kept_text
from tubefoot.dashboard.watched_rig import WatchedRig
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.units import DEG

if TYPE_CHECKING:
    from tubefoot.dashboard.session import Session

SINE_POINTS = 48
"""Points of a period of a sine."""
TABLE_CHARACTERS = 1_000_000


@dataclass(frozen=True)
class FingerPlans:
    """What the controllers know of the finger.

    law : of its creep; settings : of the controllers; largest : bend it was identified for [rad]
    """

    law: CreepLaw
    settings: BendSettings
    largest: float

    def demand_within(self, bend: float) -> None:
        """Raise ConfigError for a bend that the finger is not known at.

        bend : wanted [rad]
        """
        if abs(bend) > self.largest:
            raise ConfigError(
                f"{bend / DEG:g} deg is outside of the {self.largest / DEG:.0f} deg that the finger's model "
                "was identified for; bend less, or give another --model"
            )


class BendOrder(Settings):
    """Bend to an angle."""

    do: Literal["bend"]
    target_deg: float = Field(ge=-120, le=120)
    """wanted bend"""
    controller: Literal["paper", "adaptive"] = "adaptive"
    """which"""

    kind: ClassVar[str] = "bend"

    @property
    def text(self) -> str:
        """For people."""
        return f"bend to {self.target_deg:g} deg ({self.controller})"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        plans, target = session.plans, self.target_deg * DEG
        plans.demand_within(target)
        steps = step_controller(self.controller, plans.law, session.bench.rig.settings, plans.settings)
        steps.aim(target)
        motion = _moved(session, rig, steps, volume_foreseen(plans.law, target), True)
        return f"{motion.reason} after {motion.pulses} pulses, {motion.ended - motion.began:.1f} s"


class FollowOrder(Settings):
    """Follow a sine, or a table of time_s and bend_deg."""

    do: Literal["follow"]
    amplitude_deg: float = Field(default=15.0, ge=-120, le=120)
    """of the sine"""
    period_s: float = Field(default=20.0, ge=2, le=600)
    """of the sine"""
    cycles: int = Field(default=2, ge=1, le=100)
    """of the sine"""
    table: str = Field(default="", max_length=TABLE_CHARACTERS)
    """CSV to be followed instead of the sine"""

    kind: ClassVar[str] = "follow"

    @property
    def text(self) -> str:
        """For people."""
        if self.table:
            return "follow a table (tracking)"
        return f"follow a sine of {self.amplitude_deg:g} deg, {self.period_s:g} s (tracking)"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        trajectory = self.trajectory(session.log.directory)
        plans = session.plans
        plans.demand_within(float(abs(trajectory.bends).max()))
        pump = session.bench.rig.settings.pump
        tracking = TrackingController(trajectory, plans.law, pump, plans.settings.tracking)
        motion = _moved(session, rig, tracking, math.inf, False)
        return f"{motion.reason}, {motion.ended - motion.began:.1f} s"

    def trajectory(self, directory: Path) -> Trajectory:
        """Where to be when.

        directory : a table is kept there
        """
        if self.table:
            return load_trajectory(kept_text(directory, "trajectory", ".csv", self.table))
        count = SINE_POINTS * self.cycles
        turns = [number / SINE_POINTS for number in range(count + 1)]
        return trajectory_of(
            [(self.period_s * turn, self.amplitude_deg * math.sin(math.tau * turn)) for turn in turns]
        )


def _moved(session: Session, rig: WatchedRig, controller: Controller, volume: float, timed: bool) -> Motion:
    """A motion that has settled, its trace kept; raises ConvergenceError for one that has not."""
    bench = session.bench
    if bench.angles is None:
        raise ConfigError("closed loop needs the camera: start the dashboard with --camera camera.toml")
    session.target_at = controller.target_at
    loop = BendLoop(rig, bench.angles, session.plans.settings, session.log.recorder)
    session.log.angles_by_other = True
    try:
        motion = loop.run(controller, volume, controller.name, timed)
    finally:
        session.log.angles_by_other = False
    session.log.trace(motion.rows)
    if not motion.settled:
        raise ConvergenceError(motion.reason)
    return motion
