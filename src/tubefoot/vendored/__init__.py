"""Code of others that the pages carry with them, each with its licence; see README.md beside it."""

from __future__ import annotations

from functools import cache
from importlib.resources import files


@cache
def vendored_text(name: str) -> str:
    """The text of a file in this folder.

    name : path below the folder, such as `three/three.min.js`
    """
    return files(__name__).joinpath(name).read_text(encoding="utf-8")
