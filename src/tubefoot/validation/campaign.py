"""A bench campaign: what is pumped, in which order, how often, and where it ends; a TOML file.

Blocks of one repeat follow each other: `load` pumps away from neutral in pulses until a pressure is reached,
`unload` pumps back until the pressures are equal again, `hold` waits. Reversal is loading the other side.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings
from tubefoot.errors import ConfigError
from tubefoot.lab.settings import RigSettings


class Block(Settings):
    """One part of a repeat."""

    kind: Literal["load", "unload", "hold"]
    """pump away from neutral, back to it, or wait"""
    side: Literal["right", "left"] = "right"
    """whose chamber is pressed by `load`; `unload` finds its way by the pressures"""
    until_kpa: float = Field(default=35.0, gt=0, le=100)
    """load: settled pressure of the pressed branch at which the block ends"""
    duty: float = Field(default=0.4, gt=0, le=1)
    """share of full speed"""
    pulse_s: float = Field(default=0.1, ge=0.005, le=5)
    """length of a pulse"""
    most_pulses: int = Field(default=60, ge=1, le=1000)
    """the block ends after so many, whatever the pressure"""
    seconds: float = Field(default=0.0, ge=0, le=36000)
    """hold: how long"""

    @model_validator(mode="after")
    def _holds_for_a_time(self) -> Block:
        if (self.kind == "hold") != (self.seconds > 0):
            raise ValueError("`seconds` goes with kind = hold, above 0, and with no other kind")
        return self


class Campaign(Settings):
    """All that a campaign does."""

    name: str = Field(min_length=1)
    """in recordings and reports"""
    rest_s: float = Field(default=5.0, ge=1.0, le=3600)
    """with the pump standing before the first pulse: the baseline"""
    settle_s: float = Field(default=1.0, ge=0.2, le=600)
    """pause after each pulse"""
    repeats: int = Field(default=3, ge=1, le=1000)
    """how often the blocks are run"""
    pressure_high_kpa: float = Field(default=45.0, gt=0, le=100)
    """a pulse is cut short when a branch exceeds it, and its block ends"""
    pressure_low_kpa: float = Field(default=-55.0, ge=-100, lt=0)
    """the same for suction"""
    blocks: tuple[Block, ...] = Field(min_length=1)
    """of one repeat, in order"""

    @model_validator(mode="after")
    def _can_reach(self) -> Campaign:
        for number, block in enumerate(self.blocks, start=1):
            if block.kind == "load" and block.until_kpa >= self.pressure_high_kpa:
                raise ValueError(
                    f"block {number} loads to until_kpa = {block.until_kpa:g}, but pressure_high_kpa = "
                    f"{self.pressure_high_kpa:g} cuts it short; raise the limit or lower the goal"
                )
        return self

    @property
    def fingerprint(self) -> str:
        """Hash of all settings, by which an interrupted campaign is known again."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def demand_within(self, rig: RigSettings) -> None:
        """Raise ConfigError where a block asks for more than the rig allows.

        rig : its settings
        """
        limits = rig.limits
        for number, block in enumerate(self.blocks, start=1):
            for key, value, most, limit in (
                ("duty", block.duty, limits.duty_max, "limits.duty_max"),
                ("pulse_s", block.pulse_s, limits.pulse_max_s, "limits.pulse_max_s"),
            ):
                if block.kind != "hold" and value > most:
                    raise ConfigError(
                        f"block {number} of campaign `{self.name}`: {key} = {value:g} exceeds the {most:g} "
                        f"of this rig; lower it, or edit {limit} in the rig file"
                    )
        for key, ours, theirs in (
            ("pressure_high_kpa", self.pressure_high_kpa, limits.pressure_high_kpa),
            ("pressure_low_kpa", -self.pressure_low_kpa, -limits.pressure_low_kpa),
        ):
            if ours >= theirs:
                raise ConfigError(
                    f"campaign `{self.name}`: {key} lies at or beyond limits.{key} of the rig, where the "
                    "board stops and latches a fault; keep some kPa clear of it"
                )


def load_campaign(path: Path | str) -> Campaign:
    """The campaign in a TOML file.

    path : the file

    Raises ConfigError when it is missing or cannot be run.
    """
    return load_settings(path, Campaign)
