"""The messages between host and board, as frozen records.

Generated from firmware/messages.toml by firmware/generate_messages.py: edit the table, not this.
"""

# fmt: off
from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar

PROTOCOL_VERSION = 1
BAUD = 115200
FRAME_BYTES_MAX = 48
FRAME_GAP_MS = 20
SEQUENCE_WINDOW = 16
CHANNELS_MAX = 4
COUNT_SCALE = 64
SUPPLY_SCALE = 16
ADC_FULL_SCALE = 1024
SENSOR_LOW_COUNTS = 41
SENSOR_HIGH_COUNTS = 982
TRIP_SAMPLES = 3
HANG_MS = 30
DEFAULT_PRESSURE_LOW_COUNTS = 266
DEFAULT_PRESSURE_HIGH_COUNTS = 758
DEFAULT_PULSE_MS = 5000
DEFAULT_SILENCE_MS = 400
DEFAULT_CHANNELS = 2


class Direction(IntEnum):
    """What the pump does; forward presses fluid into the right chamber."""

    REVERSE = -1
    """into the left chamber"""
    OFF = 0
    """stopped"""
    FORWARD = 1
    """into the right chamber"""


class Status(IntEnum):
    """What became of a command."""

    OK = 0
    """executed"""
    OUT_OF_RANGE = 1
    """a field is outside its range or outside the limits in force; nothing was done"""
    BUSY = 2
    """a pulse is still running; nothing was done"""
    FAULT_LATCHED = 3
    """a fault is latched and this direction would not relieve it; nothing was done"""
    UNKNOWN = 4
    """this firmware does not know the message; nothing was done"""
    NO_SESSION = 5
    """the board started anew; say hello first"""
    STALE_SEQUENCE = 6
    """the sequence number is outside the window: a late duplicate; nothing was done"""
    CONDITION_PERSISTS = 7
    """the cause of the fault is still there; nothing was cleared"""


class Fault(IntFlag):
    """Why the pump was stopped; a bit stays set until it is cleared."""

    OVER_PRESSURE = 1
    """a branch is above its upper limit"""
    UNDER_PRESSURE = 2
    """a branch is below its lower limit"""
    SENSOR_LOW = 4
    """a sensor reads below 0.2 V: open wire or short to ground"""
    SENSOR_HIGH = 8
    """a sensor reads above 4.8 V: saturated or short to the supply"""
    SILENCE = 16
    """the pump ran and no valid frame came for the silence limit"""
    HUNG_LOOP = 32
    """the board's main loop hung; it was stopped and the watchdog restarted it"""
    RESET_WHILE_PUMPING = 64
    """the board restarted while the pump ran: power dip, reset button or watchdog"""


class EndReason(IntEnum):
    """Why a pulse ended."""

    NONE = 0
    """no pulse has ended since the board started, or one is running"""
    COMPLETED = 1
    """the whole duration was run"""
    STOPPED = 2
    """the host said stop or hello"""
    FAULT = 3
    """a fault stopped it"""
    NEUTRAL_REACHED = 4
    """a pulse allowed under a fault came back to neutral"""


FAULT_ACTIONS: dict[Fault, str] = {
    Fault.OVER_PRESSURE: (
        "pump the other way (allowed), look for a blocked or kinked tube, then clear; "
        "raise the limit in rig.toml only if the finger allows it"
    ),
    Fault.UNDER_PRESSURE: (
        "pump the other way (allowed), look for a blocked tube or lost fluid on that "
        "side, then clear"
    ),
    Fault.SENSOR_LOW: (
        "check plug, 5 V and ground of that sensor; pumping back to neutral stays "
        "allowed; then clear"
    ),
    Fault.SENSOR_HIGH: (
        "release the pressure, check the sensor's signal wire; pumping back to neutral "
        "stays allowed; then clear"
    ),
    Fault.SILENCE: (
        "check the cable and whether the host program hung or was stopped; then clear"
    ),
    Fault.HUNG_LOOP: (
        "note what was done and report it with the recording: this is a firmware bug; "
        "then clear"
    ),
    Fault.RESET_WHILE_PUMPING: (
        "check the 12 V supply's ground and the board's 5 V under load; then clear"
    ),
}
"""What to do about each fault."""


class Message:
    """A message; its fields are the numbers on the wire."""

    ID: ClassVar[int]
    LAYOUT: ClassVar[struct.Struct]
    RANGES: ClassVar[dict[str, tuple[int, int]]]
    ARRAYS: ClassVar[dict[str, int]]
    """Fields that hold several numbers, and how many."""


@dataclass(frozen=True, slots=True)
class Hello(Message):
    """Begins a session: stops the pump, takes this frame's sequence number as the start, answers with
    identity and limits.

    protocol : protocol version of the host
    """

    ID: ClassVar[int] = 0x01
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "protocol": (1, 1),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    protocol: int


@dataclass(frozen=True, slots=True)
class Ping(Message):
    """Tells the board that the host is alive; any valid frame does."""

    ID: ClassVar[int] = 0x02
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {}
    ARRAYS: ClassVar[dict[str, int]] = {}


@dataclass(frozen=True, slots=True)
class Pulse(Message):
    """Runs the pump once, for a bounded time.

    direction : see Direction
    duty : pulse width [1/255]
    duration_ms : [ms]
    """

    ID: ClassVar[int] = 0x03
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<bBH")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "direction": (-1, 1),
        "duty": (1, 255),
        "duration_ms": (1, 10000),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    direction: int
    duty: int
    duration_ms: int


@dataclass(frozen=True, slots=True)
class Stop(Message):
    """Stops the pump at once; accepted in any state and out of sequence."""

    ID: ClassVar[int] = 0x04
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {}
    ARRAYS: ClassVar[dict[str, int]] = {}


@dataclass(frozen=True, slots=True)
class Stream(Message):
    """Sets the interval of the samples; each is the mean over the interval.

    period_ms : [ms], 0 stops the stream; values 1 to 4 are refused
    """

    ID: ClassVar[int] = 0x05
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "period_ms": (0, 250),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    period_ms: int


@dataclass(frozen=True, slots=True)
class LimitPump(Message):
    """Sets the limits of the pump; the board answers with Limits.

    max_duty : [1/255]
    max_pulse_ms : [ms]
    silence_ms : [ms] pump off when no valid frame came for this long
    channels : pressure inputs in use, 2 or 4
    """

    ID: ClassVar[int] = 0x06
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHHB")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "max_duty": (1, 255),
        "max_pulse_ms": (1, 10000),
        "silence_ms": (50, 450),
        "channels": (2, 4),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    max_duty: int
    max_pulse_ms: int
    silence_ms: int
    channels: int


@dataclass(frozen=True, slots=True)
class LimitPressure(Message):
    """Sets the limits of one pressure input; the board answers with Limits.

    channel : 0 right, 1 left, 2 and 3 of the second finger
    low_counts : [count] under-pressure below
    high_counts : [count] over-pressure above; must exceed low_counts
    """

    ID: ClassVar[int] = 0x07
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHH")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "channel": (0, 3),
        "low_counts": (41, 982),
        "high_counts": (41, 982),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    channel: int
    low_counts: int
    high_counts: int


@dataclass(frozen=True, slots=True)
class ClearFaults(Message):
    """Clears the latched faults, unless a cause persists."""

    ID: ClassVar[int] = 0x08
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {}
    ARRAYS: ClassVar[dict[str, int]] = {}


@dataclass(frozen=True, slots=True)
class SetNeutral(Message):
    """Declares the present state neutral: the travel that relief pulses run back is zero here."""

    ID: ClassVar[int] = 0x09
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {}
    ARRAYS: ClassVar[dict[str, int]] = {}


@dataclass(frozen=True, slots=True)
class TestHang(Message):
    """Hangs the main loop, in test builds only.

    interrupts_off : 1 hangs with interrupts off
    """

    ID: ClassVar[int] = 0x7E
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "interrupts_off": (0, 1),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    interrupts_off: int


@dataclass(frozen=True, slots=True)
class Ack(Message):
    """Answers a command; the frame's sequence number is the command's.

    command : id of the command
    status : see Status
    faults : latched faults, see Fault
    time_ms : board time of the execution [ms]
    """

    ID: ClassVar[int] = 0x81
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BBHI")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "command": (0, 255),
        "status": (0, 7),
        "faults": (0, 127),
        "time_ms": (0, 4294967295),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    command: int
    status: int
    faults: int
    time_ms: int


@dataclass(frozen=True, slots=True)
class Identity(Message):
    """Sent after a start and after Hello.

    protocol : protocol version of the board
    firmware : firmware version, 256 x major + minor
    reset_cause : MCUSR at start; 0 where the boot loader cleared it
    faults : latched faults, see Fault
    started : 1 in the first one after a start
    """

    ID: ClassVar[int] = 0x82
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHBHB")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "protocol": (0, 255),
        "firmware": (0, 65535),
        "reset_cause": (0, 255),
        "faults": (0, 127),
        "started": (0, 1),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    protocol: int
    firmware: int
    reset_cause: int
    faults: int
    started: int


@dataclass(frozen=True, slots=True)
class Limits(Message):
    """The limits in force, sent after Hello, LimitPump and LimitPressure.

    max_duty : [1/255]
    max_pulse_ms : [ms]
    silence_ms : [ms]
    channels : pressure inputs in use
    low_counts : [count] of each input
    high_counts : [count] of each input
    """

    ID: ClassVar[int] = 0x83
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BHHBHHHHHHHH")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "max_duty": (0, 255),
        "max_pulse_ms": (0, 65535),
        "silence_ms": (0, 65535),
        "channels": (2, 4),
        "low_counts": (0, 1023),
        "high_counts": (0, 1023),
    }
    ARRAYS: ClassVar[dict[str, int]] = {"low_counts": 4, "high_counts": 4}

    max_duty: int
    max_pulse_ms: int
    silence_ms: int
    channels: int
    low_counts: tuple[int, ...]
    high_counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Sample(Message):
    """The state of the bench; the frame's sequence number counts samples.

    time_ms : board time at the end of the interval [ms]
    averaged : 1 kHz samples in the mean
    pressure : mean [1/64 count]; 0 where not in use
    supply : the board's 1.1 V reference against the supply [1/16 count]
    direction : see Direction
    duty : [1/255]
    faults : latched faults, see Fault
    fault_channels : bit i: input i caused a pressure or sensor fault
    pulse_sequence : sequence number of the last pulse
    ran_ms : how long the last pulse has run [ms]
    end_reason : see EndReason
    bad_frames : frames the board has dropped as damaged, modulo 256
    """

    ID: ClassVar[int] = 0x84
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<IBHHHHHbBHBBHBB")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "time_ms": (0, 4294967295),
        "averaged": (0, 255),
        "pressure": (0, 65535),
        "supply": (0, 65535),
        "direction": (-1, 1),
        "duty": (0, 255),
        "faults": (0, 127),
        "fault_channels": (0, 15),
        "pulse_sequence": (0, 255),
        "ran_ms": (0, 65535),
        "end_reason": (0, 4),
        "bad_frames": (0, 255),
    }
    ARRAYS: ClassVar[dict[str, int]] = {"pressure": 4}

    time_ms: int
    averaged: int
    pressure: tuple[int, ...]
    supply: int
    direction: int
    duty: int
    faults: int
    fault_channels: int
    pulse_sequence: int
    ran_ms: int
    end_reason: int
    bad_frames: int


@dataclass(frozen=True, slots=True)
class PulseEnded(Message):
    """Sent once when a pulse ends; the same facts are in every sample, should it be lost.

    time_ms : board time of the end [ms]
    pulse_sequence : sequence number of the pulse
    ran_ms : how long it ran [ms]
    end_reason : see EndReason
    faults : latched faults, see Fault
    """

    ID: ClassVar[int] = 0x85
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<IBHBH")
    RANGES: ClassVar[dict[str, tuple[int, int]]] = {
        "time_ms": (0, 4294967295),
        "pulse_sequence": (0, 255),
        "ran_ms": (0, 65535),
        "end_reason": (0, 4),
        "faults": (0, 127),
    }
    ARRAYS: ClassVar[dict[str, int]] = {}

    time_ms: int
    pulse_sequence: int
    ran_ms: int
    end_reason: int
    faults: int


MESSAGES: dict[int, type[Message]] = {
    Hello.ID: Hello,
    Ping.ID: Ping,
    Pulse.ID: Pulse,
    Stop.ID: Stop,
    Stream.ID: Stream,
    LimitPump.ID: LimitPump,
    LimitPressure.ID: LimitPressure,
    ClearFaults.ID: ClearFaults,
    SetNeutral.ID: SetNeutral,
    TestHang.ID: TestHang,
    Ack.ID: Ack,
    Identity.ID: Identity,
    Limits.ID: Limits,
    Sample.ID: Sample,
    PulseEnded.ID: PulseEnded,
}
"""Every message by its id."""
