"""Where the board's program and its simulator are, built on first use."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from tubefoot.errors import ConfigError

FOLDER = Path(__file__).resolve().parents[3] / "firmware"
BUILD = FOLDER / "build"
BOOTLOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot_atmega328.hex")


def built(name: str) -> Path:
    """Path of a file that `make -C firmware` builds, building it first when it is missing.

    name : `board.elf`, `board.hex`, `board_test.elf`, `bridge`, `fuzz`, ...

    Raises ConfigError when there are no sources or the build fails.
    """
    path = BUILD / name
    if path.exists():
        return path
    if not (FOLDER / "Makefile").exists():
        raise ConfigError(
            "the simulated board needs Tubefoot's source tree with its folder `firmware`; "
            "work in a checkout of the repository, or use a real board with --port"
        )
    if shutil.which("make") is None or shutil.which("avr-gcc") is None:
        raise ConfigError(
            "the firmware is not built, and make or avr-gcc is missing; "
            "run `make setup`, or install the packages listed in scripts/debian-packages.txt"
        )
    print("building the firmware and its simulator (once, some seconds) ...", file=sys.stderr)
    outcome = subprocess.run(
        ["make", "-C", str(FOLDER), f"build/{name}"], capture_output=True, text=True, check=False
    )
    if outcome.returncode != 0 or not path.exists():
        raise ConfigError(f"`make -C {FOLDER}` failed:\n{outcome.stderr[-2000:]}")
    return path
