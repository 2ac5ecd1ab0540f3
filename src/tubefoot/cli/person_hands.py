"""The hands of a person at the real gripper: asked in the terminal, one thing at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from tubefoot.errors import LinkError


class PersonHands:
    """Asks a person; the pumps stand meanwhile."""

    def __init__(self, height: float, ask: Callable[[str], str] = input):
        """Choose how to ask.

        height : of the object's middle above the outer face of the base [mm]
        ask : prints a prompt and returns the answer; EOFError where nobody can answer
        """
        self._height = height
        self._put = ask
        self._asked_release = False

    def place(self) -> float:
        """Ask for the object."""
        self._ask(
            f"Hold the object between the fingers, its middle {self._height:.0f} mm above the base, and "
            "press Enter: "
        )
        return 0.0

    def release(self) -> float:
        """Ask to let go."""
        self._asked_release = True
        self._ask("Both fingers hold it. Let go of the object and press Enter: ")
        return 0.0

    def lift(self) -> float:
        """Ask for the lift."""
        self._ask("Lift the gripper slowly, and press Enter when it is up: ")
        return 0.0

    def shake(self) -> float:
        """Ask to shake it."""
        self._ask("Shake the gripper a little up and down, then sideways, and press Enter: ")
        return 0.0

    def lower(self) -> float:
        """Ask to set it down."""
        self._ask("Set the gripper down, put a hand under the object, and press Enter: ")
        return 0.0

    def verdict(self) -> dict[str, Any]:
        """What the person saw: whether the object was held, how far it slipped, whether it is damaged; held
        is None where nobody answers."""
        if not self._asked_release:
            return {"held": False, "slip_mm": None}
        try:
            return self._asked()
        except LinkError:
            return {"held": None, "slip_mm": None}

    def _asked(self) -> dict[str, Any]:
        held = self._ask("Was it held all the time? [y/n] ").strip().lower().startswith("y")
        slip = self._ask("How far did it slip [mm], empty if not measured: ").strip().replace(",", ".")
        damaged = self._ask("Do you see damage? [y/n] ").strip().lower().startswith("y")
        return {"held": held, "slip_mm": float(slip) if _is_number(slip) else None, "damage_seen": damaged}

    def _ask(self, prompt: str) -> str:
        """The answer; raises LinkError where the terminal's input has ended."""
        try:
            return self._put(prompt)
        except EOFError:
            raise LinkError(
                "nobody answers: the terminal's input has ended; run it in a terminal, not from a pipe"
            ) from None


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
