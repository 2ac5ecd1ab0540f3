"""The desk between pages and bench: who may say what, and what becomes of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from tubefoot.config import parse_settings
from tubefoot.dashboard import chores, wishes
from tubefoot.dashboard.feed import Feed
from tubefoot.dashboard.helm import Helm
from tubefoot.dashboard.orders import ORDERS, parse_order
from tubefoot.dashboard.session import Session
from tubefoot.errors import ConfigError, SafetyStop

Answer = dict[str, Any]


class Showing(Protocol):
    """What the server shows: a live bench, or a replay."""

    feed: Feed

    def start(self) -> None:
        """Begin; raises what went wrong."""

    def close(self) -> None:
        """End."""

    def beat(self, page: str) -> None:
        """Hear that a page lives.

        page : its name
        """

    def do(self, page: str, message: Mapping[str, Any]) -> Answer:
        """Do what a page wants; raises a TubefootError when that is not possible.

        page : its name
        message : with the key `do`
        """

    def trip(self, who: str) -> str:
        """Stop the pump now; what came of it.

        who : asked for it
        """


class Desk:
    """A live bench with its helm."""

    def __init__(self, session: Session):
        """Sit before a bench.

        session : of the bench
        """
        self.feed: Feed = session.feed
        self._session = session
        self._helm: Helm = session.helm

    def start(self) -> None:
        """Open the bench."""
        self._session.start()

    def close(self) -> None:
        """Close it."""
        self._session.close()

    def beat(self, page: str) -> None:
        """Hear that a page lives.

        page : its name
        """
        self._helm.beat(page)
        self._session.tell_pages()

    def trip(self, who: str) -> str:
        """Stop the pump now; any page may.

        who : asked for it
        """
        return self._session.trip(who)

    def do(self, page: str, message: Mapping[str, Any]) -> Answer:
        """Do what a page wants.

        page : its name
        message : with the key `do`; raises ConfigError for an unknown one
        """
        word = str(message.get("do"))
        if word == "take":
            return self._take(page)
        if self._helm.holder != page:
            raise SafetyStop("this page watches; press `take control` first")
        if word == "give_back":
            self._helm.give(page)
            self._session.tell_pages()
            return {}
        order = parse_order({key: value for key, value in message.items() if key != "goes_on"})
        if order is not None:
            self._session.give(order, bool(message.get("goes_on")))
            return {"began": order.text}
        return self._wish(word, message)

    def _take(self, page: str) -> Answer:
        self.beat(page)
        granted = self._helm.take(page)
        self._session.tell_pages()
        if not granted:
            raise SafetyStop("another page is in control; it must give control back, or be closed")
        return {}

    def _wish(self, word: str, message: Mapping[str, Any]) -> Answer:
        """What is done at once, beside the running order."""
        session = self._session
        match word:
            case "stop":
                session.stop("stopped from the page")
            case "release":
                session.release()
            case "keep_going":
                session.keep_going(bool(message.get("goes_on")))
            case "record":
                pictures = parse_settings(dict(message), wishes.Record, source="record").pictures
                session.errand(lambda: chores.begin_recording(session, pictures))
            case "end_record":
                if session.busy:
                    raise ConfigError("what runs is being recorded; stop it first, or wait for its end")
                session.errand(lambda: chores.end_recording(session))
            case "answer":
                said = parse_settings(dict(message), wishes.Reply, source="answer")
                if not session.questions.answer(said.id, said.text):
                    raise ConfigError("this question is no longer open")
            case _:
                known = [
                    "take",
                    "give_back",
                    "stop",
                    "release",
                    "keep_going",
                    "record",
                    "end_record",
                    "answer",
                ]
                raise ConfigError(f"unknown order {word!r}; there are {', '.join([*ORDERS, *known])}")
        return {}
