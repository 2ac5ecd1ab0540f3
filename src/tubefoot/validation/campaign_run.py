"""Running a campaign on a bench, real or virtual: pulse, watch, record, and go on where it was interrupted.

While anything waits, frames are read and samples taken in; both go into the recording. The pump stands
between pulses, and whatever ends the run. After each repeat the ledger is written, so that the same command
goes on with the repeat that was interrupted, after pumping the finger back to neutral.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tubefoot.errors import ConfigError, LinkError, SafetyStop
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.rig import FORWARD, REVERSE, Neutral, Rig
from tubefoot.records import write_json
from tubefoot.units import KPA
from tubefoot.validation.campaign import Block, Campaign
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.camera import StaleFrameError

LEDGER = "campaign.json"
LOOK_S = 0.05
"""How often the pressures are looked at without a camera [s]."""
BACK = 1.0 * KPA
"""Difference of the pressures at which the finger counts as back at neutral [MPa]."""
SHORTEST_SHARE = 0.25
"""Near neutral, pulses are shortened down to this share."""
HOMING = Block(kind="unload", duty=0.4, pulse_s=0.1, most_pulses=100)
"""How a finger that was left pumped is brought back."""


@dataclass
class Ledger:
    """What of a campaign is done.

    fingerprint : of the campaign; repeats : that were finished; recordings : files of all sessions
    neutral : first reading at rest, gauge, right and left [kPa]
    """

    fingerprint: str
    repeats: int = 0
    recordings: list[str] = field(default_factory=list)
    neutral: list[float] = field(default_factory=list)

    @classmethod
    def opened(cls, directory: Path, campaign: Campaign) -> Ledger:
        """The ledger in a directory, a new one where there is none.

        directory : of the run; campaign : that is to be run

        Raises ConfigError when the directory holds another campaign.
        """
        path = directory / LEDGER
        if not path.exists():
            return cls(campaign.fingerprint)
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if found.get("fingerprint") != campaign.fingerprint:
            raise ConfigError(
                f"{path} belongs to another campaign, or to other settings of `{campaign.name}`; "
                "name another --out"
            )
        return cls(found["fingerprint"], found["repeats"], found["recordings"], found["neutral"])

    def write(self, directory: Path) -> None:
        """Write it, in one step.

        directory : of the run
        """
        write_json(directory / LEDGER, vars(self))


class CampaignRun:
    """One session of a campaign on a connected rig whose neutral was measured."""

    def __init__(
        self,
        campaign: Campaign,
        rig: Rig,
        recorder: Recorder,
        angles: AngleSource | None = None,
        say: Callable[[str], None] = print,
    ):
        """Take the bench.

        campaign : what to do
        rig, recorder : connected, and recording
        angles : open source of angles; None records pressures only
        say : told of every block
        """
        self._campaign = campaign
        self._rig = rig
        self._recorder = recorder
        self._angles = angles
        self._say = say

    def run(self, ledger: Ledger, directory: Path, units: int | None = None) -> None:
        """Do what is left of the campaign.

        ledger : what was done before; kept up to date
        directory : where the ledger is written
        units : of the finger, for the record

        Raises SafetyStop when the board stops the pump, LinkError when bench or camera are lost.
        """
        campaign = self._campaign
        self._note("campaign", title=campaign.name, units="" if units is None else str(units))
        self._rest(ledger)
        ledger.recordings.append(self._recorder.path.name)
        ledger.write(directory)
        while ledger.repeats < campaign.repeats:
            number = ledger.repeats + 1
            for place, block in enumerate(campaign.blocks, start=1):
                self._note("block", repeat=str(number), block=str(place), kind=block.kind)
                reached = self._run_block(block)
                self._say(
                    f"repeat {number}/{campaign.repeats}, block {place}/{len(campaign.blocks)}: "
                    f"{block.kind} {reached}"
                )
            ledger.repeats = number
            ledger.write(directory)
        self._watch(campaign.settle_s)

    def _rest(self, ledger: Ledger) -> None:
        """Record the rest; in a later session first bring a finger back that was left pumped."""
        gauge = self._rig.read().gauge_pressures[:2]
        if not ledger.neutral:
            ledger.neutral = [pressure / KPA for pressure in gauge]
        else:
            away = max(abs(now - then * KPA) for now, then in zip(gauge, ledger.neutral, strict=True))
            if away > BACK:
                self._say(f"the finger was left {away / KPA:.1f} kPa from neutral; pumping back")
                before = tuple(pressure * KPA for pressure in ledger.neutral)
                self._rig.set_neutral(Neutral(before, (0.0, 0.0), 1))
                self._rig.wait(LOOK_S)  # the next reading is the first that counts from there
                self._run_block(HOMING)
        self._watch(self._campaign.rest_s)

    def _run_block(self, block: Block) -> str:
        """Do a block; how it ended, as text."""
        if block.kind == "hold":
            self._watch(block.seconds)
            return f"{block.seconds:g} s"
        pulses, reason = 0, "most_pulses reached"
        begun_at = self._difference()
        while pulses < block.most_pulses:
            way, share = self._next(block, begun_at)
            if way == 0:
                reason = "goal reached"
                break
            pulses += 1
            if not self._pulse(way, block.duty, max(share * block.pulse_s, 0.005)):
                reason = "pressure limit of the campaign"
                break
        right, left = (pressure / KPA for pressure in self._rig.read().pressures[:2])
        return f"{pulses} pulses, {reason}; right {right:.1f} kPa, left {left:.1f} kPa"

    def _next(self, block: Block, begun_at: float) -> tuple[int, float]:
        """Direction of the next pulse, 0 where the goal is reached, and its share of a whole one."""
        if block.kind == "load":
            way = FORWARD if block.side == "right" else REVERSE
            pressed = self._rig.read().pressures[0 if way == FORWARD else 1]
            return (0, 0.0) if pressed >= block.until_kpa * KPA else (way, 1.0)
        difference = self._difference()
        if abs(difference) < BACK or difference * begun_at < 0:
            return 0, 0.0
        # The last pulses get shorter: one too many would bend the finger the other way.
        share = min(1.0, max(SHORTEST_SHARE, abs(difference) / (10.0 * BACK)))
        return (REVERSE if difference > 0 else FORWARD), share

    def _difference(self) -> float:
        right, left = self._rig.read().pressures[:2]
        return right - left

    def _pulse(self, way: int, duty: float, duration: float) -> bool:
        """Whether a pulse and its pause passed within the campaign's limits."""
        rig = self._rig
        sent = rig.pulse(way, duty, duration)
        fine, end = True, rig.clock.now() + sent.duration
        while rig.clock.now() < end:
            self._look()
            if fine and not self._within():
                rig.stop()
                fine = False
        self._watch(self._campaign.settle_s)
        if rig.faults:
            raise SafetyStop(
                "the board stopped the pump; clear the cause and give the same command again", int(rig.faults)
            )
        return fine

    def _within(self) -> bool:
        low, high = self._campaign.pressure_low_kpa * KPA, self._campaign.pressure_high_kpa * KPA
        return all(low <= pressure <= high for pressure in self._rig.read().pressures[:2])

    def _watch(self, seconds: float) -> None:
        """Let time pass, taking in samples and frames."""
        end = self._rig.clock.now() + seconds
        while self._rig.clock.now() < end:
            self._look()

    def _look(self) -> None:
        """One frame and what samples came meanwhile; without a camera, samples only."""
        if self._angles is None:
            self._rig.wait(LOOK_S)
            return
        try:
            seen = self._angles.read()
        except StaleFrameError:
            self._rig.wait(0.0)
            return
        except LinkError as error:
            raise LinkError(
                f"{error}; the campaign stops: give the same command again to go on with this repeat"
            ) from error
        self._recorder.angle(seen.time_s, self._rig.clock.now(), seen.columns(), seen.fault)
        self._rig.wait(0.0)

    def _note(self, name: str, **detail: str) -> None:
        self._recorder.event(self._rig.clock.now(), name, **detail)
