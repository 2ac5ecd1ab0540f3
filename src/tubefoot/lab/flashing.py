"""Putting the firmware on the board with avrdude."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tubefoot.errors import ConfigError, LinkError
from tubefoot.lab.messages import BAUD

ATTEMPTS = 3
"""The boot loader listens for a second after a reset; a slow computer may miss it once."""


def flash(port: str, program: Path, timeout: float = 120.0) -> str:
    """What avrdude reported, after it wrote and verified a program.

    port : serial port of an Arduino Uno
    program : Intel hex file
    timeout : longest time [s]

    Raises ConfigError when avrdude or the file is missing, LinkError when the board did not take it.
    """
    if shutil.which("avrdude") is None:
        raise ConfigError("avrdude is not installed; `sudo apt-get install avrdude`")
    if not program.exists():
        raise ConfigError(f"{program}: no such file; `make -C firmware` builds it")
    command = ["avrdude", "-p", "atmega328p", "-c", "arduino", "-P", port, "-b", str(BAUD), "-D"]
    report = ""
    for _ in range(ATTEMPTS):
        try:
            outcome = subprocess.run(
                [*command, "-U", f"flash:w:{program}:i"],
                capture_output=True,
                text=True,
                check=False,
                timeout=timeout,
            )
        except subprocess.TimeoutExpired:
            raise LinkError(
                f"{port}: avrdude did not finish in {timeout:g} s; is it the right port?"
            ) from None
        report = outcome.stderr.strip()
        if outcome.returncode == 0:
            return report
    raise LinkError(
        f"{port}: avrdude could not flash the board; check the port and that no other program has it open:\n"
        f"{report[-1000:]}"
    )
