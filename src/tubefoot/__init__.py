"""Tubefoot: an open toolchain for compact hydraulic soft fingers."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("tubefoot")
except PackageNotFoundError:  # running from a source tree that was never installed
    __version__ = "0+unknown"
