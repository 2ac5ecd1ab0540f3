"""What the wheel carries beside the package: the firmware's sources, and its program if it can be built."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCES = ("Makefile", "messages.toml", "generate_messages.py", "finger_rig", "native", "simulator/bridge.c")
BESIDE = ("simulator/README.md", "licences")
BOARD = ("board.elf", "board.hex")


class FirmwareHook(BuildHookInterface[Any]):
    """Adds `tubefoot/firmware` to a wheel; an editable installation reads the checkout's folder instead."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files.

        version : kind of wheel; build_data : gets `force_include`
        """
        if version == "editable":
            return
        folder = Path(self.root) / "firmware"
        carried = {name: folder / name for name in (*SOURCES, *BESIDE)}
        if shutil.which("avr-gcc") and shutil.which("make"):
            targets = [f"build/{name}" for name in BOARD]
            subprocess.run(["make", "-s", "-C", str(folder), *targets], check=True)
        for name in BOARD:
            built = folder / "build" / name
            if built.exists():
                carried[f"build/{name}"] = built
            else:
                self.app.display_warning(f"no avr-gcc: the wheel goes without firmware/{name}")
        for name, path in carried.items():
            build_data["force_include"][str(path)] = f"tubefoot/firmware/{name}"
