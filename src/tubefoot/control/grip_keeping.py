"""Making a grip firm while a hand holds the object, and keeping it when the object is free.

While the hand holds, both fingers' forces rise side by side: if one pressed harder it would push the object
along when the hand lets go. Where more pulses hardly add force they only curl the fingers, and the grip is as
firm as it gets.

Later the walls relax and the air in the branches gives way, in no two fingers alike, so after the last pulse
the force falls and the pair of fingers drifts sideways, by some millimetres in ten seconds. A finger that
recedes rolls its flank off the object, one that advances pushes it along, and the object slips on one of
them. Short pulses undo both. How far a flank has moved is read from both halves' turns (`GripLever`).
"""

from __future__ import annotations

from collections.abc import Sequence

from tubefoot.control.first_contact import GripLever, Pause
from tubefoot.control.grasp_settings import GripSettings
from tubefoot.control.grip_goal import GripGoal

EVEN_SHARE, STALLED_SHARE = 0.1, 0.05
"""Of the wanted force: by which one finger may be ahead of the other; less in some pulses is no progress."""


class GripBuilder:
    """Decides on the pulses after contact.

    shortcoming : in words, where the grip was left weaker than friction needs; empty else
    """

    def __init__(self, goal: GripGoal, settings: GripSettings, coupled: bool):
        """Begin at contact.

        goal : of the force; settings : of the grip; coupled : one pump for both fingers
        """
        self._goal, self._settings, self._coupled = goal, settings, coupled
        self._reached: list[float] = []
        self.shortcoming = ""

    def pulses(self, forces: Sequence[float]) -> tuple[int, int]:
        """Fingers to be pulsed inward; none when the grip is firm, or as firm as it gets.

        forces : of both fingers, estimated [N]
        """
        goal, weaker = self._goal, min(forces)
        self._reached.append(weaker)
        if weaker >= goal.force or max(forces) >= goal.most:
            return 0, 0
        count = len(self._reached) - 1
        if self._stalled() or count >= self._settings.pulses_max:
            if weaker < goal.needed:
                self.shortcoming = (
                    f"grip of {weaker:.3f} N instead of {goal.force:.3f} N after {count} pulses; "
                    "more would only curl the fingers"
                )
            return 0, 0
        if self._coupled:
            return 1, 1
        least = min(goal.force, weaker + EVEN_SHARE * goal.force)
        return int(forces[0] < least), int(forces[1] < least)

    def _stalled(self) -> bool:
        """Whether the last pulses hardly made the grip firmer."""
        before = self._reached[: -self._settings.stalled_pulses]
        return bool(before) and self._reached[-1] - before[-1] < STALLED_SHARE * self._goal.force


class GripKeeper:
    """Decides on the pulses of one hold."""

    def __init__(self, goal: GripGoal, settings: GripSettings, lever: GripLever, coupled: bool):
        """Begin before the object is free.

        goal : of the force; settings : of the grip; lever : of a contact at the object's height
        coupled : one pump for both fingers, which cannot put the object back
        """
        self._goal, self._settings, self._lever = goal, settings, lever
        self._coupled = coupled
        self._place: float | None = None
        self._wanted = goal.force

    def pulses(self, pauses: Sequence[Pause], forces: Sequence[float]) -> tuple[int, int]:
        """Direction of the right and the left finger's pulse, inward +1, 0 for none.

        pauses : of both fingers, angles known; forces : on the free object, estimated [N]

        The place of the first call is the one that is kept, and its force where the grip got no firmer. A
        free object feels both forces alike, so the mean of their estimates counts.
        """
        force = 0.5 * sum(forces)
        if self._place is None:
            self._place = self._middle(pauses)
            self._wanted = min(self._goal.force, max(force, self._goal.needed))
        inward, outward = force < self._goal.most, force > self._wanted
        drift = self._middle(pauses) - self._place
        if not self._coupled and abs(drift) > self._settings.keep_mm:
            advancing = 0 if drift > 0.0 else 1
            if outward or not inward:
                return (-1, 0) if advancing == 0 else (0, -1)
            return (0, 1) if advancing == 0 else (1, 0)
        if inward and force < self._settings.keep_share * self._wanted:
            return 1, 1
        return 0, 0

    def _middle(self, pauses: Sequence[Pause]) -> float:
        """Where the middle between both flanks lies, positive to the left [mm]."""
        right, left = (self._lever.reach(pause) for pause in pauses)
        return 0.5 * (right - left)
