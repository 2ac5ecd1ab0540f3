"""The Rig behind a board, real or simulated: the contract of `rig.py` over a `Link`."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import NoReturn

from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab import messages
from tubefoot.lab.board_time import BoardTime
from tubefoot.lab.codec import Frame
from tubefoot.lab.link import Link, Sent
from tubefoot.lab.messages import EndReason, Fault, Status
from tubefoot.lab.port import Port
from tubefoot.lab.pump import plan_pulse, pumped_volume
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.rig import EndedPulse, Neutral, Reading, RigLimits, SentPulse, fault_advice, fault_names
from tubefoot.lab.sensing import counts_at, gauge_pressure, supply_voltage
from tubefoot.lab.settings import BRANCHES, RigSettings
from tubefoot.units import ML

PING_INTERVAL_S = 0.1
STALE_S = 0.5
KEPT_READINGS = 100_000


class BoardRig:
    """A bench behind a port; `Rig` says what its methods promise.

    on_reading : called with every sample's reading, whoever waits for it
    """

    def __init__(self, port: Port, settings: RigSettings, recorder: Recorder | None = None):
        """Describe the bench; nothing is opened yet.

        port : where the board is
        settings : its sensors, pump and limits
        recorder : where everything goes, if anywhere
        """
        self.settings = settings
        self.clock = port.clock
        self.limits: RigLimits = settings.rig_limits()
        self.last_pulse: EndedPulse | None = None
        self.identity: messages.Identity | None = None
        self.lost_samples = 0
        self.link = Link(port)
        self.link.on_frame = self._take_frame
        self.link.on_sent = self._note_sent
        self.on_reading: Callable[[Reading], None] = lambda reading: None
        self._recorder = recorder
        self._board_time = BoardTime()
        self._neutral: Neutral | None = None
        self._volume = 0.0
        self._running: SentPulse | None = None
        self._running_sequence: int | None = None
        self._readings: deque[Reading] = deque(maxlen=KEPT_READINGS)
        self._newest: Reading | None = None
        self._heard = 0.0
        self._sample_sequence: int | None = None
        self._limits_in_force: messages.Limits | None = None
        self._faults = Fault(0)

    @property
    def faults(self) -> Fault:
        """Latched faults, as of the last frame that told."""
        return self._faults

    @property
    def damaged_frames(self) -> int:
        """Frames from the board that failed a check."""
        return self.link.damaged_frames

    def connect(self) -> None:
        """Begin a session: hello, limits (checked by their echo), stream."""
        self._sample_sequence = None
        self._board_time = BoardTime()
        self.identity = self.link.connect()
        self._running = None
        self._send_limits()
        self._obey(messages.Stream(1000 // self.settings.board.sample_rate_hz))
        self._record(lambda recorder: recorder.event(self.clock.now(), "connected"))

    def close(self) -> None:
        """Stop the pump and close the port."""
        with contextlib.suppress(LinkError):
            self.link.stop()
        self.link.close()

    def read(self) -> Reading:
        """The newest reading; waits for a first one, raises LinkError when the newest is older than 0.5 s."""
        self._service(0.0)
        deadline = self.clock.now() + STALE_S
        while self._newest is None or self.clock.now() - self._heard > STALE_S:
            if self.clock.now() >= deadline:
                raise LinkError(
                    f"{self.link.port.name}: no sample for {STALE_S:g} s; check the cable, connect again"
                )
            self._service(0.01)
        return self._aged(self._newest)

    def wait(self, seconds: float) -> list[Reading]:
        """The readings that came while time passed.

        seconds : how long [s]
        """
        self._service(0.0)
        self._readings.clear()
        deadline = self.clock.now() + seconds
        while (left := deadline - self.clock.now()) > 0:
            self._service(min(left, PING_INTERVAL_S))
        return [self._aged(reading) for reading in self._readings]

    def pulse(self, direction: int, duty: float, duration: float) -> SentPulse:
        """What was really sent.

        direction : 1 forward, -1 reverse
        duty : 0 to 1
        duration : [s]
        """
        self._service(0.0)
        sent = plan_pulse(self.limits, self.settings.pump, direction, duty, duration)
        self._check_volume(sent.volume)
        command = messages.Pulse(direction, round(sent.duty * 255), round(sent.duration * 1e3))
        last, busy = self.last_pulse, self._running
        if busy is not None:
            raise LinkError("the last pulse is still running; wait for its end, or stop it")
        # Before the answer: the end of a very short pulse may come together with it.
        self.last_pulse, self._running, self._running_sequence = None, sent, self.link.next_sequence
        try:
            answer = self.link.command(command)
        except SafetyStop:  # the line lets no pulse pass
            self.last_pulse, self._running = last, None
            raise
        if answer.status != Status.OK:
            self.last_pulse, self._running = last, None
            self._refuse(answer)
        sent = replace(sent, time=self.clock.now())
        self._record(lambda recorder: recorder.pulse(sent))
        return sent

    def stop(self) -> None:
        """Stop the pump now; raises LinkError when the board does not confirm (it then stops by silence)."""
        self.link.stop()
        self._service(0.0)

    def clear_faults(self) -> None:
        """Clear the latched faults; raises SafetyStop while a cause persists."""
        self._obey(messages.ClearFaults())

    def set_neutral(self, neutral: Neutral) -> None:
        """Take a reading as zero pressure, and the present volume as zero volume.

        neutral : the reading
        """
        self._obey(messages.SetNeutral())
        self._neutral = neutral
        self._volume = 0.0
        self._record(lambda recorder: recorder.neutral(self.clock.now(), neutral))

    def record_into(self, recorder: Recorder | None) -> None:
        """Record into another file from now on, beginning with the zero in force; the last one stays open.

        recorder : begun; None to record no more
        """
        self._recorder = recorder
        if self._neutral is not None:
            zero = self._neutral
            self._record(lambda writer: writer.neutral(self.clock.now(), zero))

    def round_trip(self) -> float:
        """Time from a sign of life to its answer [s]."""
        return self.link.round_trip()

    # ---- commands ------------------------------------------------------------------------------------------

    def _obey(self, command: messages.Message) -> None:
        """Send a command that must succeed."""
        answer = self.link.command(command)
        if answer.status != Status.OK:
            self._refuse(answer)

    def _refuse(self, answer: messages.Ack) -> NoReturn:
        """Raise what the board's refusal means."""
        self._faults = Fault(answer.faults)
        status = Status(answer.status)
        if status in (Status.FAULT_LATCHED, Status.CONDITION_PERSISTS):
            what = "refuses to pump that way" if status is Status.FAULT_LATCHED else "cannot clear"
            raise SafetyStop(
                f"the board {what}: {fault_names(self._faults)}\n{fault_advice(self._faults)}", answer.faults
            )
        if status is Status.NO_SESSION:
            raise LinkError("the board has restarted; connect again")
        raise LinkError(f"the board refused the command: {status.name.lower()}")

    def _check_volume(self, volume: float) -> None:
        """Refuse a pulse that leads further from neutral than the limit."""
        after, limit = self._volume + volume, self.limits.pumped_volume
        if abs(after) > limit and abs(after) > abs(self._volume):
            raise SafetyStop(
                f"volume {after / ML:.1f} ml exceeds the {limit / ML:.1f} ml limit of this finger; "
                "lower the target or edit limits in the rig file"
            )

    def _send_limits(self) -> None:
        """Set the board's limits and wait until their echo says the same."""
        wanted, channels = self.settings.limits, self.settings.board.channels
        pump = messages.LimitPump(
            max_duty=max(1, int(wanted.duty_max * 255 + 1e-9)),
            max_pulse_ms=round(wanted.pulse_max_s * 1e3),
            silence_ms=wanted.silence_ms,
            channels=channels,
        )
        sensors = [self.settings.sensor(branch) for branch in BRANCHES[:channels]]
        low = tuple(counts_at(self.limits.pressure_low, sensor) for sensor in sensors)
        high = tuple(counts_at(self.limits.pressure_high, sensor) for sensor in sensors)
        self._obey(pump)
        for channel in range(channels):
            self._obey(messages.LimitPressure(channel, low[channel], high[channel]))
        expected = (pump.max_duty, pump.max_pulse_ms, pump.silence_ms, channels, low, high)
        deadline = self.clock.now() + STALE_S
        while (echo := self._echoed_limits(channels)) != expected:
            if self.clock.now() >= deadline:
                raise LinkError(f"the board says its limits are {echo}, not {expected}; flash it anew")
            self._service(0.01)

    def _echoed_limits(self, channels: int) -> tuple[object, ...] | None:
        """The limits that the board said are in force, of the inputs in use."""
        echo = self._limits_in_force
        if echo is None:
            return None
        low, high = echo.low_counts[:channels], echo.high_counts[:channels]
        return (echo.max_duty, echo.max_pulse_ms, echo.silence_ms, echo.channels, low, high)

    # ---- what comes in -------------------------------------------------------------------------------------

    def _service(self, timeout: float) -> None:
        """Take in what has come, and give a sign of life when it is due."""
        if self.clock.now() - self.link.last_sent >= PING_INTERVAL_S:
            self.link.ping()
        self.link.service(timeout)
        self._record(lambda recorder: recorder.flush_if_due(self.clock.now()))

    def _take_frame(self, time: float, frame: Frame) -> None:
        match frame.message:
            case messages.Sample() as sample:
                self._take_sample(time, frame.sequence, sample)
            case messages.Ack() as ack:
                self._record(lambda recorder: recorder.acknowledgement(time, frame.sequence, ack))
            case messages.PulseEnded() as ended:
                self._note_faults(time, ended.faults, 0)
                ended_at = self._board_time.host_time(self._board_time.observe(ended.time_ms, time))
                self._end_pulse(ended_at, ended.pulse_sequence, ended.ran_ms, ended.end_reason)
            case messages.Limits() as limits:
                self._limits_in_force = limits
            case messages.Identity() as identity:
                self._note_faults(time, identity.faults, 0)
                if identity.started:
                    self._note_restart(time)

    def _take_sample(self, time: float, sequence: int, sample: messages.Sample) -> None:
        if self._sample_sequence is not None:
            self.lost_samples += (sequence - self._sample_sequence - 1) % 256
        self._sample_sequence = sequence
        board = self._board_time.observe(sample.time_ms, time)
        middle = self._board_time.host_time(board - 0.5e-3 * sample.averaged)
        if self._newest is not None:
            middle = max(middle, self._newest.time + 1e-6)
        self._note_faults(time, sample.faults, sample.fault_channels)
        self._end_pulse(time, sample.pulse_sequence, sample.ran_ms, sample.end_reason)
        gauge, supply = self._pressures(sample)
        zero = self._neutral.pressures if self._neutral else (0.0,) * len(gauge)
        self._newest = Reading(
            time=middle,
            age=time - middle,
            pressures=tuple(p - p0 for p, p0 in zip(gauge, zero, strict=True)),
            gauge_pressures=gauge,
            supply=supply,
            direction=sample.direction,
            pumped_volume=self._volume + self._running_volume(sample),
            faults=self._faults,
        )
        reading, self._heard = self._newest, time
        self._readings.append(reading)
        self._record(lambda recorder: recorder.sample(reading, sample))
        self.on_reading(reading)

    def _pressures(self, sample: messages.Sample) -> tuple[tuple[float, ...], float]:
        """Gauge pressure of each branch [MPa] and the supply [V]."""
        supply = supply_voltage(sample.supply, self.settings.board.reference_v)
        branches = BRANCHES[: self.limits.channels]
        readings = zip(branches, sample.pressure, strict=False)
        return tuple(gauge_pressure(r, supply, self.settings.sensor(b)) for b, r in readings), supply

    def _running_volume(self, sample: messages.Sample) -> float:
        if self._running is None or sample.pulse_sequence != self._running_sequence:
            return 0.0
        sent = self._running
        return pumped_volume(self.settings.pump, sent.direction, sent.duty, sample.ran_ms * 1e-3)[0]

    def _end_pulse(self, time: float, sequence: int, ran_ms: int, reason: int) -> None:
        """Note the end of the running pulse, told by its own message or by a sample."""
        sent = self._running
        if sent is None or sequence != self._running_sequence or reason == EndReason.NONE:
            return
        duration = ran_ms * 1e-3
        volume, _ = pumped_volume(self.settings.pump, sent.direction, sent.duty, duration)
        self._running = None
        self._volume += volume
        ended = EndedPulse(time, duration, volume, EndReason(reason))
        self.last_pulse = ended
        self._record(lambda recorder: recorder.pulse_ended(ended))

    def _note_faults(self, time: float, faults: int, channels: int) -> None:
        if Fault(faults) == self._faults:
            return
        self._faults = Fault(faults)
        self._record(lambda recorder: recorder.fault(time, Fault(faults), channels))

    def _note_restart(self, time: float) -> None:
        """The board started anew: its clock is at zero and a running pulse has ended, when is not known."""
        self._board_time = BoardTime()
        self._sample_sequence = None
        self._running = None
        self._record(lambda recorder: recorder.event(time, "board restarted"))

    def _note_sent(self, sent: Sent) -> None:
        self._record(lambda recorder: recorder.command(sent))

    def _record(self, write: Callable[[Recorder], None]) -> None:
        """Record, if there is a recorder; when it fails (disk full), stop the pump and raise."""
        if self._recorder is None:
            return
        try:
            write(self._recorder)
        except LinkError:
            self._recorder = None
            with contextlib.suppress(LinkError):
                self.link.stop()
            raise

    def _aged(self, reading: Reading) -> Reading:
        return replace(reading, age=self.clock.now() - reading.time)
