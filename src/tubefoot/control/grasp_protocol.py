"""The protocol of a grasp as a state machine: what it sees in, pulses and requests to the hands out.

    open: outward pulses -> place -> close: inward pulses until contact is sure -> grip: inward pulses until
    the grip is firm -> release -> settle -> hold -> lift -> shake -> lower -> let go: outward pulses -> done

Each pulse is followed by a pause, and only pauses are judged. With a pump for each finger the finger that
touches first waits for the other one. Angles are inward positive, pulses inward are +1. Nothing here knows a
rig, a camera or a simulator: `grasp_loop` does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tubefoot.control.first_contact import ContactSense, GripLever, Pause
from tubefoot.control.grasp_contract import WAIT, Decision, FingerView, GripView, Outcome, Phase, Request
from tubefoot.control.grasp_settings import GraspSettings
from tubefoot.control.grip_goal import GripGoal, free_width
from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.reduced.finger import ReducedFinger

JUDGED_S = 0.25
"""Last part of a pause, over which frames and pressures are averaged [s]."""
SETTLE_S = 1.0
"""After the hand has let go, before the hold counts [s]."""
RELEASED_PULSES = 3
"""Outward pulses that let the object go."""


class GraspProtocol:
    """One grasp, from straight fingers to the object let go.

    phase : where it is; outcome : what it came to
    """

    def __init__(
        self,
        what: GraspObject,
        pose: Pose,
        finger: ReducedFinger,
        lever: GripLever,
        settings: GraspSettings | None = None,
        coupled: bool = False,
    ):
        """Set it up.

        what : the object; pose : front or side; finger : the reduced finger, for its geometry
        lever : of a contact at the object's height; settings : of the grasp; coupled : one pump for both
            fingers
        """
        self.settings = settings or GraspSettings()
        self.phase: Phase = "open"
        self.outcome = Outcome()
        self.goal = GripGoal.of(what, pose, self.settings.grip)
        self._needed = free_width(what, pose, self.settings)
        self._finger = finger
        self._low = self.settings.height_mm - 0.5 * what.sizes(pose)[2]
        self._senses = tuple(ContactSense(self.settings.contact, lever) for _ in range(2))
        self._coupled = coupled
        self._views: list[GripView] = []
        self._since = float("nan")
        self._pulsed_until = -np.inf
        self._count = 0

    @property
    def touching(self) -> tuple[bool, bool]:
        """Whether contact of the right and the left finger is sure."""
        return self._senses[0].touching, self._senses[1].touching

    @property
    def lags(self) -> tuple[tuple[float, float], ...]:
        """Each finger's lag of shape and of pressure [rad]."""
        return tuple((sense.shape_lag, sense.pressure_lag) for sense in self._senses)

    def decide(self, view: GripView) -> Decision:
        """What to do now.

        view : the newest; times never go back
        """
        if view.pumping:
            self._views.clear()
            self._pulsed_until = view.time
            return WAIT
        self._views.append(view)
        if self.phase == "done":
            return WAIT
        if self.phase in ("open", "close", "grip", "let go"):
            pause = self.settings.pulses.pause_s if self._count else JUDGED_S
            if view.time < max(self._pulsed_until + pause, self._views[0].time + JUDGED_S):
                return WAIT
            if self.phase in ("close", "grip") and not all(pause.known for pause in self._pauses()):
                return self._blind(view)
            return {"open": self._open, "close": self._close, "grip": self._grip, "let go": self._let_go}[
                self.phase
            ]()
        return self._test(view)

    def give_up(self, reason: str) -> None:
        """End the grasp where it is.

        reason : why
        """
        self.outcome.reason = self.outcome.reason or reason
        self.phase = "done"

    def hands_done(self, time: float) -> None:
        """The hands have done what was asked for.

        time : now [s]
        """
        self._since = time
        self._views.clear()
        following: dict[Phase, Phase] = {
            "place": "close",
            "release": "settle",
            "lift": "shake" if self.settings.test.shake_mm and self.settings.test.shake_s else "lower",
            "shake": "lower",
            "lower": "let go",
        }
        self.phase = following[self.phase]
        self._count = 0

    # ---- the phases with pulses ----------------------------------------------------------------------------

    def _open(self) -> Decision:
        pulses = self.settings.pulses
        wanted = pulses.outward
        pauses = self._pauses()
        narrow = [self._opening(pause.bend) < self._needed for pause in pauses]
        if wanted is None and self._count and not any(narrow):
            return self._ask("place")
        if self._count >= (wanted if wanted is not None else pulses.outward_max):
            if wanted is None:
                self.give_up(
                    f"the fingers did not open to {2 * self._needed:.1f} mm in {self._count} outward pulses; "
                    "raise outward_max or outward_s, or grasp a smaller object"
                )
                return WAIT
            return self._ask("place")
        which = (
            (-1, -1) if wanted is not None or self._coupled or not self._count else (-narrow[0], -narrow[1])
        )
        self.outcome.outward_pulses += 1
        return self._pulse((int(which[0]), int(which[1])), pulses.outward_s)

    def _close(self) -> Decision:
        pulses = self.settings.pulses
        pauses = self._pauses()
        for side, (sense, pause) in enumerate(zip(self._senses, pauses, strict=True)):
            if not sense.touching and sense.observe(pause):
                self.outcome.contact_pulse[side] = self._count
                self.outcome.contact_time[side] = self._views[-1].time
        if all(self.touching):
            return self._contact_sure(pauses)
        if self._count >= pulses.inward_max or self._met(pauses):
            self.give_up(
                f"no contact of both fingers in {self._count} inward pulses; nothing to grasp there?"
            )
            return WAIT
        self.outcome.inward_pulses += 1
        which = (1, 1) if self._coupled else tuple(int(not touching) for touching in self.touching)
        return self._pulse((which[0], which[1]), pulses.inward_s)

    def _contact_sure(self, pauses: Sequence[Pause]) -> Decision:
        self.outcome.gripped = True
        self._count = 0
        if self.settings.grip.release == "contact":
            return self._ask("release")
        self.phase = "grip"
        return self._grip(pauses)

    def _grip(self, pauses: Sequence[Pause] | None = None) -> Decision:
        seen = pauses or self._pauses()
        forces = [sense.force(pause) for sense, pause in zip(self._senses, seen, strict=True)]
        self.outcome.grip_force = forces
        firm = [force >= self.goal.force for force in forces]
        enough = min(forces) >= self.goal.force or max(forces) >= self.goal.most
        if enough or self.outcome.grip_pulses >= self.settings.grip.pulses_max:
            if not enough:
                self.outcome.reason = (
                    f"grip of {min(forces):.3f} N instead of {self.goal.force:.3f} N after "
                    f"{self.outcome.grip_pulses} pulses"
                )
            if self.settings.grip.release == "contact":
                self.phase, self._since = "hold", self._views[-1].time
                return WAIT
            return self._ask("release")
        self.outcome.grip_pulses += 1
        self.outcome.inward_pulses += 1
        which = (1, 1) if self._coupled else (int(not firm[0]), int(not firm[1]))
        return self._pulse(which, self.settings.grip.inward_s)

    def _let_go(self) -> Decision:
        if self._count >= RELEASED_PULSES:
            self.give_up("complete")
            return WAIT
        return self._pulse((-1, -1), self.settings.pulses.outward_s)

    # ---- the phases without --------------------------------------------------------------------------------

    def _test(self, view: GripView) -> Decision:
        """Settle and hold by time; the hands' phases go on with `hands_done`."""
        if self.phase == "settle" and view.time >= self._since + SETTLE_S:
            if self.settings.grip.release == "contact" and not self.outcome.grip_pulses:
                self.phase, self._count = "grip", 0
                return WAIT
            self.phase, self._since = "hold", view.time
        elif self.phase == "hold" and view.time >= self._since + self.settings.test.hold_s:
            return self._ask("lift")
        elif self.phase == "shake":
            return Decision(request="shake")
        elif self.phase == "lower":
            return Decision(request="lower")
        return WAIT

    def _blind(self, view: GripView) -> Decision:
        """No pulse without the angles that tell contact and force; give up in the end."""
        if view.time - self._views[0].time > self.settings.patience_s:
            self.give_up(
                f"link lost: the turn of a finger's halves was not seen for {self.settings.patience_s:g} s; "
                "look for markers that are hidden"
            )
        return WAIT

    # ---- tools ---------------------------------------------------------------------------------------------

    def _ask(self, request: Request) -> Decision:
        assert request in ("place", "release", "lift")
        self.phase = request
        return Decision(request=request)

    def _pulse(self, which: tuple[int, int], duration: float) -> Decision:
        self._count += 1
        self._pulsed_until = self._views[-1].time + duration
        self._views.clear()
        return Decision(which, duration)

    def _opening(self, bend: float) -> float:
        """Width from the middle to the inner flank where the object's lower edge will be [mm].

        The finger is taken as an arc from the base cap on.
        """
        finger = self._finger
        along = max(0.0, self._low - finger.cap)
        return 0.5 * self.settings.gap_mm - bend * along**2 / (2.0 * finger.n_units * finger.pitch)

    def _met(self, pauses: Sequence[Pause]) -> bool:
        """Whether the fingers have met in the middle without an object between them."""
        return sum(self._opening(pause.bend) for pause in pauses) <= 0.0

    def _pauses(self) -> tuple[Pause, Pause]:
        """What both fingers showed in the last part of the pause."""
        last = self._views[-1].time
        judged = [view for view in self._views if view.time >= last - JUDGED_S]
        right, left = (_mean([view.fingers[side] for view in judged]) for side in (0, 1))
        return right, left


def _mean(views: list[FingerView]) -> Pause:
    angles = np.array([(view.theta1, view.theta2, view.bend) for view in views])
    pressures = np.array([view.pressures for view in views])
    known = np.isfinite(angles)
    means = [
        float(column[mask].mean()) if mask.any() else float("nan")
        for column, mask in zip(angles.T, known.T, strict=True)
    ]
    return Pause(means[0], means[1], means[2], float((pressures[:, 0] - pressures[:, 1]).mean()))
