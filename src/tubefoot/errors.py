"""The errors that Tubefoot raises on purpose: one small tree, each with a message a user can act on.

A message says what was asked, what is allowed, in which unit, and what to do.
"""

from __future__ import annotations

from typing import Any


class TubefootError(Exception):
    """Base of every error that Tubefoot raises on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class ConfigError(TubefootError):
    """A setting, file or argument that cannot be used as it is."""

    exit_code = 2


class GeometryError(TubefootError):
    """Dimensions that do not make a finger, or a mesh that is not fit for a solve."""

    exit_code = 2


class ConvergenceError(TubefootError):
    """A solve that ended before its goal.

    message : what was reached, what was not, and why
    history : what the solver tried, one entry a trial step
    last_state : the last converged state, or None where there was none
    """

    exit_code = 3

    def __init__(self, message: str, history: list[Any] | None = None, last_state: Any = None):
        super().__init__(message)
        self.history = history or []
        self.last_state = last_state


class LinkError(TubefootError):
    """A board, camera or file that does not answer, or answers nonsense."""

    exit_code = 4


class SafetyStop(TubefootError):
    """The bench stopped for safety.

    message : what was measured and the limit it broke; code : the fault code that the board latched
    """

    exit_code = 5

    def __init__(self, message: str, code: int = 0):
        super().__init__(message)
        self.code = code
