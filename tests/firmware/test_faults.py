"""Fault injection on the real binary: what goes wrong, and how fast the pump stands."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest

from tubefoot.lab import messages
from tubefoot.lab.codec import encode
from tubefoot.lab.messages import EndReason, Fault, Status
from tubefoot.twin.board import Operation

SILENCE_LIMIT_S = 0.5
SENSOR_LIMIT_S = 0.005


def pump_again(wire, direction=1):
    return Status(wire.ask(messages.Pulse(direction, 200, 10)).status)


def test_a_lost_host_stops_the_pump_within_half_a_second(wire):
    wire.pump()
    heard = wire.board.time
    wire.time_to_stop(1.0)
    assert wire.board.time - 0.003 - heard < SILENCE_LIMIT_S
    assert wire.faults() == Fault.SILENCE
    assert pump_again(wire) is Status.FAULT_LATCHED
    assert wire.ask(messages.ClearFaults()).status == Status.OK
    assert pump_again(wire) is Status.OK


def test_the_pump_runs_on_while_the_host_is_heard(wire):
    wire.pump(duration_ms=1500)
    for _ in range(9):
        wire.run(0.15)
        assert wire.board.drive.direction == 1
        assert wire.ask(messages.Ping()).status == Status.OK
    wire.run(0.3)
    ended = wire.last(messages.PulseEnded)
    assert (ended.ran_ms, ended.end_reason) == (1500, EndReason.COMPLETED)


@pytest.mark.parametrize(
    ("channel", "volts", "fault"),
    [
        (0, 0.0, Fault.SENSOR_LOW),
        (1, 0.0, Fault.SENSOR_LOW),
        (0, 5.0, Fault.SENSOR_HIGH),
        (1, 4.9, Fault.SENSOR_HIGH),
        (0, 4.2, Fault.OVER_PRESSURE),
        (1, 4.2, Fault.OVER_PRESSURE),
        (0, 0.8, Fault.UNDER_PRESSURE),
        (1, 0.8, Fault.UNDER_PRESSURE),
    ],
    ids=[
        "open right",
        "short left",
        "short to supply",
        "saturated",
        "over r",
        "over l",
        "under r",
        "under l",
    ],
)
def test_a_bad_sensor_or_pressure_stops_the_pump_within_5_ms(wire, channel, volts, fault):
    wire.pump()
    wire.run(0.0203)
    wire.plant.volts[channel] = volts
    took = wire.time_to_stop(0.1)
    assert took is not None
    assert took <= SENSOR_LIMIT_S
    assert wire.faults() & fault
    assert wire.ask(messages.ClearFaults()).status == Status.CONDITION_PERSISTS
    wire.plant.volts[channel] = 2.5
    wire.run(0.01)
    wire.obey(messages.ClearFaults())
    assert wire.faults() == Fault(0)


def test_over_pressure_stops_the_pump_in_every_phase_of_sampling(make_wire):
    wire = make_wire()
    wire.begin()
    times = []
    for phase in range(20):
        wire.plant.volts[0] = 2.5
        wire.run(0.01)
        wire.obey(messages.ClearFaults())
        wire.pump()
        wire.run(0.01 + 1e-4 * phase)
        wire.plant.volts[0] = 4.2
        times.append(wire.time_to_stop(0.1))
        wire.obey(messages.Stop())
    assert None not in times
    assert 0.001 < min(times) <= max(times) <= SENSOR_LIMIT_S


@pytest.mark.parametrize(("channel", "volts"), [(0, 4.2), (1, 0.8)])
def test_pressure_faults_leave_the_relieving_direction(wire, channel, volts):
    wire.pump()
    wire.plant.volts[channel] = volts
    assert wire.time_to_stop(0.1) is not None
    assert pump_again(wire, 1) is Status.FAULT_LATCHED
    assert pump_again(wire, -1) is Status.OK
    wire.run(0.02)
    assert wire.last(messages.PulseEnded).end_reason == EndReason.COMPLETED


def test_a_broken_sensor_leaves_the_way_back_to_neutral_and_no_further(wire):
    wire.pump(duty=200, duration_ms=100)
    wire.run(0.15)
    wire.plant.volts[0] = 0.0
    wire.run(0.01)
    assert pump_again(wire, 1) is Status.FAULT_LATCHED
    wire.obey(messages.Pulse(-1, 100, 350))  # neutral lies 200 ms back at half the duty
    wire.run(0.25)
    ended = wire.last(messages.PulseEnded)
    assert ended.end_reason == EndReason.NEUTRAL_REACHED
    assert 199 <= ended.ran_ms <= 201
    assert pump_again(wire, -1) is Status.FAULT_LATCHED


@pytest.mark.parametrize(("interrupts_off", "limit"), [(0, 0.035), (1, 0.075)])
def test_a_hung_main_loop_stops_the_pump_and_leaves_its_mark(wire, interrupts_off, limit):
    wire.pump()
    wire.sequence += 1
    wire.board.send(encode(messages.TestHang(interrupts_off), wire.sequence))
    took = wire.time_to_stop(0.5)
    assert took is not None
    assert took < limit
    assert wire.run(0.3, until=lambda: wire.last(messages.Identity).started == 1)
    assert wire.faults() & Fault.HUNG_LOOP
    assert Status(wire.ask(messages.Pulse(1, 200, 10)).status) is Status.NO_SESSION
    wire.begin()
    assert pump_again(wire) is Status.FAULT_LATCHED
    wire.obey(messages.ClearFaults())
    assert pump_again(wire) is Status.OK


def test_a_reset_in_mid_pulse_stops_the_pump_and_is_remembered(wire):
    wire.pump()
    wire.run(0.05)
    wire.press(Operation.RESET)
    assert wire.time_to_stop(0.1) < 0.002
    wire.run(0.05)
    assert wire.faults() == Fault.RESET_WHILE_PUMPING
    wire.begin()
    assert pump_again(wire) is Status.FAULT_LATCHED


def test_a_reset_at_rest_and_a_power_cycle_leave_no_fault(wire):
    wire.press(Operation.RESET)
    wire.run(0.05)
    assert wire.faults() == Fault(0)
    wire.begin()
    wire.pump()
    wire.press(Operation.POWER_CYCLE)
    wire.run(0.05)
    assert not wire.board.pump_on
    assert wire.faults() == Fault(0)


def test_a_flood_of_random_bytes_is_silence(wire):
    wire.pump()
    noise = random.Random(1)
    start = wire.board.time
    while wire.board.drive.direction != 0 and wire.board.time - start < 2.0:
        wire.board.send(noise.randbytes(55))
        wire.run(0.005, until=lambda: wire.board.drive.direction == 0)
    assert wire.board.time - start > 0.1
    assert wire.board.time - start < SILENCE_LIMIT_S
    wire.run(0.1)
    assert wire.faults() == Fault.SILENCE


def test_damaged_pulses_never_run_wrongly_and_never_cost_the_next_frame(make_wire):
    wire = make_wire(step_s=1e-3)
    wire.begin()
    chance = random.Random(7)
    ran = 0
    for _ in range(150):
        direction, duty, duration = chance.choice((1, -1)), chance.randrange(60, 255), chance.randrange(5, 25)
        wire.sequence = (wire.sequence + 1) % 256
        frame = bytearray(encode(messages.Pulse(direction, duty, duration), wire.sequence))
        at = chance.randrange(len(frame))
        match chance.randrange(4):
            case 0:
                frame[at] ^= 1 << chance.randrange(8)
            case 1:
                del frame[at]
            case 2:
                frame.insert(at, chance.randrange(256))
            case 3:
                del frame[at:]
        first = len(wire.frames)
        wire.board.send(bytes(frame))
        wire.run(0.06)
        ended = [f.message for f in wire.frames[first:] if isinstance(f.message, messages.PulseEnded)]
        assert [e.ran_ms for e in ended] in ([], [duration])
        ran += len(ended)
        assert wire.ask(messages.Ping()) is not None, "the good frame after a damaged one was lost"
    assert 0 < ran < 75  # damage outside the frame's body leaves it good


def test_a_repeated_command_is_answered_again_but_run_once(wire):
    first = wire.ask(messages.Pulse(1, 200, 20), sequence=50 - 45)
    wire.run(0.05)
    assert wire.ask(messages.Ping(), sequence=200) is not None  # an answer in between must not disturb it
    again = wire.ask(messages.Pulse(1, 200, 20), sequence=50 - 45)
    assert (again.status, again.time_ms) == (first.status, first.time_ms)
    wire.run(0.05)
    assert sum(isinstance(frame.message, messages.PulseEnded) for frame in wire.frames) == 1


def test_a_late_duplicate_is_refused(wire):
    for sequence in (2, 3, 4):
        assert wire.ask(messages.Stream(50), sequence=sequence).status == Status.OK
    assert wire.ask(messages.Pulse(1, 200, 20), sequence=3).status == Status.STALE_SEQUENCE
    assert wire.ask(messages.Pulse(1, 200, 20), sequence=100).status == Status.STALE_SEQUENCE
    assert not wire.board.pump_on


def test_a_frame_with_a_pause_inside_is_dropped(wire):
    frame = encode(messages.Pulse(1, 200, 100), 2)
    wire.board.send(frame[:8])
    wire.run(0.05)
    wire.board.send(frame[8:])
    wire.run(0.03)
    assert not wire.board.pump_on


def test_limits_hold_on_the_board(wire):
    wire.obey(messages.LimitPump(max_duty=100, max_pulse_ms=50, silence_ms=200, channels=2))
    wire.run(0.02)
    assert wire.last(messages.Limits).max_duty == 100
    assert wire.ask(messages.Pulse(1, 101, 50)).status == Status.OUT_OF_RANGE
    assert wire.ask(messages.Pulse(1, 100, 51)).status == Status.OUT_OF_RANGE
    assert wire.ask(messages.Pulse(1, 100, 50)).status == Status.OK
    assert wire.ask(messages.Pulse(1, 100, 50)).status == Status.BUSY


def test_four_channels_guard_the_second_finger(wire):
    wire.plant.volts[2:] = [2.5, 2.5]
    wire.obey(messages.LimitPump(max_duty=255, max_pulse_ms=5000, silence_ms=400, channels=4))
    wire.run(0.02)
    wire.pump()
    wire.run(0.01)
    wire.plant.volts[3] = 0.8
    assert wire.time_to_stop(0.1) <= SENSOR_LIMIT_S
    assert wire.faults() == Fault.UNDER_PRESSURE


def test_samples_are_means_of_1_khz_readings_with_board_time(wire):
    wire.plant.volts[:2] = [3.0, 2.0]
    wire.obey(messages.Stream(5))
    wire.run(0.2)
    samples = [frame.message for frame in wire.frames if isinstance(frame.message, messages.Sample)]
    assert {b.time_ms - a.time_ms for a, b in pairwise(samples)} == {5}
    assert {sample.averaged for sample in samples} == {5}
    volts = [reading / 64 / 1024 * 5 for reading in samples[-1].pressure]
    assert volts == pytest.approx([3.0, 2.0, 0.0, 0.0], abs=0.01)  # two counts
    supply = 1.1 * 1024 * 16 / samples[-1].supply
    assert supply == pytest.approx(5.0, abs=0.03)
