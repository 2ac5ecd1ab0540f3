"""Is the bench fit to work? One line a question, with the value, the limit and the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.messages import PROTOCOL_VERSION, EndReason
from tubefoot.lab.rig import FORWARD, REVERSE, fault_names
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import BRANCHES
from tubefoot.units import KPA

ROUND_TRIPS = 20
PULSE_DUTY = 0.8
PULSE_S = 0.2


@dataclass(frozen=True, slots=True)
class Check:
    """One question.

    limit : what is allowed, as text
    advice : what to do when it failed
    """

    name: str
    value: str
    limit: str
    passed: bool
    advice: str = ""


def check_rig(rig: BoardRig, pump: bool, say: Callable[[str], None]) -> list[Check]:
    """Every check, in the order in which a bench is brought up.

    rig : connected
    pump : whether the pump may run, for 0.2 s each way
    say : told what comes next
    """
    say("link: round trips and one second of samples")
    identity = rig.identity
    protocol = identity.protocol if identity else 0
    trips = [rig.round_trip() * 1e3 for _ in range(ROUND_TRIPS)]
    lost = rig.lost_samples
    neutral = measure_neutral(rig)
    reading = rig.read()
    gauge = [pressure / KPA for pressure in neutral.pressures]
    scatter = [value / KPA for value in neutral.scatter]
    rate = rig.settings.board.sample_rate_hz
    checks = [
        Check("protocol", f"{protocol}", f"{PROTOCOL_VERSION}", protocol == PROTOCOL_VERSION, "flash it"),
        Check(
            "round trip", f"{np.median(trips):.1f} ms, worst {max(trips):.1f} ms",
            "below 50 ms", max(trips) < 50, "a hub or a busy computer; connect the board directly",
        ),
        Check(
            "samples", f"{neutral.samples} in 1 s, {rig.lost_samples - lost} lost",
            f"{rate} +- 5 %, none lost",
            abs(neutral.samples - rate) <= 0.05 * rate and rig.lost_samples == lost, "as above",
        ),
        Check(
            "supply", f"{reading.supply:.2f} V", "4.6 to 5.4 V", 4.6 <= reading.supply <= 5.4,
            "use a powered USB port, or set board.reference_v by a voltmeter",
        ),
        Check("faults", fault_names(rig.faults), "none", not rig.faults, "see docs/rig.md, then clear"),
    ]  # fmt: skip
    for branch, zero, noise in zip(BRANCHES, gauge, scatter, strict=False):
        text = f"{zero:+.2f} kPa, scatter {noise:.2f} kPa"
        passed = abs(zero) < 10 and noise < 1.0
        checks.append(
            Check(f"{branch} at rest", text, "within 10 kPa, below 1 kPa", passed, "check the sensor")
        )
    for direction, rising in ((FORWARD, "right"), (REVERSE, "left")) if pump else ():
        say(f"pump: {PULSE_S:g} s, {rising} branch must rise")
        checks.append(_check_direction(rig, direction, rising))
    return checks


def _check_direction(rig: BoardRig, direction: int, rising: str) -> Check:
    """Whether a short pulse raises one branch and lowers the other."""
    before = np.array(rig.read().pressures[:2])
    sent = rig.pulse(direction, min(PULSE_DUTY, rig.limits.duty), PULSE_S)
    rig.wait(sent.duration + 0.1)
    change = (np.array(rig.read().pressures[:2]) - before) / KPA
    ended = rig.last_pulse
    whole = ended is not None and ended.reason == EndReason.COMPLETED
    way = "forward" if direction == FORWARD else "reverse"
    return Check(
        f"pump {way}",
        f"right {change[0]:+.1f} kPa, left {change[1]:+.1f} kPa{'' if whole else ', not completed'}",
        f"{rising} up, the other down",
        bool(whole and change[0] * direction > 0.3 and change[1] * direction < -0.3),
        "swap the pump's two wires if both signs are wrong; look for a leak, air or a kink if one is small",
    )
