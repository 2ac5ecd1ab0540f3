"""The controller that a user's word stands for, set up for a finger and a bench."""

from __future__ import annotations

from tubefoot.control.adaptive import AdaptiveController
from tubefoot.control.creep import CreepLaw
from tubefoot.control.paper import PaperController
from tubefoot.control.settings import BendSettings
from tubefoot.lab.settings import RigSettings
from tubefoot.units import DEG, KPA

LEAST_FORESEEN_DEG = 10.0
"""A small step is allowed the volume of one of this size before a leak is suspected."""


def step_controller(
    name: str, law: CreepLaw, rig: RigSettings, settings: BendSettings
) -> PaperController | AdaptiveController:
    """A controller for steps, aimed at 0 deg.

    name : `paper` or `adaptive`
    law : of the finger's creep
    rig : pump and limits of the bench
    settings : of controllers, goal and guard
    """
    if name == "paper":
        return PaperController(0.0, settings.goal, settings.paper)
    most = rig.rig_limits().pressure_high - settings.planned_margin_kpa * KPA
    return AdaptiveController(0.0, law, rig.pump, most, settings.goal, settings.adaptive)


def volume_foreseen(law: CreepLaw, turn: float) -> float:
    """Volume that a step should take at most [mm^3].

    law : of the finger's creep
    turn : how far it leads [rad], either way
    """
    return max(abs(turn), LEAST_FORESEEN_DEG * DEG) / law.gain
