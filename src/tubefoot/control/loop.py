"""The loop: one frame, one sample, one decision, on the rig's clock, real or virtual.

The pump never runs blind: it stops when no angle has come for `blind_s`, when a limit is near, when the
bench does not answer, when anything raises. Whatever ends a motion, the pump stands and the reason is in
the record.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping
from typing import Any

from tubefoot.control.contract import Command, Controller, Finished, Measurement, Pulse, Stop, Wait
from tubefoot.control.guard import CLEARED_MAX, PRESSURE_FAULTS, AnswerCheck, PressureGuard
from tubefoot.control.motion import Motion as Motion
from tubefoot.control.motion import MotionState, blind_row, seen_row
from tubefoot.control.settings import BendSettings
from tubefoot.errors import LinkError, SafetyStop
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.rig import Reading, Rig, fault_advice, fault_names
from tubefoot.units import ML
from tubefoot.vision.angles import AngleSource
from tubefoot.vision.camera import EndOfFrames
from tubefoot.vision.finger import FingerReading

END_HEARD_S, END_POLL_S = 0.1, 2e-3
"""How long the end of a stopped pulse is waited for, and in which steps [s]."""


class BendLoop:
    """Drives one finger on one bench; motions follow each other on one clock."""

    def __init__(
        self,
        rig: Rig,
        angles: AngleSource,
        settings: BendSettings,
        recorder: Recorder | None = None,
        watch: Callable[[dict[str, Any]], None] = lambda row: None,
        further: Callable[[], Mapping[str, float]] = dict,
    ):
        """Take a connected rig, its neutral measured, and an open source of angles.

        rig : that pumps; angles : that sees
        settings : of guard and goal
        recorder : told of every frame's angles and of every decision
        watch : called with every row of the trace
        further : columns beside the measured ones, recorded and never steered by
        """
        self._rig = rig
        self._angles = angles
        self._settings = settings
        self._guard = PressureGuard(rig.limits, settings.guard)
        self._recorder = recorder
        self._watch = watch
        self._further = further

    def run(
        self, controller: Controller, volume_foreseen: float = math.inf, part: str = "", timed: bool = True
    ) -> Motion:
        """The motion, once the controller has finished or something ended it; the pump then stands.

        controller : that decides
        volume_foreseen : that the motion should take at most [mm^3]; a multiple of it suggests a leak
        part : name of the motion in the trace
        timed : whether the goal's limits of time and pulses hold; a trajectory has its own end
        """
        motion = Motion(controller.name, self._rig.clock.now())
        state = MotionState(AnswerCheck(self._settings.guard), motion.began, volume_foreseen, part, timed)
        state.volume_at_start = self._rig.read().pumped_volume
        try:
            while not motion.reason:
                self._cycle(controller, motion, state)
        except KeyboardInterrupt:
            motion.reason = "interrupted: stopped by Ctrl-C"
        except SafetyStop as error:
            motion.reason = f"safety stop: {error}"
        except LinkError as error:
            motion.reason = f"link lost: {error}"
        finally:
            with contextlib.suppress(LinkError):
                self._rig.stop()
        motion.ended = self._rig.clock.now()
        self._event("motion ended", part=part, reason=motion.reason)
        return motion

    # ---- one cycle -----------------------------------------------------------------------------------------

    def _cycle(self, controller: Controller, motion: Motion, state: MotionState) -> None:
        reading = self._look(state)
        sample = self._rig.read()
        now = self._rig.clock.now()
        seen = self._measured(reading, sample, now, state)
        if self._stopped_by_fault(sample, motion, state):
            return
        if seen is None:
            self._while_blind(now, sample, motion, state)
            return
        if fault := state.answers.fault(seen):
            motion.reason = f"no answer: {fault}"
            self._rig.stop()
            return
        command = self._given_up(seen, motion, state) or controller.decide(seen)
        command = self._within_limits(command, sample, state, now)
        self._obey(command, sample, motion, state)
        target = controller.target_at(seen.seen_at)
        row = seen_row(seen, target, sample, motion, state, command)
        self._keep(row, motion)
        if isinstance(command, Pulse | Stop | Finished):
            self._record(seen, row, motion.controller)

    def _look(self, state: MotionState) -> FingerReading | None:
        """The next reading, recorded; None when the camera delivers nothing."""
        try:
            reading = self._angles.read()
        except EndOfFrames:
            raise LinkError("the camera's frames have ended; a recording cannot be steered by") from None
        except LinkError as error:
            state.why_blind = str(error)
            return None
        if self._recorder is not None:
            now = self._rig.clock.now()
            self._recorder.angle(reading.time_s, now, reading.columns(), reading.fault)
        return reading

    def _measured(
        self, reading: FingerReading | None, sample: Reading, now: float, state: MotionState
    ) -> Measurement | None:
        """What the controller sees; None for a frame that does not tell the angle."""
        if reading is None or reading.lost or not math.isfinite(reading.bend):
            if reading is not None:
                state.why_blind = f"the tip marker is lost: {reading.fault}"
            return None
        if now - reading.time_s > state.oldest_s:
            state.why_blind = f"the newest frame is {now - reading.time_s:.2f} s old"
            return None
        state.sighted = now
        right, left = sample.gauge_pressures[:2]
        return Measurement(
            now,
            reading.time_s,
            reading.bend,
            reading.sigma,
            (right, left),
            sample.pumped_volume,
            sample.time,
            sample.direction or self._just_sent(state),
            state.held_back,
        )

    def _just_sent(self, state: MotionState) -> int:
        """Direction of a pulse that began after the newest sample, 0 where there is none."""
        return state.direction if self._rig.last_pulse is None else 0

    def _while_blind(self, now: float, sample: Reading, motion: Motion, state: MotionState) -> None:
        """No angle in this frame: stop the pump soon, wait, give up in the end."""
        guard, blind = self._settings.guard, now - state.sighted
        if blind > guard.blind_s and sample.direction:
            self._rig.stop()
            self._event("pump stopped", reason=state.why_blind)
        if blind > guard.patience_s:
            motion.reason = f"blind for {blind:.1f} s: {state.why_blind}"
        self._keep(blind_row(now, sample, motion, state), motion)

    def _stopped_by_fault(self, sample: Reading, motion: Motion, state: MotionState) -> bool:
        """Whether the board has a fault: one of pressure is waited out, any other ends the motion."""
        faults = sample.faults
        if not faults:
            return False
        if faults & ~PRESSURE_FAULTS or state.cleared >= CLEARED_MAX:
            motion.reason = f"board fault: {fault_names(faults)}; {fault_advice(faults)}"
            return True
        right, left = sample.gauge_pressures[:2]
        state.press(self._rig.clock.now())
        if self._guard.ends_pulse(1, (right, left)) or self._guard.ends_pulse(-1, (right, left)):
            if state.pressed_s > self._settings.guard.pressed_max_s:
                motion.reason = _out_of_reach(self._guard.describe((right, left)), state.pressed_s)
            return True
        self._rig.clear_faults()
        state.cleared += 1
        self._event("cleared", faults=fault_names(faults))
        return True

    def _given_up(self, seen: Measurement, motion: Motion, state: MotionState) -> Command | None:
        """The end of a motion that does not come to an end by itself."""
        goal, guard = self._settings.goal, self._settings.guard
        passed = seen.time - motion.began
        if state.pressed_s > guard.pressed_max_s:
            return Finished(False, _out_of_reach(self._guard.describe(seen.pressures), state.pressed_s))
        if abs(seen.pumped_volume - state.volume_at_start) > guard.volume_excess * state.volume_foreseen:
            return Finished(
                False,
                f"leak suspected: {seen.pumped_volume / ML:.2f} ml pumped, {guard.volume_excess:g} times "
                "what the motion should take; look for lost fluid or air in the loop",
            )
        if state.timed and passed > goal.time_max_s:
            return Finished(False, f"not settled within {goal.time_max_s:g} s")
        if (
            state.timed
            and motion.pulses >= goal.pulses_max
            and not seen.direction
            and state.hopeless(seen.time)
        ):
            return Finished(False, f"not settled with {goal.pulses_max} pulses")
        return None

    def _within_limits(self, command: Command, sample: Reading, state: MotionState, now: float) -> Command:
        """The command, unless the pressure limits forbid it."""
        right, left = sample.gauge_pressures[:2]
        soon = state.extrapolated(sample)
        state.held_back = False
        eased = isinstance(command, Pulse) and command.in_place and _eases(command, sample, state)
        if (
            isinstance(command, Pulse)
            and not eased
            and self._guard.forbids_pulse(command.direction, (right, left))
        ):
            state.held_back = True
            state.press(now)
            return (
                Stop("held back by the pressure limit") if sample.direction else Wait("held back by pressure")
            )
        if (
            sample.direction
            and not isinstance(command, Stop)
            and self._guard.ends_pulse(sample.direction, soon)
        ):
            state.held_back = True
            return Stop("pressure limit")
        if isinstance(command, Wait) and command.pressed:
            state.press(now)
        else:
            state.rest()
        return command

    def _obey(self, command: Command, sample: Reading, motion: Motion, state: MotionState) -> None:
        match command:
            case Finished():
                motion.settled, motion.reason = command.settled, command.reason
            case Stop():
                self._rig.stop()
            case Pulse():
                going_on = command.in_place and state.direction == command.direction
                going_on = going_on and self._rig.last_pulse is None and state.duty > 0
                if command.in_place and state.duty:
                    self._make_room()
                sent = self._rig.pulse(command.direction, float(command.duty), float(command.duration))
                if not going_on:
                    motion.pulses += 1
                state.duty, state.direction, state.last_pulse = (
                    sent.duty,
                    sent.direction,
                    self._rig.clock.now(),
                )
            case Wait():
                pass

    def _make_room(self) -> None:
        """End a pulse that may still run, and hear of its end."""
        if self._rig.last_pulse is not None:
            return
        self._rig.stop()
        deadline = self._rig.clock.now() + END_HEARD_S
        while self._rig.last_pulse is None and self._rig.clock.now() < deadline:
            self._rig.wait(END_POLL_S)

    # ---- the record ----------------------------------------------------------------------------------------

    def _keep(self, row: dict[str, Any], motion: Motion) -> None:
        """Put a row into the trace, with what else is known, and show it."""
        row |= self._further()
        motion.rows.append(row)
        self._watch(row)

    def _record(self, seen: Measurement, row: dict[str, Any], controller: str) -> None:
        """Tell the recorder of a decision."""
        if self._recorder is not None:
            values = {key: row[key] for key in ("command", "note", "bend_deg", "target_deg", "pulses")}
            self._recorder.decision(seen.time, controller, values)

    def _event(self, name: str, **detail: str) -> None:
        if self._recorder is not None:
            with contextlib.suppress(LinkError):
                self._recorder.event(self._rig.clock.now(), name, **detail)


def _eases(command: Pulse, sample: Reading, state: MotionState) -> bool:
    """Whether a pulse takes the place of a running one that way, at no larger duty."""
    return command.direction == sample.direction == state.direction and command.duty <= state.duty


def _out_of_reach(where: str, seconds: float) -> str:
    return (
        f"out of reach: held back by the pressure limit for {seconds:.0f} s ({where}); lower the target or "
        "raise the limit in the rig file"
    )
