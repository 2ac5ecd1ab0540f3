"""What a grasp's protocol sees and may ask for, and what it came to; see `grasp_protocol`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Phase = Literal[
    "open", "place", "close", "grip", "release", "settle", "hold", "lift", "shake", "lower", "let go", "done"
]
Request = Literal["", "place", "release", "lift", "shake", "lower"]


@dataclass(frozen=True)
class FingerView:
    """One finger at one time.

    seen_at : when its frame was taken [s]
    bend, theta1, theta2 : inward positive [rad]; nan where they are not known
    pressures : of the chamber that bends inward, and of the other, gauge [MPa]
    """

    seen_at: float
    bend: float
    theta1: float
    theta2: float
    pressures: tuple[float, float]


@dataclass(frozen=True)
class GripView:
    """The gripper at one time.

    time : now [s]; fingers : right and left; pumping : whether any pump runs
    """

    time: float
    fingers: tuple[FingerView, FingerView]
    pumping: bool


@dataclass(frozen=True)
class Decision:
    """What to do now.

    pulses : direction of each finger's pulse, inward +1, 0 for none; duration : of them [s]
    request : to the hands, empty for none; optional : pulses that are left out where pressure forbids them,
        instead of waited for
    """

    pulses: tuple[int, int] = (0, 0)
    duration: float = 0.0
    request: Request = ""
    optional: bool = False


WAIT = Decision()


@dataclass
class Outcome:
    """What the protocol knows of a grasp when it has ended.

    contact_pulse : inward pulse after which each finger's contact was sure, 0 if never
    contact_time : when that was [s]
    grip_pulses : inward pulses after contact; inward_pulses, outward_pulses : of either kind
    keep_pulses : pulses of either kind that kept force and place of the free object
    grip_force : last estimate of each finger's force [N]
    reason : why it ended; gripped : whether an object was gripped
    """

    contact_pulse: list[int] = field(default_factory=lambda: [0, 0])
    contact_time: list[float] = field(default_factory=lambda: [float("nan")] * 2)
    grip_pulses: int = 0
    keep_pulses: int = 0
    inward_pulses: int = 0
    outward_pulses: int = 0
    grip_force: list[float] = field(default_factory=lambda: [0.0, 0.0])
    reason: str = ""
    gripped: bool = False
