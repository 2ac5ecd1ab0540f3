"""Docstrings of this house as reStructuredText: parameters as fields, formulas as they stand.

In the sources a parameter is described by `name : text`, several in a line parted by semicolons; a formula is
an indented paragraph; the verbs of the command line use a section `Parameters` with indented descriptions.
"""

from __future__ import annotations

import re
import textwrap
from typing import Any

NAMES = r"\*{0,2}[A-Za-z_]\w*(?:, \*{0,2}[A-Za-z_]\w*)*"
ITEM = re.compile(rf"^({NAMES}) : (.*)$")
NEXT_ITEM = re.compile(rf"; (?=(?:{NAMES}) : )")


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx.

    app : of Sphinx
    """
    app.connect("autodoc-process-docstring", translate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def translate(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Replace the lines of a docstring by reStructuredText.

    app, what, name, obj, options : as Sphinx gives them; lines : changed in place
    """
    lines[:] = restructured("\n".join(lines)).split("\n")


def restructured(text: str) -> str:
    """A docstring as reStructuredText.

    text : as `inspect.getdoc` gives it
    """
    text, section = _without_parameters(text)
    parts = [_paragraph(part) for part in re.split(r"\n\s*\n", text.strip("\n"))]
    fields = [field for _, found in parts for field in found] + section
    body = "\n\n".join(part for part, _ in parts if part)
    return "\n\n".join(part for part in (body, "\n".join(fields)) if part) + "\n"


def _paragraph(part: str) -> tuple[str, list[str]]:
    """A paragraph without its parameters, and these as fields."""
    if part.startswith(" "):
        return "::\n\n" + textwrap.indent(textwrap.dedent(part), "    "), []
    if part.lstrip().startswith(">>>"):
        return part, []
    plain: list[str] = []
    items: list[str] = []
    for line in part.split("\n"):
        if ITEM.match(line):
            items += NEXT_ITEM.split(line)
        elif items:
            *before, last = NEXT_ITEM.split(f"{items[-1]} {line.strip()}")
            items[-1:] = [*before, last]
        else:
            plain.append(_escaped(line))
    return "\n".join(plain), [field for item in items for field in _fields(item)]


def _fields(item: str) -> list[str]:
    """One field for each name that a description is of."""
    found = ITEM.match(item)
    assert found is not None, "items are made by matching"
    names, text = found.groups()
    return [f":param {name}: {_escaped(text)}" for name in names.replace("*", "").split(", ")]


def _without_parameters(text: str) -> tuple[str, list[str]]:
    """The text before a section `Parameters`, and that section as fields."""
    head, found, tail = text.partition("\nParameters\n----------\n")
    if not found:
        return text, []
    fields: list[str] = []
    for line in tail.split("\n"):
        if line and not line.startswith(" "):
            fields.append(f":param {line.split(' : ')[0]}:")
        elif line.strip() and fields:
            fields[-1] += f" {_escaped(line.strip())}"
    return head, fields


def _escaped(line: str) -> str:
    """A line whose signs mean themselves, but for code between backticks."""
    parts = re.split(r"(``?[^`]+``?)", line)
    text = ""
    for place, part in enumerate(parts):
        if place % 2 == 0:
            text += re.sub(r"([\\*|]|(?<=\w)_(?!\w))", r"\\\1", part)
            continue
        # Code begins and ends with words: a backslash and a space stand for nothing.
        before = "\\ " if re.search(r"\w$", text) else ""
        after = "\\ " if re.match(r"[\w(]", parts[place + 1]) else ""
        text += f"{before}``{part.strip('`')}``{after}"
    return text
