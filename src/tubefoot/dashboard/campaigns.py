"""Campaigns from the page: a campaign file, or a table of pulses, run and recorded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from tubefoot.config import Settings
from tubefoot.dashboard.chores import begin_recording, end_recording
from tubefoot.dashboard.logbook import kept_text
from tubefoot.dashboard.watched_rig import WatchedRig
from tubefoot.errors import ConfigError
from tubefoot.lab.program import load_program, play

if TYPE_CHECKING:
    from tubefoot.dashboard.session import Session

TEXT_CHARACTERS = 1_000_000


class PlayOrder(Settings):
    """Run a campaign and record it, as `tubefoot rig record` does with --campaign and --pulses."""

    do: Literal["play"]
    table: str = Field(min_length=1, max_length=TEXT_CHARACTERS)
    """what is in the file"""
    form: Literal["csv", "toml"] = "csv"
    """pulses (CSV: time_s, direction, duty, duration_s), or a campaign (TOML)"""
    pictures: bool = True
    """whether camera frames are recorded"""

    kind: ClassVar[str] = "play"
    text: ClassVar[str] = "campaign"

    def run(self, session: Session, rig: WatchedRig) -> str:
        """What came of it.

        session : where it runs
        rig : to work with
        """
        if session.log.recorder is not None:
            raise ConfigError("a campaign makes a recording of its own; end the one that runs first")
        path = kept_text(session.log.directory, "campaign", f".{self.form}", self.table)
        return self._campaign(path, session, rig) if self.form == "toml" else self._pulses(path, session, rig)

    def _pulses(self, path: Path, session: Session, rig: WatchedRig) -> str:
        program = load_program(path)
        if not program:
            raise ConfigError("the table has no pulses")
        begin_recording(session, self.pictures)
        try:
            play(rig, program, lambda said: session.feed.tell(progress=said))
        finally:
            end_recording(session)
        return f"{len(program)} pulses done"

    def _campaign(self, path: Path, session: Session, rig: WatchedRig) -> str:
        """Run what is left of it; the same campaign, given again, goes on where it was interrupted."""
        from tubefoot.validation.campaign import load_campaign
        from tubefoot.validation.campaign_run import CampaignRun, Ledger

        campaign, bench, log = load_campaign(path), session.bench, session.log
        campaign.demand_within(bench.rig.settings)
        directory = log.directory / f"campaign-{campaign.fingerprint}"
        ledger = Ledger.opened(directory, campaign)
        if ledger.repeats >= campaign.repeats:
            return f"all {campaign.repeats} repeats of `{campaign.name}` were done before: {directory}"
        begin_recording(session, self.pictures, directory)
        log.angles_by_other = bench.angles is not None
        try:
            assert log.recorder is not None
            run = CampaignRun(
                campaign, rig, log.recorder, bench.angles, lambda said: session.feed.tell(progress=said)
            )
            run.run(ledger, directory)
        finally:
            log.angles_by_other = False
            end_recording(session)
        return f"`{campaign.name}`: {ledger.repeats} repeats done, {directory}"
