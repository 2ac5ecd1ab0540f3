"""The protocol of a grasp as a state machine: what it sees in, pulses and requests to the hands out.

    open: outward pulses -> place -> close: inward pulses until contact is sure -> grip: inward pulses until
    the grip is firm -> release -> settle -> hold -> lift -> shake -> lower -> let go: outward pulses -> done

Each pulse is followed by a pause, and only pauses are judged. With a pump for each finger the finger that
touches first waits for the other one. Angles are inward positive, pulses inward are +1. Nothing here knows a
rig, a camera or a simulator: `grasp_loop` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tubefoot.control.first_contact import ContactSense, Pause, grip_lever
from tubefoot.control.grasp_contract import WAIT, Decision, GripView, Outcome, Phase, Request
from tubefoot.control.grasp_settings import GraspSettings
from tubefoot.control.grip_goal import GripGoal
from tubefoot.control.grip_keeping import GripBuilder, GripKeeper
from tubefoot.control.pauses import JUDGED_S, PauseWatch
from tubefoot.control.placing import free_width, placing_height
from tubefoot.lab.grasp_object import GraspObject, Pose
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import NO_RELAXATION, Prony

SETTLE_S = 1.0
"""After the hand has let go, before the hold counts [s]."""
RELEASED_PULSES = 3
"""Outward pulses that let the object go."""


class GraspProtocol:
    """One grasp, from straight fingers to the object let go.

    phase : where it is; outcome : what it came to
    goal : of the grip; height : at which the object's middle is to be held [mm]
    """

    def __init__(
        self,
        what: GraspObject,
        pose: Pose,
        finger: ReducedFinger,
        settings: GraspSettings | None = None,
        coupled: bool = False,
        memory: Prony = NO_RELAXATION,
    ):
        """Set it up.

        what : the object; pose : front or side; finger : the reduced finger, for its geometry
        settings : of the grasp; coupled : one pump for both fingers
        memory : how the fingers' walls relax
        """
        self.settings = settings or GraspSettings()
        self.phase: Phase = "open"
        self.outcome = Outcome()
        self.goal = GripGoal.of(what, pose, self.settings.grip)
        self._needed = free_width(what, pose, self.settings)
        self._finger = finger
        self.height = placing_height(what, pose, self.settings, finger.length)
        self._low = self.height - 0.5 * what.sizes(pose)[2]
        lever = grip_lever(finger, self.height)
        self._senses = tuple(ContactSense(self.settings.contact, lever) for _ in range(2))
        self._coupled = coupled
        self._builder = GripBuilder(self.goal, self.settings.grip, coupled)
        self._keeper = GripKeeper(self.goal, self.settings.grip, lever, coupled)
        self._watch = PauseWatch(memory)
        self._since = float("nan")
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
        self.see(view)
        if view.pumping or self.phase == "done":
            return WAIT
        if self.phase in ("open", "close", "grip", "let go"):
            if not self._judgeable():
                return WAIT
            if self.phase in ("close", "grip") and not all(pause.known for pause in self._watch.pauses()):
                return self._blind()
            return {"open": self._open, "close": self._close, "grip": self._grip, "let go": self._let_go}[
                self.phase
            ]()
        return self._test(view)

    def see(self, view: GripView) -> None:
        """Take a view without a decision, as while a pulse waits for lower pressures.

        view : the newest
        """
        self._watch.see(view)

    def meanwhile(self, view: GripView) -> Decision:
        """What to do while the hands do what they were asked for: a grip is kept.

        view : the newest
        """
        self.see(view)
        return self._keep() if self.phase in ("lift", "shake") and not view.pumping else WAIT

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
        self._watch.begin_anew()
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
        pauses = self._watch.pauses()
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
        pauses = self._watch.pauses()
        for side, (sense, pause) in enumerate(zip(self._senses, pauses, strict=True)):
            if not sense.touching and sense.observe(pause):
                self.outcome.contact_pulse[side] = self._count
                self.outcome.contact_time[side] = self._watch.now
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
        forces = self._felt(pauses or self._watch.pauses())
        which = self._builder.pulses(forces)
        if which == (0, 0):
            self.outcome.reason = self._builder.shortcoming
            if self.settings.grip.release == "contact":
                self.phase, self._since = "hold", self._watch.now
                return WAIT
            return self._ask("release")
        self.outcome.grip_pulses += 1
        self.outcome.inward_pulses += 1
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
        if self.phase == "hold" and view.time >= self._since + self.settings.test.hold_s:
            return self._ask("lift")
        if self.phase == "shake":
            return Decision(request="shake")
        if self.phase == "lower":
            return Decision(request="lower")
        return self._keep() if self.phase in ("settle", "hold") else WAIT

    def _blind(self) -> Decision:
        """No pulse without the angles that tell contact and force; give up in the end."""
        if self._watch.now - self._watch.still_since > self.settings.patience_s:
            self.give_up(
                f"link lost: the turn of a finger's halves was not seen for {self.settings.patience_s:g} s; "
                "look for markers that are hidden"
            )
        return WAIT

    def _keep(self) -> Decision:
        """Keep force and place of the free object."""
        if not self._judgeable():
            return WAIT
        pauses = self._watch.pauses()
        if not all(pause.known for pause in pauses):
            return WAIT
        which = self._keeper.pulses(pauses, self._felt(pauses))
        if which == (0, 0):
            return WAIT
        self.outcome.keep_pulses += 1
        return replace(self._pulse(which, self.settings.grip.keep_s), optional=True)

    # ---- tools ---------------------------------------------------------------------------------------------

    def _felt(self, pauses: Sequence[Pause]) -> list[float]:
        """Both forces, estimated and noted [N]."""
        self.outcome.grip_force = [s.force(pause) for s, pause in zip(self._senses, pauses, strict=True)]
        return self.outcome.grip_force

    def _ask(self, request: Request) -> Decision:
        assert request in ("place", "release", "lift")
        self.phase = request
        return Decision(request=request)

    def _pulse(self, which: tuple[int, int], duration: float) -> Decision:
        self._count += 1
        self._watch.begin_anew(duration)
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

    def _judgeable(self) -> bool:
        return self._watch.judgeable(self.settings.pulses.pause_s if self._count else JUDGED_S)
