"""The protocol's course with fingers made of formulas: phases, pulses, who waits for whom, how it ends."""

import numpy as np
import pytest

from tubefoot.control.grasp_contract import Decision, FingerView, GripView
from tubefoot.control.grasp_protocol import GraspProtocol
from tubefoot.control.grasp_settings import GraspPulses, GraspSettings
from tubefoot.control.grip_goal import GripGoal
from tubefoot.lab.grasp_object import known_object
from tubefoot.reduced.files import reference_file
from tubefoot.units import DEG, KPA

FINGER = reference_file().to_finger()
GAIN = 0.35 * DEG / KPA


class Springs:
    """Two linear fingers: each pulse moves the bend by 12 deg/s; from `touch` on the lower half stands."""

    def __init__(self, touch: tuple[float, float] = (-7.0, -7.0)):
        self.touch = touch
        self.driven = [0.0, 0.0]
        self.requests: list[str] = []
        self.pulses: list[tuple[int, int]] = []
        self.now = 0.0
        self.hidden = False

    def view(self, pumping: bool = False) -> GripView:
        """What is seen now."""
        fingers = []
        for driven, touch in zip(self.driven, self.touch, strict=True):
            theta2 = driven / 2
            theta1 = min(driven / 2, touch / 2)
            pressure = driven * DEG / GAIN
            bend = (theta1 + theta2) * DEG
            if self.hidden:
                theta1 = theta2 = float("nan")
            fingers.append(
                FingerView(self.now, bend, theta1 * DEG, theta2 * DEG, (pressure / 2, -pressure / 2))
            )
        return GripView(self.now, (fingers[0], fingers[1]), pumping)

    def run(self, protocol: GraspProtocol, most_s: float = 200.0) -> None:
        """Carry the protocol out at 30 frames a second."""
        while protocol.phase != "done" and self.now < most_s:
            self.now += 1 / 30
            decision: Decision = protocol.decide(self.view())
            if decision.request:
                self.requests.append(decision.request)
                protocol.hands_done(self.now)
            elif any(decision.pulses):
                self.pulses.append(decision.pulses)
                for side in (0, 1):
                    self.driven[side] += decision.pulses[side] * 20.0 * decision.duration
                self.now += decision.duration
                protocol.decide(self.view(pumping=True))


def protocol_of(settings: GraspSettings | None = None, coupled: bool = False) -> GraspProtocol:
    """The protocol for a blueberry."""
    return GraspProtocol(
        known_object("blueberry"),
        "front",
        FINGER,
        settings or GraspSettings(),
        coupled,
    )


def test_whole_course_in_order() -> None:
    protocol, springs = protocol_of(), Springs()
    springs.run(protocol)
    assert springs.requests == ["place", "release", "lift", "shake", "lower"]
    assert protocol.outcome.reason == "complete"
    assert protocol.outcome.gripped
    assert springs.pulses[0] == (-1, -1)
    assert springs.pulses[-1] == (-1, -1)


def test_fingers_open_wide_enough_for_the_object() -> None:
    protocol, springs = protocol_of(), Springs()
    while protocol.phase == "open":
        springs.now += 1 / 30
        decision = protocol.decide(springs.view())
        for side in (0, 1):
            springs.driven[side] += decision.pulses[side] * 20.0 * decision.duration
    low = 70.0 - 6.0 - 4.0
    opened = [4.0 - bend * DEG * low**2 / (2 * 84.0) for bend in springs.driven]
    assert min(opened) >= 7.5 + 3.5


def test_the_first_finger_waits_for_the_other() -> None:
    protocol, springs = protocol_of(), Springs(touch=(-14.0, -4.0))
    springs.run(protocol)
    first, second = protocol.outcome.contact_pulse
    assert 0 < first < second
    inward = [pulses for pulses in springs.pulses if max(pulses) > 0]
    assert inward[:first] == [(1, 1)] * first
    assert inward[first:second] == [(0, 1)] * (second - first)


@pytest.mark.parametrize("receding", [0, 1])
def test_a_free_object_that_drifts_is_put_back(receding: int) -> None:
    """In hold and lift: inward by the finger that recedes, or outward by the other; optional either way."""
    protocol, springs = protocol_of(), Springs()
    while protocol.phase not in ("hold", "done"):
        springs.run(protocol, springs.now + 1 / 30)
    assert protocol.outcome.keep_pulses == 0
    ways = ((1, 0), (0, -1)) if receding == 0 else ((0, 1), (-1, 0))
    for _ in range(30):
        springs.now += 1 / 30
        assert not any(protocol.decide(springs.view()).pulses)
    springs.touch = tuple(-7.0 - 8.0 * (side == receding) for side in (0, 1))  # type: ignore[assignment]
    given = []
    for _ in range(90):
        springs.now += 1 / 30
        given.append(protocol.decide(springs.view()))
    pulsed = [decision for decision in given if any(decision.pulses)]
    assert pulsed[0].pulses in ways
    assert all(decision.optional for decision in pulsed)
    assert protocol.outcome.keep_pulses == len(pulsed)
    while protocol.phase == "hold":
        springs.now += 1 / 30
        protocol.decide(springs.view())
    assert protocol.phase == "lift"
    lifted = []
    for _ in range(60):
        springs.now += 1 / 30
        lifted.append(protocol.meanwhile(springs.view()).pulses)
    assert set(lifted) & set(ways)


def test_markers_hidden_after_the_release_are_waited_for() -> None:
    """No pulse while they are hidden; the place that is kept is the first one seen."""
    protocol, springs = protocol_of(), Springs()
    while protocol.phase not in ("settle", "done"):
        springs.run(protocol, springs.now + 1 / 30)
    springs.hidden = True
    for _ in range(60):
        springs.now += 1 / 30
        assert not any(protocol.decide(springs.view()).pulses)
    assert protocol.phase == "hold"
    springs.hidden = False
    given = []
    for count in range(90):
        springs.now += 1 / 30
        if count == 30:
            springs.touch = (-15.0, -7.0)
        given.append(protocol.decide(springs.view()).pulses)
    assert not any(any(pulses) for pulses in given[:30])
    assert any(any(pulses) for pulses in given[30:])


def test_one_pump_moves_both() -> None:
    protocol, springs = protocol_of(coupled=True), Springs(touch=(-14.0, -4.0))
    springs.run(protocol)
    assert set(springs.pulses) == {(-1, -1), (1, 1)}


def test_nothing_there_ends_where_the_fingers_meet() -> None:
    protocol, springs = protocol_of(), Springs(touch=(1e9, 1e9))
    springs.run(protocol)
    assert "no contact" in protocol.outcome.reason
    assert not protocol.outcome.gripped
    assert springs.driven[0] < 60.0


def test_given_number_of_outward_pulses_is_kept() -> None:
    settings = GraspSettings(pulses=GraspPulses(outward=2))
    protocol, springs = protocol_of(settings), Springs()
    springs.run(protocol)
    assert protocol.outcome.outward_pulses == 2


def test_pauses_are_kept_between_pulses() -> None:
    protocol, springs = protocol_of(), Springs()
    times = []
    while protocol.phase == "open":
        springs.now += 1 / 30
        decision = protocol.decide(springs.view())
        if any(decision.pulses):
            times.append(springs.now)
            for side in (0, 1):
                springs.driven[side] += decision.pulses[side] * 20.0 * decision.duration
            springs.now += decision.duration
    assert np.diff(times).min() >= 0.3 + 0.5 - 1e-6


def test_goal_of_the_grip() -> None:
    tofu = known_object("tofu")
    goal = GripGoal.of(tofu, "front", GraspSettings().grip)
    assert goal.needed == pytest.approx(tofu.weight / 0.8)
    assert goal.force == pytest.approx(GraspSettings().grip.safety * goal.needed)
    assert goal.most == pytest.approx(0.5 * min(2.88e-3 * 300, 0.1 * 20 * tofu.firmness("front")))


@pytest.mark.parametrize("phase", ["close", "grip"])
def test_no_inward_pulse_while_markers_are_hidden(phase: str) -> None:
    protocol, springs = protocol_of(), Springs()
    while protocol.phase != phase:
        springs.run(protocol, springs.now + 0.01)
    before = list(springs.pulses)
    springs.hidden = True
    springs.run(protocol)
    assert springs.pulses == before
    assert protocol.outcome.reason.startswith("link lost")
    assert protocol.settings.patience_s < springs.now < protocol.settings.patience_s + 30.0


def test_goal_of_an_object_known_by_its_tension_alone() -> None:
    """No force on the whole object follows from it: friction alone sets the goal."""
    tofu = known_object("tofu")
    bounds = tofu.damage.model_copy(update={"compression_share": None, "compression_kpa": None})
    bounds = bounds.model_copy(update={"contact_force_n": None})
    goal = GripGoal.of(tofu.model_copy(update={"damage": bounds}), "front", GraspSettings().grip)
    assert goal.most == float("inf")
    assert goal.within_bounds
