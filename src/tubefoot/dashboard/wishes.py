"""Keys of what a page may want beside orders."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tubefoot.config import Settings


class Record(Settings):
    """Begin a recording."""

    do: Literal["record"]
    pictures: bool = True
    """whether camera frames are recorded"""


class Reply(Settings):
    """Answer a calibration's question."""

    do: Literal["answer"]
    id: int
    """of the question"""
    text: str = Field(default="", max_length=200)
    """the answer"""


class Seek(Settings):
    """Move a replay."""

    do: Literal["seek"]
    time_s: float = Field(ge=0)
    """where to, from the recording's begin"""


class Speed(Settings):
    """Change a replay's speed."""

    do: Literal["speed"]
    factor: float = Field(gt=0, le=20)
    """of the recorded time"""
