"""The fenced blocks of Markdown pages, with the comment before each that says how tests treat it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

BLOCK = re.compile(
    r"(?:<!-- *(?P<mark>[^>]*?) *-->\n)?^(?P<fence>```+)(?P<info>[^\n`]*)\n(?P<text>.*?)^(?P=fence)[ ]*$",
    re.M | re.S,
)
RUNS = ("sh", "python")
LANGUAGES = (*RUNS, "toml", "text", "csv")


@dataclass(frozen=True)
class Block:
    """A block of code: its page, the line it begins in, its language, its mark and its text."""

    page: Path
    line: int
    language: str
    mark: str
    text: str

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.name}:{self.line}"

    def marked(self, word: str) -> bool:
        """Whether its mark begins with a word."""
        return self.mark.split(":")[0] == word

    @property
    def commands(self) -> list[list[str]]:
        """Words of each line of a shell block that calls tubefoot, without comments."""
        lines = self.text.replace("\\\n", " ").split("\n")
        words = [shlex.split(line, comments=True) for line in lines]
        return [line for line in words if line and line[0] == "tubefoot"]


def blocks_of(page: Path) -> Iterator[Block]:
    """The blocks of a page in their order; directives of Sphinx are no code."""
    text = page.read_text(encoding="utf-8")
    for found in BLOCK.finditer(text):
        language = found["info"].strip()
        if not language.startswith("{"):
            line = text.count("\n", 0, found.start("fence")) + 1
            yield Block(page, line, language, found["mark"] or "", found["text"])
