"""Where the board's program and its simulator are: in a checkout, or carried by the installed package.

A checkout builds into `firmware/build`. An installed package carries the sources and the board's program;
what is compiled for this computer is built on first use in the user's cache: the package may be read-only.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from tubefoot.errors import ConfigError

CHECKOUT = Path(__file__).resolve().parents[3] / "firmware"
CARRIED = Path(__file__).resolve().parents[1] / "firmware"
FOLDER = CHECKOUT if (CHECKOUT / "Makefile").exists() else CARRIED
BUILD = FOLDER / "build"
BOOTLOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot_atmega328.hex")
COMPILERS = {"bridge": "cc", "core.so": "g++"}
"""What builds files for this computer; all others are built for the board."""


def built(name: str) -> Path:
    """Path of a file that `make -C firmware` builds, building it first when it is missing.

    name : `board.elf`, `board.hex`, `board_test.elf`, `bridge`, `fuzz`, ...

    Raises ConfigError when there are no sources or the build fails.
    """
    shipped = BUILD / name
    if shipped.exists():
        return shipped
    path = _build_folder() / name
    if path.exists():
        return path
    if not (FOLDER / "Makefile").exists():
        raise ConfigError(
            "the firmware's sources are missing from this installation; install Tubefoot again, "
            "or work in a checkout of the repository"
        )
    compiler = COMPILERS.get(name, "avr-gcc")
    if shutil.which("make") is None or shutil.which(compiler) is None:
        raise ConfigError(
            f"the firmware's {name} is not built, and make or {compiler} is missing; "
            "run `make setup`, or install the packages listed in scripts/debian-packages.txt"
        )
    print("building the firmware and its simulator (once, some seconds) ...", file=sys.stderr)
    outcome = subprocess.run(
        ["make", "-C", str(FOLDER), f"B={path.parent}", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    if outcome.returncode != 0 or not path.exists():
        raise ConfigError(
            f"`make -C {FOLDER}` failed; are the packages of scripts/debian-packages.txt installed?\n"
            f"{outcome.stderr[-2000:]}"
        )
    return path


def _build_folder() -> Path:
    """Where files are built: in a checkout beside the sources, else in the cache under the sources' hash."""
    if FOLDER == CHECKOUT:
        return BUILD
    digest = hashlib.sha256()
    for path in sorted(FOLDER.rglob("*")):
        if path.is_file() and not path.is_relative_to(BUILD):
            digest.update(path.relative_to(FOLDER).as_posix().encode() + path.read_bytes())
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "tubefoot" / f"firmware-{digest.hexdigest()[:12]}"
