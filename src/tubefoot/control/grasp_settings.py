"""Settings of a grasp: the pulses, when contact counts, how firm the grip, what follows."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tubefoot.config import Settings


class GraspPulses(Settings):
    """The paper's protocol: short pulses, each followed by a pause."""

    duty: float = Field(default=0.6, gt=0, le=1)
    """of every pulse"""
    outward_s: float = Field(default=0.3, gt=0, le=5)
    """duration of an outward pulse"""
    inward_s: float = Field(default=0.15, gt=0, le=5)
    """duration of an inward pulse"""
    pause_s: float = Field(default=0.5, ge=0.2, le=60)
    """pause after each pulse (the paper's)"""
    outward: int | None = Field(default=None, ge=0, le=100)
    """outward pulses; as many as the object needs if not given"""
    clearance_mm: float = Field(default=3.5, ge=0, le=50)
    """free width between each finger and the object when it is placed"""
    outward_max: int = Field(default=20, ge=1, le=100)
    """outward pulses at most"""
    inward_max: int = Field(default=40, ge=1, le=200)
    """inward pulses until contact at most; then there was nothing to grasp"""


class ContactSettings(Settings):
    """When a finger counts as touching; angles in degrees, summed over inward pulses."""

    shape_deg: float = Field(default=0.4, gt=0, le=20)
    """lag of theta1 behind what theta2 says of free bending, that alone makes contact sure"""
    pressure_deg: float = Field(default=0.4, gt=0, le=20)
    """lag of the bend angle behind what the pressures say"""
    both_share: float = Field(default=0.5, gt=0, le=1)
    """share of either that makes contact sure when both show it"""
    slack_deg: float = Field(default=0.1, ge=0, le=5)
    """lag in one pulse that free fingers show and that is not summed"""
    learnt_pulses: int = Field(default=4, ge=2, le=50)
    """inward pulses over which free bending is learnt"""


class GripSettings(Settings):
    """How firm the grip."""

    friction_min: float = Field(default=0.4, gt=0, le=3)
    """coefficient that the grip relies on, whatever the object's file says"""
    safety: float = Field(default=1.5, ge=1, le=20)
    """grip force over what friction needs to bear the weight"""
    damage_share: float = Field(default=0.5, gt=0, le=1)
    """of the force that the object bears, not exceeded by the grip"""
    pulses_max: int = Field(default=40, ge=1, le=200)
    """inward pulses after contact at most"""
    inward_s: float = Field(default=0.12, gt=0, le=5)
    """duration of a pulse after contact"""
    stalled_pulses: int = Field(default=8, ge=2, le=100)
    """pulses that add less than a twentieth of the wanted force: then more would only curl the fingers"""
    keep_s: float = Field(default=0.08, gt=0, le=5)
    """duration of a pulse that keeps the free object's place, or the force on it"""
    keep_share: float = Field(default=0.85, ge=0, le=1)
    """of the wanted force; below it the grip is made firmer while it holds"""
    keep_mm: float = Field(default=0.4, gt=0, le=50)
    """sideways drift of the free object from which on it is put back"""
    release: Literal["grip", "contact"] = "grip"
    """when the hand lets go: when the grip is firm, or at first contact as in the paper"""


class TrialSettings(Settings):
    """What follows the grip."""

    hold_s: float = Field(default=5.0, ge=0, le=3600)
    """hold after the hand has let go"""
    lift_mm: float = Field(default=30.0, ge=0, le=1000)
    """height of the lift"""
    lift_s: float = Field(default=3.0, gt=0, le=600)
    """duration of the lift"""
    shake_mm: float = Field(default=2.0, ge=0, le=100)
    """amplitude of the shaking, up and down and then sideways; none if 0"""
    shake_hz: float = Field(default=2.0, gt=0, le=20)
    """its frequency"""
    shake_s: float = Field(default=2.0, ge=0, le=600)
    """its duration, each way"""


class GraspSettings(Settings):
    """All settings of a grasp."""

    height_mm: float | None = Field(default=None, ge=1, le=500)
    """middle of the object above the outer face of the base; if not given, the top of what has an edge is
    level with the fingertips, and the middle of a round object 22 mm below them"""
    gap_mm: float = Field(default=8.0, ge=0, le=200)
    """between the facing crests of the straight fingers"""
    margin_kpa: float = Field(default=8.0, ge=0, le=50)
    """pulses are stopped so far before the rig's pressure limits; the motor runs on for some kPa"""
    patience_s: float = Field(default=30.0, gt=0, le=3600)
    """longest wait for pressures to relax, or for a lost marker"""
    pulses: GraspPulses = GraspPulses()
    contact: ContactSettings = ContactSettings()
    grip: GripSettings = GripSettings()
    test: TrialSettings = TrialSettings()
