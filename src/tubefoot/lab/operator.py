"""The hands at the bench during a calibration: a person who is asked, or a simulated one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from tubefoot.errors import ConfigError


class Operator(Protocol):
    """What a calibration asks of whoever stands at the bench."""

    def vent(self) -> None:
        """Open both branches to the air, the pump's outlets over cups."""

    def apply_pressure(self, branch: str, pressure_kpa: float) -> float:
        """The pressure that a reference gauge shows [kPa], after setting about this one.

        branch : `right`, `left`, ...
        pressure_kpa : what to set, about
        """

    def pumped_ml(self, direction: int) -> float:
        """What came out since the last call, weighed or read from a cylinder [mL], positive.

        direction : 1 forward, -1 reverse
        """


class Person:
    """Asks a person, one question at a time."""

    def __init__(self, ask: Callable[[str], str] = input):
        """Choose how to ask.

        ask : prints a prompt and returns the answer
        """
        self._ask = ask

    def vent(self) -> None:
        """Ask for open branches."""
        self._ask("Open both branches to the air, with the outlets over cups, then press Enter: ")

    def apply_pressure(self, branch: str, pressure_kpa: float) -> float:
        """The answered reference pressure [kPa].

        branch : which
        pressure_kpa : what to set, about
        """
        return self._number(
            f"Set the {branch} branch to about {pressure_kpa:g} kPa with the syringe, wait until it rests, "
            "and type what the reference gauge shows [kPa]: "
        )

    def pumped_ml(self, direction: int) -> float:
        """The answered volume [mL].

        direction : 1 forward, -1 reverse
        """
        way = "forward" if direction > 0 else "reverse"
        return self._number(
            f"Type what came out while pumping {way} [mL, or grams of water], then empty the cup: "
        )

    def _number(self, prompt: str) -> float:
        for _ in range(3):
            answer = self._ask(prompt)
            try:
                return float(answer.replace(",", "."))
            except ValueError:
                prompt = f"{answer!r} is no number. " + prompt.removeprefix(f"{answer!r} is no number. ")
        raise ConfigError("three answers that are no number; calibration given up, nothing was changed")
