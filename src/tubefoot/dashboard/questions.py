"""A calibration's questions, asked on the page: the bench goes on while a person does what is asked."""

from __future__ import annotations

import threading

from tubefoot.dashboard.feed import Feed
from tubefoot.lab.operator import Operator, Person
from tubefoot.lab.rig import Rig

ASK_AGAIN_S = 0.2


class Questions:
    """One question at a time, from the bench's thread to whoever is in control."""

    def __init__(self, feed: Feed):
        """Begin without a question.

        feed : where it is shown
        """
        self._feed = feed
        self._lock = threading.Lock()
        self._number = 0
        self._answer: str | None = None

    def ask(self, text: str, rig: Rig, wants_number: bool) -> str:
        """The answer; waiting for it keeps the bench alive, and ends as any order ends.

        text : the question
        rig : that is waited on
        wants_number : whether a number is asked for, or only that it is done
        """
        with self._lock:
            self._number += 1
            self._answer = None
            self._feed.tell(question={"id": self._number, "text": text, "number": wants_number})
        while (answer := self._taken()) is None:
            rig.wait(ASK_AGAIN_S)
        return answer

    def answer(self, number: int, text: str) -> bool:
        """Whether an answer was to the question that is open.

        number : of the question
        text : the answer
        """
        with self._lock:
            if number != self._number or self._feed.status.get("question") is None:
                return False
            self._answer = text
            return True

    def _taken(self) -> str | None:
        with self._lock:
            if self._answer is not None:
                self._feed.tell(question=None)
            return self._answer


class PageOperator:
    """The hands at the bench: a person who reads the page, or on a virtual bench its simulated ones."""

    def __init__(self, questions: Questions, rig: Rig, hands: Operator | None):
        """Choose who does it.

        questions : where it is asked
        rig : of the bench
        hands : do it once the page has said so; None for a person, who also reads gauge and scale
        """
        self._questions = questions
        self._rig = rig
        self._hands = hands
        self._person = Person(lambda prompt: questions.ask(prompt.rstrip(": "), rig, wants_number=True))

    def vent(self) -> None:
        """Have both branches opened."""
        self._confirm("Open both branches to the air, with the outlets over cups.")
        if self._hands is not None:
            self._hands.vent()

    def apply_pressure(self, branch: str, pressure_kpa: float) -> float:
        """The reference pressure [kPa].

        branch : which
        pressure_kpa : what to set, about
        """
        if self._hands is None:
            return self._person.apply_pressure(branch, pressure_kpa)
        return self._hands.apply_pressure(branch, pressure_kpa)

    def pumped_ml(self, direction: int) -> float:
        """The volume that came out [mL].

        direction : 1 forward, -1 reverse
        """
        if self._hands is None:
            return self._person.pumped_ml(direction)
        return self._hands.pumped_ml(direction)

    def tidy(self) -> None:
        """Have the bench put back in order."""
        self._confirm("Close both branches again and let the finger come to rest, straight.")

    def _confirm(self, what: str) -> None:
        self._questions.ask(what, self._rig, wants_number=False)
