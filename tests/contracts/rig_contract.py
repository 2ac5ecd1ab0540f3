"""What every rig must do; each test is run on every kind of rig by `test_rigs.py`."""

from __future__ import annotations

import pytest

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.messages import EndReason, Fault
from tubefoot.lab.rig import FORWARD, REVERSE, EndedPulse, Rig
from tubefoot.lab.sensing import measure_neutral
from tubefoot.units import KPA, ML


def wait_for_end(rig: Rig) -> EndedPulse:
    """How the running pulse ended."""
    for _ in range(100):
        rig.wait(0.05)
        if rig.last_pulse is not None:
            return rig.last_pulse
    raise AssertionError("the pulse did not end within 5 s")


def run_contract(rig: Rig) -> None:
    """Goes through a session, asserting what the contract promises.

    rig : not yet connected
    """
    with pytest.raises(LinkError):
        rig.read()
    rig.connect()
    first = rig.read()
    assert 0 <= first.age < 0.3
    assert len(first.pressures) == rig.limits.channels
    neutral = measure_neutral(rig, 0.5)
    assert neutral.samples >= 10
    assert max(neutral.scatter) < 1 * KPA

    readings = rig.wait(0.5)
    times = [reading.time for reading in readings]
    assert times == sorted(set(times))
    assert 10 <= len(readings) <= 115  # a free-running board on a busy computer is slower than real time
    assert all(reading.direction == 0 for reading in readings)
    assert abs(readings[-1].pressures[0]) < 1 * KPA

    for direction, duty, duration in (
        (7, 0.5, 0.1),
        (FORWARD, 0.0, 0.1),
        (FORWARD, 1.2, 0.1),
        (FORWARD, 1, 0),
    ):
        with pytest.raises(ConfigError):
            rig.pulse(direction, duty, duration)

    sent = rig.pulse(FORWARD, 0.8, 0.3)
    assert (sent.direction, sent.duration, sent.clipped) == (FORWARD, 0.3, False)
    assert sent.duty == pytest.approx(0.8, abs=0.5 / 255)
    assert sent.volume > 0
    assert sent.volume_sigma > 0
    during = rig.wait(0.15)
    assert rig.last_pulse is None
    assert during[-1].direction == FORWARD
    ended = wait_for_end(rig)
    rig.wait(0.2)
    assert ended.reason == EndReason.COMPLETED
    assert ended.duration == pytest.approx(0.3, abs=0.002)
    assert ended.volume == pytest.approx(sent.volume, rel=0.02)
    after = rig.read()
    assert after.pressures[0] > 1 * KPA > -1 * KPA > after.pressures[1]
    assert after.pumped_volume == pytest.approx(sent.volume, abs=0.01 * ML)

    sent = rig.pulse(REVERSE, 1.0, 60.0)
    assert sent.clipped
    assert sent.duration == rig.limits.pulse_duration
    rig.wait(0.25)
    rig.stop()
    ended = wait_for_end(rig)
    assert ended.reason == EndReason.STOPPED
    assert 0 < ended.duration < 1.0
    rig.wait(0.05)
    assert rig.read().direction == 0

    assert rig.faults == Fault(0)
    rig.clear_faults()
    before = rig.clock.now()
    rig.clock.sleep(0.01)
    assert rig.clock.now() >= before + 0.01
    rig.close()
    with pytest.raises(LinkError):
        rig.read()
