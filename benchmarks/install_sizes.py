"""What each extra costs to install: `python -m benchmarks.install_sizes [EXTRA ...]`.

Builds the wheel, installs it with one set of extras at a time into an empty virtual environment, and tells
the megabytes that came to it and the seconds that pip took, on the wall and of the processor. What pip has
cached it does not fetch again. The table is in docs/how_to/install.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
SETS = ("", "lab", "vision", "twin", "lab,vision,twin", "dashboard", "fea", "study", "cad", "tetrahedra")
MB = 1e6


def build_wheel(directory: Path) -> Path:
    """The wheel of this checkout.

    directory : where it goes
    """
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(directory), str(ROOT)]
    subprocess.run(command, check=True)
    return next(directory.glob("tubefoot-*.whl"))


def installed(wheel: Path, extras: str, directory: Path) -> tuple[float, float, float, int]:
    """Megabytes of a fresh environment, seconds of its installation (wall, processor), number of packages.

    wheel : of tubefoot; extras : parted by commas, may be empty; directory : for the environment
    """
    subprocess.run([sys.executable, "-m", "venv", str(directory)], check=True)
    bare = size_of(directory)
    pip = [str(directory / "bin" / "python"), "-m", "pip"]
    wanted = f"{wheel}[{extras}]" if extras else str(wheel)
    began, worked = time.perf_counter(), _processor_s()
    subprocess.run([*pip, "install", "-q", "-c", str(ROOT / "constraints.txt"), wanted], check=True)
    seconds, worked = time.perf_counter() - began, _processor_s() - worked
    listed = subprocess.run([*pip, "list", "--format=freeze"], check=True, capture_output=True, text=True)
    return (size_of(directory) - bare) / MB, seconds, worked, len(listed.stdout.split()) - 1


def _processor_s() -> float:
    """Processor seconds of all children that have ended."""
    used = os.times()
    return used.children_user + used.children_system


def size_of(directory: Path) -> float:
    """Bytes of the files below a directory, links not followed.

    directory : any
    """
    return float(sum(path.lstat().st_size for path in directory.rglob("*") if path.is_file()))


def main() -> None:
    """Print a row for each set of extras."""
    with tempfile.TemporaryDirectory() as name:
        store = Path(name)
        wheel = build_wheel(store)
        print(f"wheel: {wheel.stat().st_size / MB:.1f} MB")
        print("| extras | MB | wall s | processor s | packages |\n| --- | --- | --- | --- | --- |")
        for number, extras in enumerate(sys.argv[1:] or SETS):
            megabytes, seconds, worked, packages = installed(wheel, extras, store / f"venv-{number}")
            label = f"`{extras}`" if extras else "none"
            print(f"| {label} | {megabytes:.0f} | {seconds:.0f} | {worked:.0f} | {packages} |", flush=True)
            subprocess.run(["rm", "-rf", str(store / f"venv-{number}")], check=True)


if __name__ == "__main__":
    main()
