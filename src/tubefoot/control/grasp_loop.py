"""The loop of a grasp: angles and pressures in, the protocol's decision, pulses and hands out.

Works on one rig for both fingers or one for each, real or virtual, and on two sources of angles. Whatever
ends it, the pumps stand and the reason is in the record.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from tubefoot.control.fault_wait import FaultWait
from tubefoot.control.grasp_contract import Decision, FingerView, GripView
from tubefoot.control.grasp_protocol import GraspProtocol
from tubefoot.control.grasp_trace import SENSES, SIDES, command_of, trace_row
from tubefoot.control.guard import PressureGuard
from tubefoot.control.settings import GuardSettings
from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab.rig import Reading, Rig
from tubefoot.units import KPA
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.camera import EndOfFrames, StaleFrameError
from tubefoot.vision.finger import FingerReading

SHORTEST_SHARE = 0.3
"""A pulse is shortened before the pressure limit, but not below this share."""
RELAX_KPA = 4.0
"""A pulse may start only so much below the pressure at which it is stopped."""


class Hands(Protocol):
    """What is done to object and gripper, by hand or by a robot; calls give the time still needed [s]."""

    def place(self) -> float:
        """Hold the object between the fingers."""

    def release(self) -> float:
        """Let go of it."""

    def lift(self) -> float:
        """Lift the gripper slowly."""

    def shake(self) -> float:
        """Shake it."""

    def lower(self) -> float:
        """Set it down again."""


class GraspLoop:
    """Runs one grasp.

    rows : of the trace, one a frame; pulse_log : when each pulse began, and which way for either finger
    """

    def __init__(
        self,
        rigs: Sequence[Rig],
        angles: Sequence[AngleSource],
        hands: Hands,
        watch: Callable[[dict[str, Any]], None] = lambda row: None,
        further: Callable[[], Mapping[str, float]] = dict,
    ):
        """Take connected rigs, their neutral measured, and open sources of angles.

        rigs : one for both fingers, or the right and the left one; angles : of the right and the left finger
        hands : that place, release, lift
        watch : called with every row of the trace; further : columns beside the measured ones
        """
        self._rigs = tuple(rigs)
        self._angles = tuple(angles)
        self._hands = hands
        self._watch = watch
        self._further = further
        self.rows: list[dict[str, Any]] = []
        self._newest: list[FingerReading | None] = [None, None]
        self._began = self._rigs[0].clock.now()
        self._held_back = 0.0
        self._waiting: Decision | None = None
        self._pulse_ends = -math.inf
        self._hands_ready: float | None = None
        self.pulse_log: list[tuple[float, tuple[int, int]]] = []
        self._rise = [0.0] * len(self._rigs)
        self._pulsed: list[tuple[float, float] | None] = [None] * len(self._rigs)

    def run(self, protocol: GraspProtocol) -> None:
        """Carry a grasp out; its outcome is the protocol's, its trace in `rows`.

        protocol : that decides
        """
        guards = [
            PressureGuard(
                rig.limits, GuardSettings(margin_kpa=protocol.settings.margin_kpa, relax_kpa=RELAX_KPA)
            )
            for rig in self._rigs
        ]
        faults = FaultWait(self._rigs, guards, protocol.settings.patience_s)
        try:
            while protocol.phase != "done":
                self._cycle(protocol, guards, faults)
        except KeyboardInterrupt:
            protocol.give_up("interrupted: stopped by Ctrl-C")
        except SafetyStop as error:
            protocol.give_up(f"safety stop: {error}")
        except LinkError as error:
            protocol.give_up(f"link lost: {error}")
        finally:
            for rig in self._rigs:
                with contextlib.suppress(LinkError):
                    rig.stop()

    def latencies(self, protocol: GraspProtocol, first_touch: Sequence[float | None]) -> list[int | None]:
        """Pulses from each finger's true first touch to its detection: 0 for the pulse in which it touched.

        protocol : that was carried out; first_touch : on the rigs' clock [s]

        Negative where contact was reported before any touch; None where a finger never touched or was never
        heard.
        """
        found: list[int | None] = []
        for side, touch in enumerate(first_touch):
            reported = protocol.outcome.contact_pulse[side]
            if not reported:
                found.append(None)
            elif touch is None or touch > protocol.outcome.contact_time[side]:
                found.append(-1)
            else:
                begun = sum(time <= touch and pulses[side] > 0 for time, pulses in self.pulse_log)
                found.append(reported - begun)
        return found

    # ---- one cycle -----------------------------------------------------------------------------------------

    def _cycle(self, protocol: GraspProtocol, guards: Sequence[PressureGuard], faults: FaultWait) -> None:
        for side in (0, 1):
            self._look(side)
        samples = [rig.read() for rig in self._rigs]
        now = self._rigs[0].clock.now()
        stopped = faults.waits(samples, now)
        self._note_rise(samples)
        self._guard(samples, guards)
        view = self._view(samples, now)
        blind = [side for side, finger in zip(SIDES, view.fingers, strict=True) if now - finger.seen_at > 0.5]
        seen = max(self._began, min(finger.seen_at for finger in view.fingers))
        if blind and now - seen > protocol.settings.patience_s:
            raise LinkError(
                f"the {blind[0]} finger's markers were not seen for {protocol.settings.patience_s:g} s"
            )
        decision = Decision() if blind or stopped else self._decision(protocol, view, now)
        self._obey(decision, samples, guards, protocol, now)
        row = {"time_s": now - self._began}
        command = command_of(decision, self._waiting is None)
        row |= trace_row(view, self._newest, samples, protocol, command) | dict(self._further())
        self.rows.append(row)
        self._watch(row)

    def _decision(self, protocol: GraspProtocol, view: GripView, now: float) -> Decision:
        """The protocol's, once the hands have done what they were asked for."""
        if self._hands_ready is not None:
            if now < self._hands_ready:
                return protocol.meanwhile(view)
            self._hands_ready = None
            protocol.hands_done(now)
        if self._waiting is None:
            return protocol.decide(view)
        protocol.see(view)
        return self._waiting

    def _look(self, side: int) -> None:
        """Take the next reading of a finger; keep the last where there is none."""
        try:
            reading = self._angles[side].read()
        except EndOfFrames:
            raise LinkError("the camera's frames have ended; a recording cannot be grasped by") from None
        except StaleFrameError:
            return  # the hands took their time
        if math.isfinite(reading.bend):
            self._newest[side] = reading

    def _view(self, samples: Sequence[Reading], now: float) -> GripView:
        right, left = (self._finger_view(side, samples[min(side, len(samples) - 1)]) for side in (0, 1))
        running = any(sample.direction for sample in samples) or now < self._pulse_ends
        return GripView(now, (right, left), running)

    def _finger_view(self, side: int, sample: Reading) -> FingerView:
        reading, sense = self._newest[side], SENSES[side]
        right, left = sample.gauge_pressures[:2]
        if reading is None:
            return FingerView(-math.inf, math.nan, math.nan, math.nan, (right, left))
        return FingerView(
            reading.time_s,
            sense * reading.bend,
            sense * reading.theta1,
            sense * reading.theta2,
            (right, left),
        )

    def _guard(self, samples: Sequence[Reading], guards: Sequence[PressureGuard]) -> None:
        """Stop a pump before its rig's pressure limits."""
        for rig, sample, guard in zip(self._rigs, samples, guards, strict=True):
            right, left = sample.gauge_pressures[:2]
            if sample.direction and guard.ends_pulse(sample.direction, (right, left)):
                rig.stop()

    def _obey(
        self,
        decision: Decision,
        samples: Sequence[Reading],
        guards: Sequence[PressureGuard],
        protocol: GraspProtocol,
        now: float,
    ) -> None:
        if decision.request:
            lasting = self._asked(decision.request)
            self._hands_ready = self._rigs[0].clock.now() + lasting
            return
        directions = self._directions(decision)
        if not any(directions):
            return
        for sample, guard, direction in zip(samples, guards, directions, strict=True):
            right, left = sample.gauge_pressures[:2]
            if direction and guard.forbids_pulse(direction, (right, left)):
                if decision.optional:
                    return
                self._wait_for_pressure(decision, guard.describe((right, left)), protocol, now)
                return
        self._waiting, self._held_back = None, 0.0
        lasting = min(
            self._bearable(number, samples[number], decision.duration, protocol)
            for number in range(len(samples))
        )
        for number, (rig, direction) in enumerate(zip(self._rigs, directions, strict=True)):
            if direction:
                rig.pulse(direction, protocol.settings.pulses.duty, lasting)
                self._pulsed[number] = (_highest(samples[number]), lasting)
        self._pulse_ends = now + lasting
        self.pulse_log.append((now, decision.pulses))

    def _asked(self, request: str) -> float:
        """Ask the hands; how long they will still take [s]."""
        asked: dict[str, Callable[[], float]] = {
            "place": self._hands.place,
            "release": self._hands.release,
            "lift": self._hands.lift,
            "shake": self._hands.shake,
            "lower": self._hands.lower,
        }
        return asked[request]()

    def _directions(self, decision: Decision) -> tuple[int, ...]:
        if len(self._rigs) == 2:
            return decision.pulses
        right, left = decision.pulses
        return (right or left,)

    def _bearable(self, number: int, sample: Reading, duration: float, protocol: GraspProtocol) -> float:
        """A pulse's duration [s], shortened where the pressure would pass the guard's limit as it rose in the
        last."""
        room = self._rigs[number].limits.pressure_high - protocol.settings.margin_kpa * KPA - _highest(sample)
        if self._rise[number] * duration <= room:
            return duration
        return max(SHORTEST_SHARE * duration, room / self._rise[number])

    def _note_rise(self, samples: Sequence[Reading]) -> None:
        """How fast the highest pressure rose in the pulse that runs [MPa/s]."""
        for number, sample in enumerate(samples):
            begun = self._pulsed[number]
            if begun is not None:
                self._rise[number] = max(0.9 * self._rise[number], (_highest(sample) - begun[0]) / begun[1])
                if not sample.direction and self._rigs[number].clock.now() > self._pulse_ends + 0.1:
                    self._pulsed[number] = None

    def _wait_for_pressure(self, decision: Decision, limit: str, protocol: GraspProtocol, now: float) -> None:
        """Keep a pulse until the wall has relaxed; give up in the end."""
        self._waiting = decision
        self._held_back = self._held_back or now
        if now - self._held_back > protocol.settings.patience_s:
            self._waiting = None
            protocol.give_up(
                f"held back by the pressure limit for {protocol.settings.patience_s:g} s: {limit}"
            )


def _highest(sample: Reading) -> float:
    """Highest gauge pressure of the two branches [MPa]."""
    return max(sample.gauge_pressures[:2])
