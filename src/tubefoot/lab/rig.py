"""The Rig: what every bench, real, simulated or replayed, offers to those who measure and control.

Inside units: MPa, mm^3, s. Pumping forward presses fluid into the right chamber and counts positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tubefoot.lab.clock import Clock
from tubefoot.lab.messages import FAULT_ACTIONS, EndReason, Fault

FORWARD = 1
REVERSE = -1


@dataclass(frozen=True, slots=True)
class RigLimits:
    """What the bench will do at most.

    pressure_low, pressure_high : gauge pressure of any branch [MPa]; the board stops the pump outside
    duty : pulse width of the pump, 0 to 1
    pulse_duration : longest single pulse [s]
    pumped_volume : net volume either way from neutral [mm^3]
    silence : the board stops a running pump when it hears nothing for so long [s]
    channels : pressure sensors, 2 or 4
    """

    pressure_low: float
    pressure_high: float
    duty: float
    pulse_duration: float
    pumped_volume: float
    silence: float
    channels: int


@dataclass(frozen=True, slots=True)
class Reading:
    """The state of the bench at one time.

    time : middle of the averaging interval, on the rig's clock [s]
    age : how long before the call that was [s]
    pressures : change since neutral dP(t) = P(t) - P(0), right and left branch, then those of a second
        finger [MPa]
    gauge_pressures : the same before subtracting the neutral reading [MPa]
    supply : the board's 5 V rail [V]
    direction : 1 or -1 while the pump runs forward or reverse, 0 when it stands
    pumped_volume : estimated net volume since neutral [mm^3]
    faults : latched faults
    """

    time: float
    age: float
    pressures: tuple[float, ...]
    gauge_pressures: tuple[float, ...]
    supply: float
    direction: int
    pumped_volume: float
    faults: Fault


@dataclass(frozen=True, slots=True)
class SentPulse:
    """A pulse as the board accepted it: within the limits and on the board's grid of duty and time.

    time : when the board answered [s]
    direction : 1 forward, -1 reverse
    duty : 0 to 1, in steps of 1/255
    duration : [s], in steps of 1 ms
    volume : what the calibrated pump is expected to move, signed [mm^3]
    volume_sigma : its standard uncertainty [mm^3]
    clipped : whether duty or duration had to be cut to the limits
    """

    time: float
    direction: int
    duty: float
    duration: float
    volume: float
    volume_sigma: float
    clipped: bool


@dataclass(frozen=True, slots=True)
class EndedPulse:
    """How the last pulse ended.

    time : [s]
    duration : how long the pump really ran [s]
    volume : what the calibrated pump is estimated to have moved, signed [mm^3]
    reason : why it ended
    """

    time: float
    duration: float
    volume: float
    reason: EndReason


@dataclass(frozen=True, slots=True)
class Neutral:
    """The reading that counts as zero.

    pressures : mean gauge pressure of each branch [MPa]
    scatter : standard deviation of single samples about it [MPa]
    samples : how many samples
    """

    pressures: tuple[float, ...]
    scatter: tuple[float, ...]
    samples: int


class Rig(Protocol):
    """A bench. Times are on its clock; every call may raise LinkError when the bench is gone.

    The caller's calls are the sign of life: while the pump runs, call `wait` or `read` more often than
    `limits.silence`, or the board stops the pump and latches a fault.
    """

    @property
    def clock(self) -> Clock:
        """Its time; a simulated or replayed rig runs on its own."""

    @property
    def limits(self) -> RigLimits:
        """What the bench will do at most."""

    @property
    def faults(self) -> Fault:
        """Latched faults, as of the last sample."""

    @property
    def last_pulse(self) -> EndedPulse | None:
        """How the last pulse ended; None before the first one and while one runs."""

    def connect(self) -> None:
        """Begin a session, or begin it again after the line was lost; the pump stands afterwards."""

    def close(self) -> None:
        """Stop the pump and end the session."""

    def read(self) -> Reading:
        """The newest reading."""

    def wait(self, seconds: float) -> list[Reading]:
        """The readings that came while time passed.

        seconds : how long [s]
        """

    def pulse(self, direction: int, duty: float, duration: float) -> SentPulse:
        """What was really sent; the pump runs when this returns.

        direction : 1 forward, -1 reverse
        duty : 0 to 1, cut to the limit
        duration : [s], cut to the limit

        Raises SafetyStop when a latched fault or the volume limit forbids it, LinkError while a pulse runs.
        """

    def stop(self) -> None:
        """Stop the pump now."""

    def clear_faults(self) -> None:
        """Clear the latched faults; raises SafetyStop while a cause persists."""

    def set_neutral(self, neutral: Neutral) -> None:
        """Take a reading as zero pressure, and the present volume as zero volume.

        neutral : from `measure_neutral`
        """


def fault_names(faults: Fault) -> str:
    """The faults as text, `none` where there are none.

    faults : latched faults
    """
    return ", ".join(fault.name.lower() for fault in Fault if fault in faults and fault.name) or "none"


def fault_advice(faults: Fault) -> str:
    """What each fault asks for, one a line.

    faults : latched faults
    """
    return "\n".join(f"{fault_names(fault)}: {FAULT_ACTIONS[fault]}" for fault in Fault if fault in faults)
