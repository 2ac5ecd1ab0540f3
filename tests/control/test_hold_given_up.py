"""A hold of our controller is given up for a better one early on, later only where it leaves the band."""

import numpy as np
import pytest
from tests.control.bends import reference_law

from tubefoot.control import adaptive
from tubefoot.control.adaptive import AdaptiveController
from tubefoot.control.contract import Finished, Measurement, Wait
from tubefoot.control.foresight import EDGES_S, Paths
from tubefoot.control.hold_plan import HoldPlan
from tubefoot.lab.settings import PumpSettings
from tubefoot.units import DEG, KPA


def seen(time, bend_deg):
    return Measurement(time, time - 0.05, bend_deg * DEG, 1e-4, (0.0, 0.0), 0.0, time, 0)


def said(monkeypatch, *, since, off_deg, further_s, before_deg=0.1):
    """What the controller says so long into a hold when the finger will stay off its target.

    further_s : what another pulse and hold would cost; before_deg : error of the hold so far
    """
    holding = AdaptiveController(30 * DEG, reference_law(), PumpSettings(), 80 * KPA)
    monkeypatch.setattr(holding.crowd, "observe", lambda seen: None)
    monkeypatch.setattr(holding.crowd, "present", lambda seen: None)
    stays = np.full((1, len(EDGES_S)), (30.0 - off_deg) * DEG)
    monkeypatch.setattr(adaptive, "foresee", lambda *given: Paths(stays, 0.0 * stays))
    plan = HoldPlan(0.1, 1, 0.0, 0.05, 0.0, further_s)
    monkeypatch.setattr(holding, "_plan", lambda seen: (None, plan))
    monkeypatch.setattr(holding, "_due", lambda seen: Wait("given up"))
    holding._goal.begin_hold(seen(0.05, 30.0 - before_deg))
    holding._look_at = 0.0
    return holding.decide(seen(since + 0.05, 30.0 - before_deg))


@pytest.mark.parametrize(
    ("since", "off_deg", "further_s", "note"),
    [
        (0.2, 0.1, 0.0, "hold"),  # a good one
        (0.2, 0.6, 1.0, "given up"),
        (0.2, 0.6, 9.0, "hold"),  # a pulse would cost more than it mends
        (1.5, 0.6, 0.1, "hold"),  # too late for another
        (1.5, 0.97, 9.0, "given up"),  # it leaves the band
    ],
)
def test_a_hold_is_given_up_for_a_better_one(monkeypatch, since, off_deg, further_s, note):
    assert said(monkeypatch, since=since, off_deg=off_deg, further_s=further_s).note == note


def test_what_was_seen_of_the_hold_counts(monkeypatch):
    """The same rest: worth another pulse only where the begin was bad too."""
    kept = said(monkeypatch, since=0.9, off_deg=0.4, further_s=2.0, before_deg=0.1)
    lost = said(monkeypatch, since=0.9, off_deg=0.4, further_s=2.0, before_deg=0.9)
    assert (kept.note, lost.note) == ("hold", "given up")


def test_the_time_that_was_held_counts(monkeypatch):
    early = said(monkeypatch, since=0.1, off_deg=0.5, further_s=4.5, before_deg=0.5)
    late = said(monkeypatch, since=0.95, off_deg=0.5, further_s=4.5, before_deg=0.5)
    assert (early.note, late.note) == ("given up", "hold")


def test_a_hold_ends_well_after_two_seconds(monkeypatch):
    assert said(monkeypatch, since=2.01, off_deg=0.1, further_s=0.0) == Finished(True, "settled")
