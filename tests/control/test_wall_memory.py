"""The memory of the wall against the closed form of a ramp, and against the relaxing reduced finger."""

import numpy as np
import pytest

from tubefoot.control.wall_memory import WallMemory
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.relaxation import Prony, RelaxingFinger

PRONY = Prony((3.0, 1.0), (0.2, 5.0))


def test_ramp_and_hold() -> None:
    """A ramp over T, then held: a term leaves g tau / T (1 - exp(-T / tau)) exp(-t / tau) of the turn."""
    wall = WallMemory(PRONY)
    for time in np.arange(0.0, 4.01, 0.05):
        turn = min(float(time), 1.0) * 0.1
        wall.see(float(time), turn, -turn)
    left = sum(
        g * tau * (1.0 - np.exp(-1.0 / tau)) * np.exp(-3.0 / tau)
        for g, tau in zip(PRONY.strengths, PRONY.times_s, strict=True)
    )
    assert wall.borne == pytest.approx([0.1 * (1.0 + left), -0.1 * (1.0 + left)], rel=1e-9)


def test_same_as_the_reduced_finger() -> None:
    """What is borne, times the stiffness at rest, is the moment of the relaxing finger without pressures."""
    content = reference_file()
    finger, prony = content.to_finger(), content.to_prony()
    relaxing, wall = RelaxingFinger(finger, prony), WallMemory(prony)
    wall.see(0.0, 0.0, 0.0)
    moment = 0.0
    for step in range(1, 80):
        angle = 1e-4 * np.sin(0.1 * step)
        answer = relaxing.commit(np.full(12, angle), np.zeros(2), 0.05)
        wall.see(0.05 * step, 6 * angle, 6 * angle)
        moment = float(answer.moments[3])
    stiffness = float(finger.respond(np.zeros(12), np.zeros(2)).stiffness[3])
    assert stiffness * wall.borne[0] / 6 == pytest.approx(moment, rel=1e-3)


def test_lost_markers_and_old_frames_change_nothing() -> None:
    wall, other = WallMemory(PRONY), WallMemory(PRONY)
    for time, turn in ((0.0, 0.0), (0.1, 0.02), (0.3, 0.03)):
        wall.see(time, turn, turn)
        other.see(time, turn, turn)
        other.see(time, 9.0, 9.0)
        other.see(time + 0.05, float("nan"), 0.1)
    assert list(wall.borne) == list(other.borne)


def test_a_wall_without_memory_bears_its_turn() -> None:
    wall = WallMemory(Prony((), ()))
    assert np.isnan(wall.borne).all()
    for time, turn in ((0.0, 0.0), (0.1, 0.3)):
        wall.see(time, turn, -turn)
    assert list(wall.borne) == [0.3, -0.3]
